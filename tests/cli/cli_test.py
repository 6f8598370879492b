"""Runs the real program: exit codes, JSON, files. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/cli_test.py
"""
import gzip
import json
import re
import signal
import struct
import subprocess
import unittest

from covol_case import CENTER, COMMANDS, COVOL, ORIGIN, RADIUS, SIZE, Case, H, ball_bytes, radius_of, sphere_points, write_nrrd, write_xyz


class Usage(Case):
    def test_help_and_version(self):
        self.assertIn("segment", self.run_covol("--help").stdout)
        self.assertRegex(self.run_covol("--version").stdout, r"covol \d+\.\d+")
        for command in COMMANDS:
            self.assertIn("Usage", self.run_covol(command, "--help").stdout)

    def test_wrong_command_lines(self):
        self.refuse(code=2)
        self.refuse("melt", code=2)
        self.refuse("segment", self.image, code=2, expected_text="--output")
        self.refuse("segment", self.image, "-o", "s.vdb", "--no-such-flag", code=2, expected_text="--no-such-flag")

    def test_what_was_expected(self):
        """Messages about values that the parser of options refuses."""
        job = ("segment", self.image, "-o", "s.vdb")
        for words, expected_text in (
                ((*job, "--theta", 0.5, "--theta", 0.4, "--theta", 0.3),
                 "--theta: expected one value, got 3 ('0.5', '0.4', '0.3'); give the option once; see covol segment"),
                ((*job, "-o", "t.vdb"), "--output: expected one value, got 2 ('s.vdb', 't.vdb'); give the option once"),
                ((*job, "--threads", 1, "--threads", 2), "--threads: expected one value, got 2"),
                ((*job, "--max-steps", 0.5), "--max-steps: expected a whole number, got '0.5'"),
                ((*job, "--max-steps", 10**12), "in the range of this option, got '1000000000000'"),
                ((*job, "--checkpoint-every", "x"), "--checkpoint-every: expected a number (SECONDS), got 'x'"),
                ((*job, "--half=maybe"), "--half: expected true or false, got 'maybe'"),
                ((*job, "--model", "pper"), "--model: expected guided or paper, got 'pper'; did you mean paper?"),
                ((*job, "--config", "a.toml", "--config", "b.toml"),
                 "--config: expected one file of options, got 2 ('a.toml', 'b.toml'); write all options into one file"),
                ((*job, "--config", "none.toml"), "--config none.toml: no such file"),
                ((*job, "--config", self.inputs), "expected a file of options, got a folder"),
                (("segment", self.image), "expected -o, --output OUT.vdb|..., which is required"),
                (("info",), "expected FILE, which is required; see covol info --help"),
                (("info", self.image, "b.nrrd", "c.nrrd"),
                 "unexpected: 'b.nrrd', 'c.nrrd'; covol info takes only FILE and options"),
                (("--threads", 2), "expected a command")):
            with self.subTest(words[-2:]):
                self.refuse(*words, code=2, expected_text=expected_text)
        self.assertIn("--points: expected a value, [NAME=]FILE..., got none",
                      self.run_covol(*job, "--points", code=2).stderr)

    def test_text_instead_of_numbers(self):
        for flag in ("--theta", "--tau", "--tag-distance", "--exterior-seed", "--roi", "--max-steps"):
            line = self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", flag, "many", code=2, expected_text=flag)
            self.assertIn("many", line)
        self.refuse("segment", self.image, "-o", "s.vdb", "--init", "cube:1,2,3", code=2, expected_text="sphere:x,y,z,r")
        self.refuse("segment", self.image, "-o", "s.vdb", "--init", "sphere:1,2,3", code=2, expected_text="sphere:x,y,z,r")


class Segment(Case):
    def test_from_files_to_files(self):
        self.segment("--mask", "m.nrrd", "--mesh", "m.ply", "--json", "r.json", "--density", "d.vdb")
        self.assertEqual(self.files(), ["d.vdb", "m.nrrd", "m.ply", "r.json", "s.vdb"])
        report = json.loads((self.out / "r.json").read_text())
        self.assertEqual(report["command"], "segment")
        self.assertEqual(report["input"]["image"]["size"], [SIZE] * 3)
        self.assertEqual(report["input"]["points"]["count"], 1500)
        self.assertAlmostEqual(report["grid"]["voxel_size"], H)
        self.assertGreater(report["grid"]["active_voxels"], 0)
        self.assertGreater(report["grid"]["leaf_count"], 0)
        self.assertEqual(report["solve"]["stop_reason"], "steady")
        for field in ("steps", "last_change", "sweeps_per_step"):
            self.assertIn(field, report["solve"])
        surface = report["surface"]
        self.assertTrue(surface["closed"])
        self.assertEqual((surface["components"], surface["genus"]), (1, 0))
        self.assertLess(abs(radius_of(surface["volume"]) - RADIUS), 0.25 * H)
        self.assertLess(report["fit"]["points_to_surface"]["mean"], 0.5 * H)
        for stage in ("read", "distance", "tag", "edge", "solve", "surface", "write", "total"):
            self.assertGreaterEqual(report["seconds"][stage], 0)
        self.assertGreater(report["peak_rss_bytes"], 1 << 20)
        self.assertIn("1500 marks", report["automatic"]["guess"])
        self.assertTrue(report["guidance"]["used"], report["guidance"])
        self.assertEqual(report["fit"]["marks_off"]["count"], 0)
        # The level set s.vdb, the mask m.nrrd and the mesh m.ply contain the same solid.
        for other in ("m.nrrd", "m.ply"):
            alike = self.report("compare", "s.vdb", other)["compare"]
            self.assertGreater(alike["dice"], 0.97)
            self.assertLess(alike["mean_distance"], 0.5 * H)
        fit = self.report("compare", self.points, "s.vdb")["fit"]["points_to_surface"]
        self.assertAlmostEqual(fit["mean"], report["fit"]["points_to_surface"]["mean"], places=4)
        self.assertEqual(self.files(), ["d.vdb", "m.nrrd", "m.ply", "r.json", "s.vdb"])

    def voxels_of(self, name):
        """Of a .nrrd that covol wrote: a header, an empty line, and gzip."""
        return gzip.decompress((self.out / name).read_bytes().split(b"\n\n", 1)[1])

    def test_the_value_in_the_mask(self):
        self.segment("--mask", "one.nrrd", points=self.sparse)
        self.segment("--mask", "other.nrrd", "--mask-label", 255, "--table", "t.csv", points=self.sparse)
        one, other = self.voxels_of("one.nrrd"), self.voxels_of("other.nrrd")
        self.assertEqual((set(one), set(other)), ({0, 1}, {0, 255}))
        self.assertEqual(one.replace(b"\1", b"\xff"), other)
        header, row = (line.split(",") for line in (self.out / "t.csv").read_text().splitlines())
        self.assertEqual(row[header.index("label")], "255")
        self.assertIn("bit-identical", self.run_covol("rerun", "s.vdb", "--inputs", self.inputs).stdout)
        for name in self.files():
            (self.out / name).unlink()
        for label in 0, 256, -1:
            self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", "--mask", "m.nrrd", "--mask-label", label, code=3,
                        expected_text="--mask-label")
        self.refuse("segment", self.image, "--points", f"a={self.points}", f"b={self.points}", "-o", "s.vdb", "--mask", "m.nrrd",
                    "--mask-label", 7, code=2, expected_text="expected one structure, got 2; leave it out")

    def test_provenance(self):
        self.segment("--theta", "0.75", "--mesh", "m.ply", points=self.sparse)
        grids = self.report("info", "s.vdb")["grids"]
        self.assertEqual([g["name"] for g in grids], ["surface"])
        self.assertEqual(grids[0]["class"], "level set")
        metadata = grids[0]["metadata"]
        self.assertRegex(metadata["covol_version"], r"\d+\.\d+")
        self.assertEqual(json.loads(metadata["covol_options"])["theta"], 0.75)
        self.assertEqual(json.loads(metadata["covol_resolved"])["delta"], 0.25 * H)
        self.assertFalse(metadata.get("creator", "").startswith("Houdini"))
        self.assertIn(b"covol_options", (self.out / "m.ply").read_bytes()[:4000])

    def test_lengths_in_voxels(self):
        one = self.report("segment", self.image, "--points", self.sparse, "-o", "a.vdb", "--delta", "2vx")
        two = self.report("segment", self.image, "--points", self.sparse, "-o", "b.vdb", "--delta", str(2 * H))
        self.assertEqual(one["resolved"]["delta"], 2 * H)
        self.assertEqual(one["resolved"], two["resolved"])
        self.assertEqual(one["surface"], two["surface"])

    def test_threads_give_the_same_bits(self):
        results = []
        for threads in (1, 2, 8):
            folder = self.out / str(threads)
            folder.mkdir()
            self.segment("--mesh", "m.ply", "--threads", threads, cwd=folder)
            results.append((folder / "m.ply").read_bytes())
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], results[2])

    def test_image_alone(self):
        start = "sphere:%g,%g,%g,%g" % (*CENTER, RADIUS + 1.5 * H)
        report = self.report("segment", self.image, "--init", start, "-o", "s.vdb", "--delta", "0.2vx")
        self.assertEqual(report["resolved"]["theta"], 0)
        self.assertTrue(report["resolved"]["follow"])
        self.assertLess(abs(radius_of(report["surface"]["volume"]) - RADIUS), 0.25 * H)

    def test_not_steady(self):
        report = self.report("segment", self.image, "--points", self.points, "--init", "tag", "-o", "s.vdb", "--max-steps", "1",
                             "--tolerance", "0")
        self.assertEqual(report["solve"]["stop_reason"], "max_steps")
        self.segment("--init", "tag", "--max-steps", "1", "--tolerance", "0", "--strict", code=5)
        self.assertEqual(self.files(), ["s.vdb"])

    def test_strict_reports_of_every_warning(self):
        self.segment("--strict", "--quiet")
        shifted = self.inputs / "shifted.xyz"
        write_xyz(shifted, [(x + 0.5 * RADIUS, y, z) for x, y, z in sphere_points(300)])
        report = self.report("segment", self.image, "--points", shifted, "-o", "s.vdb", "--strict", code=5)
        self.assertNotEqual(report["warnings"], [])
        self.assertEqual(self.files(), ["s.vdb"])

    def test_memory_limit(self):
        # Either the memory guard or the reader refuses the job, by chance. There is one message in both cases.
        for _ in range(40):
            self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", "--memory-limit", "20k", code=3,
                        expected_text="--memory-limit 20k")
        self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", "--memory-limit", "1M",
                    "--max-steps", "1000000", "--tolerance", "0", code=3, expected_text="--memory-limit 1M")
        self.segment("--memory-limit", "8G", points=self.sparse)

    def test_too_fine_a_voxel_size(self):
        for more in (["--voxel-size", "2e-5"], ["--voxel-size", "0.03", "--memory-limit", "200M"],
                     ["--voxel-size", "0.02", "--memory-limit", "200M", "--init", "sphere:3,-2,1,7"]):
            with self.subTest(more):
                line = self.refuse("reconstruct", self.points, "-o", "s.vdb", *more, code=3, expected_text="GiB of memory")
                fits = re.search(r"such as ([0-9.e-]+) ", line).group(1)
        # The last job of the loop succeeds with the voxel size that its error message proposed.
        report = self.report("reconstruct", self.points, "-o", "s.vdb", "--voxel-size", fits, *more[2:])
        self.assertTrue(report["surface"]["closed"])
        self.refuse_distance()

    def refuse_distance(self):
        (self.out / "s.vdb").unlink()
        self.refuse("distance", self.points, "-o", "d.vdb", "--voxel-size", "0.001", "--max-distance", "2", code=3, expected_text="such as")

    def test_one_output_that_fails_takes_the_others_with_it(self):
        name = "m" * 252 + ".ply"  # 256 characters; file names have at most 255
        self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", "--mesh", name, code=4, expected_text="too long")
        self.segment("--mesh", name[1:], points=self.sparse)
        self.assertEqual(self.files(), [name[1:], "s.vdb"])

    def test_interrupt(self):
        process = subprocess.Popen([COVOL, "segment", self.image, "--points", self.points, "--init", "tag", "-o", "s.vdb", "--json",
                                    "r.json", "--max-steps", "100000000", "--tolerance", "0"], cwd=self.out,
                                   stderr=subprocess.PIPE, text=True)
        try:
            # This line is printed when the run has begun. Without the signal, the run would take hours.
            while not process.stderr.readline().startswith("covol: tag_distance"):
                self.assertIsNone(process.poll(), "ended before the signal")
            process.send_signal(signal.SIGINT)
            _, text = process.communicate(timeout=60)
        finally:
            process.kill()
        self.assertEqual(process.returncode, 130, text)
        self.assertIn("covol: error: interrupted", text)
        self.assertEqual(self.files(), [])


class Configuration(Case):
    def test_file_and_command_line(self):
        config = self.inputs / "c.toml"
        config.write_text('theta = 0.5\ndelta = "2vx"\n')
        report = self.report("segment", self.image, "--points", self.sparse, "-o", "s.vdb", "--config", config)
        self.assertEqual(report["resolved"]["theta"], 0.5)
        self.assertEqual(report["resolved"]["delta"], 2 * H)
        report = self.report("segment", self.image, "--points", self.sparse, "-o", "s.vdb", "--config", config,
                             "--theta", "0.25")
        self.assertEqual(report["resolved"]["theta"], 0.25)

    def test_sections(self):
        config = self.inputs / "c.toml"
        config.write_text('threads = 1\n[segment]\ntheta = 0.5\n[phantom]\nsize = 7\n')
        report = self.report("segment", self.image, "--points", self.sparse, "-o", "s.vdb", "--config", config)
        self.assertEqual(report["resolved"]["theta"], 0.5)

    def test_unknown_key_and_missing_file(self):
        config = self.inputs / "c.toml"
        config.write_text("thta = 0.5\n")
        self.refuse("segment", self.image, "-o", "s.vdb", "--config", config, code=2, expected_text="thta")
        self.refuse("segment", self.image, "-o", "s.vdb", "--config", "none.toml", code=2, expected_text="none.toml")

    def test_mistakes_in_a_file(self):
        """The message names the file, the line and the option, and what was expected."""
        config = self.inputs / "c.toml"
        for text, line, expected_text in (
                ("\nthta = 0.5\n", 2, "'thta' is not an option of covol segment; did you mean theta?"),
                ("[segment]\nqqqqqqq = 1\n", 2, "'qqqqqqq' is not an option of covol segment. See covol segment"),
                ("segment.size = 3\n", 1, "'size' is not an option of covol segment"),
                ("[segmnt]\ntheta = 0.5\n", 2, "'segmnt' is not a command of covol; did you mean segment?"),
                ("[segment]\nthreads = 1\n", 2, "'threads' is an option of every command; write it above the first"),
                ("save-config = x.toml\n", 1, "'save-config' cannot be in a file"),
                ("theta = 0.5\ntheta = 0.6\n", 2, "'theta': expected one value, got 2"),
                ("theta = 0.5\ndelta = 1\ntheta = 0.6\n", 3, "'theta' is already given in line 1"),
                ("roi = 0,0,0,1,1,1\n", 1, "'roi': expected one value, got 6; give the option once, with quotes"),
                ("\nmax-steps = 0.5\n", 2, "--max-steps: expected a whole number, got '0.5'"),
                ("threads = many\n", 1, "--threads: expected a whole number, got 'many'"),
                ("delta = many\n", 1, "--delta: expected a length in world units, or in voxels as 3vx, got 'many'"),
                ("delta = -1\n", 1, "--delta: expected a length >= 0"),
                ("model = other\n", 1, "--model: expected guided or paper, got 'other'")):
            with self.subTest(text):
                config.write_text(text)
                code = 3 if "-1" in text else 2  # 3: a value of the right kind, but not in the range of the option
                self.refuse("segment", self.image, "-o", "s.vdb", "--config", config, code=code,
                            expected_text=f"--config {config}: line {line}: {expected_text}")
        # The command line takes precedence, and is then to blame.
        config.write_text("max-steps = many\n")
        line = self.refuse("segment", self.image, "-o", "s.vdb", "--config", config, "--max-steps", "few", code=2,
                           expected_text="--max-steps: expected a whole number, got 'few'")
        self.assertNotIn("line 1", line)

    def test_saved_options_give_the_same_run(self):
        first = self.report("segment", self.image, "--points", self.sparse, "-o", "s.vdb", "--theta", "0.5", "--delta",
                            "2vx", "--save-config", "c.toml")
        second = self.report("segment", "--config", "c.toml")
        self.assertEqual(first["resolved"], second["resolved"])
        self.assertEqual(first["surface"], second["surface"])


class Reconstruct(Case):
    def test_sphere(self):
        report = self.report("reconstruct", self.points, "-o", "s.vdb", "--mesh", "m.stl", "--voxel-size", H / 2)
        self.assertTrue(report["surface"]["closed"])
        self.assertEqual(report["surface"]["genus"], 0)
        self.assertLess(abs(radius_of(report["surface"]["volume"]) - RADIUS), 0.25 * H / 2)
        self.assertNotIn("edge_contrast", report.get("edge", {}))
        self.assertEqual(self.files(), ["m.stl", "s.vdb"])

    def test_no_mask_without_an_image(self):
        self.refuse("reconstruct", self.points, "-o", "s.vdb", "--mask", "m.nrrd", code=2, expected_text="--mask")


class Steps(Case):
    def test_single_steps_are_segment(self):
        whole = self.report("segment", self.image, "--points", self.points, "-o", "s.vdb", "--mesh", "s.ply", "--tag-distance", "3vx",
                            "--delta", "1vx", "--rho", "0")
        # With --rho 0, segment calls evolve once, like these steps; with image and points, it calls evolve twice. It
        # also merges close points, which changes nothing here because no points are close to each other.
        self.run_covol("distance", self.points, "--like", self.image, "-o", "d.vdb", "--max-distance", "8vx")
        self.run_covol("band", "d.vdb", "-o", "b.vdb", "--tag-distance", "3vx")
        self.run_covol("edge", self.image, "--band", "b.vdb", "-o", "g.vdb")
        solve = self.report("evolve", "b.vdb", "--distance", "d.vdb", "--edge", "g.vdb", "--delta", "1vx",
                            "--rho", "0", "-o", "u.vdb")["solve"]
        self.assertEqual(solve["steps"], whole["solve"]["steps"])
        self.run_covol("surface", "u.vdb", "-o", "surface.vdb", "--density", "density.vdb")
        mesh = self.report("mesh", "surface.vdb", "-o", "m.ply")["surface"]
        self.assertAlmostEqual(mesh["volume"], whole["surface"]["volume"], places=3)
        self.run_covol("mask", "surface.vdb", "--like", self.image, "-o", "m.nii.gz")
        alike = self.report("compare", "m.nii.gz", "s.vdb")["compare"]
        self.assertGreater(alike["dice"], 0.98)
        names = {f: self.report("info", f)["grids"][0]["name"] for f in
                 ("d.vdb", "b.vdb", "g.vdb", "u.vdb", "surface.vdb", "density.vdb")}
        self.assertEqual(list(names.values()), ["distance", "band", "edge", "u", "surface", "density"])

    def test_band_needs_a_distance(self):
        self.run_covol("distance", self.points, "--like", self.image, "-o", "d.vdb")
        self.run_covol("band", "d.vdb", "-o", "b.vdb", code=2)
        self.assertEqual(self.files(), ["d.vdb"])
        self.run_covol("band", "d.vdb", "-o", "b.vdb", "--tag-distance", "9vx", code=3)  # more than the tube of d.vdb

    def test_a_flow_that_vanishes(self):
        self.run_covol("distance", self.points, "--like", self.image, "-o", "d.vdb", "--max-distance", "8vx")
        self.run_covol("band", "d.vdb", "-o", "b.vdb", "--tag-distance", "3vx")
        report = self.report("evolve", "b.vdb", "-o", "u.vdb", "--delta", "50vx", "--follow", "--strict", code=5)
        self.assertEqual(report["solve"]["stop_reason"], "vanished")
        self.assertRegex(report["warnings"][0], "the surface vanished after [0-9]+ steps; lower --delta")


class Tools(Case):
    def test_phantom(self):
        report = self.report("phantom", "sphere", "-o", "p.nrrd", "--points", "p.xyz", "--labels", "l.nrrd", "--size", 32,
                             "--count", 400)
        self.assertEqual(report["image"]["size"], [32] * 3)
        self.assertEqual(len((self.out / "p.xyz").read_text().strip().splitlines()[-400:]), 400)
        self.assertEqual(self.report("check", "p.xyz", "--image", "p.nrrd")["problems"], 0)
        alike = self.report("compare", "l.nrrd", "l.nrrd")["compare"]
        self.assertEqual(alike["dice"], 1)
        self.assertLess(alike["hausdorff"], 1e-9)
        self.run_covol("phantom", "cube-of-cheese", "-o", "p.nrrd", code=3)
        self.run_covol("phantom", "sphere", "-o", "p.nrrd", "--size", 2, code=3)

    def test_compare_takes_a_spacing_for_masks(self):
        self.segment("--mask", "m.nrrd", points=self.sparse)
        bare = self.inputs / "bare.nrrd"
        write_nrrd(bare, (SIZE,) * 3, bytes(255 * (v > 120) for v in ball_bytes()), spacing=1)
        self.assertLess(self.report("compare", "m.nrrd", bare)["compare"]["dice"], 0.5)
        self.assertGreater(self.report("compare", "m.nrrd", bare, "--spacing", f"{H},{H},{H}")["compare"]["dice"], 0.95)
        # A part of the space can be compared only for label images.
        self.segment(points=self.sparse)
        error = self.run_covol("compare", "s.vdb", self.sparse, "--roi", "0,0,0,1,1,1", code=3).stderr
        self.assertIn("expected two label images to crop", error)

    def test_info_of_each_kind(self):
        self.assertEqual(self.report("info", self.image)["image"]["size"], [SIZE] * 3)
        self.assertEqual(self.report("info", self.points)["points"]["count"], 1500)
        self.run_covol("info", "none.vdb", code=4)

    def test_check(self):
        self.segment("--mesh", "m.ply", points=self.sparse)
        self.assertEqual(self.report("check", "s.vdb")["problems"], 0)
        self.assertEqual(self.report("check", "m.ply")["problems"], 0)
        (self.out / "open.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        report = self.report("check", "open.off", code=3)
        self.assertTrue(any("not closed" in f["text"] for f in report["findings"]))
        far = self.inputs / "far.xyz"
        write_xyz(far, [(1000, 0, 0), *sphere_points(10)])
        self.assertEqual(self.report("check", far, "--image", self.image, code=3)["problems"], 1)

    def test_glb_is_read_again(self):
        self.run_covol("reconstruct", self.points, "-o", "s.vdb", "--mesh", "m.glb")
        self.assertLess(self.report("compare", "m.glb", "s.vdb")["compare"]["hausdorff"], 0.1 * H)
        self.assertEqual(self.report("check", "m.glb")["findings"], [])
        self.assertTrue(self.report("info", "m.glb"))

    def test_no_piece_is_large_enough(self):
        self.run_covol("reconstruct", self.points, "-o", "s.vdb")
        for size in ("1e308", "100"):
            self.run_covol("mesh", "s.vdb", "-o", "m.ply", "--min-component", size, code=3)
        done = self.run_covol("reconstruct", self.points, "-o", "t.vdb", "--min-component", "1e308", code=3)
        self.assertIn("use a smaller --min-component", done.stderr)
        self.assertEqual(self.files(), ["s.vdb"])

    def test_convert(self):
        self.run_covol("convert", self.image, "i.vdb")
        self.run_covol("convert", "i.vdb", "i.nrrd", "--like", self.image)
        report = self.report("info", "i.nrrd")["image"]
        self.assertEqual(report["size"], [SIZE] * 3)
        for a in range(3):
            self.assertAlmostEqual(report["origin"][a], ORIGIN[a], places=4)
        self.assertEqual(report["range"], [20, 220])
        self.run_covol("convert", self.points, "p.ply")
        self.assertEqual(self.report("info", "p.ply")["points"]["count"], 1500)
        (self.out / "t.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n")
        self.run_covol("convert", "t.off", "t.ply", "--unit-scale", 2)
        self.assertAlmostEqual(self.report("info", "t.ply")["mesh"]["volume"], 8 / 6, places=5)
        self.run_covol("convert", self.points, "p.vdb", code=3)

    def test_options_that_would_do_nothing(self):
        """Options for a file that the run neither reads nor writes are refused."""
        self.run_covol("convert", self.image, "i.vdb")
        for options in (("--unit-scale", 2), ("--up", "y"), ("--simplify", 1), ("--remove-outliers",)):
            with self.subTest(options=options):
                self.assertIn(options[0], self.run_covol("convert", "i.vdb", "j.vdb", *options, code=2).stderr)
        self.assertIn("--half", self.run_covol("convert", "i.vdb", "j.nrrd", "--half", code=2).stderr)
        for options in (("--up", "y"), ("--unit-scale", 2)):
            with self.subTest(options=options):
                done = self.run_covol("segment", self.image, "--points", self.points, "-o", "s.vdb", *options, code=2)
                self.assertIn(options[0] + ": it applies to meshes only", done.stderr)
        self.assertEqual(self.files(), ["i.vdb"])

    def test_render(self):
        self.segment(points=self.sparse)
        self.run_covol("render", "s.vdb", "-o", "s.png", "--image", self.image, "--points", self.points, "--size", "320x200")
        data = (self.out / "s.png").read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", data[16:24]), (320, 200))
        self.run_covol("render", "s.vdb", "-o", "t.png", "--size", "wide", code=2)


if __name__ == "__main__":
    unittest.main()
