"""How covol behaves among other programs: use of the streams, contents of reports, answers to misspelt arguments.

    COVOL=build/bin/covol python3 -m unittest tests/cli/manners_test.py
"""
import json
import math
import os
import pathlib
import pty
import re
import subprocess
import time
import unittest

from covol_case import CENTER, COVOL, H, ORIGIN, RADIUS, SIZE, Case, sphere_points, write_nrrd, write_xyz

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"


def fields_of(json_value, path=""):
    """Paths of all fields of a report; lists are written as []."""
    if isinstance(json_value, dict):
        for key, value in json_value.items():
            yield from fields_of(value, f"{path}.{key}" if path else key)
    elif isinstance(json_value, list) and any(isinstance(value, dict) for value in json_value):
        for value in json_value:
            yield from fields_of(value, path + "[]")
    else:
        yield path


class Streams(Case):
    def test_results_go_to_standard_output_and_messages_do_not(self):
        self.segment("--mesh", "m.ply", "--quiet", points=self.sparse)
        for words, expected_text in ((("info", "s.vdb"), "surface: Tree_float"), (("info", self.image), "spacing 0.5 x 0.5 x 0.5"),
                            (("compare", "s.vdb", "m.ply"), "Dice"), (("compare", "s.vdb", self.points), "points to surface"),
                            (("check", "m.ply"), "no problem"), (("check", self.image), "the file states no unit"),
                            (("plan", "segment", self.image, "--points", self.points, "-o", "x.vdb"), "memory: about")):
            with self.subTest(words=words):
                done = self.run_covol(*words)
                self.assertIn(expected_text, done.stdout)
                self.assertNotIn(expected_text, done.stderr)
                self.assertEqual(self.run_covol(*words, "--quiet").stderr, "")
        done = self.segment(points=self.sparse)
        self.assertEqual(done.stdout, "")
        self.assertIn("wrote s.vdb", done.stderr)

    def test_a_report_on_standard_output_is_alone_there(self):
        self.segment("--quiet", points=self.sparse)
        done = self.run_covol("info", "s.vdb", "--json", "-")
        self.assertEqual(json.loads(done.stdout)["kind"], "vdb")
        self.assertIn("surface: Tree_float", done.stderr)

    def test_points_from_standard_input(self):
        self.run_covol("reconstruct", self.points, "-o", "d.vdb", "--quiet")
        for text in self.points.read_text(), "x,y,z\n" + self.points.read_text().replace(" ", ","):
            done = subprocess.run([COVOL, "reconstruct", "-", "-o", "c.vdb", "--quiet"], input=text, text=True, cwd=self.out,
                                  capture_output=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(self.report("compare", "c.vdb", "d.vdb")["compare"]["dice"], 1)
        done = subprocess.run([COVOL, "segment", str(self.image), "--points", "-", "-o", "e.vdb", "--quiet"],
                              input=self.points.read_text(), text=True, cwd=self.out, capture_output=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        for text, expected_text in ("", "got nothing"), ("1 2 x\n", "standard input"):
            done = subprocess.run([COVOL, "reconstruct", "-", "-o", "f.vdb"], input=text, text=True, cwd=self.out,
                                  capture_output=True)
            self.assertEqual(done.returncode, 3)
            self.assertIn(expected_text, done.stderr)

    def test_progress_never_runs_backwards(self):
        """Percentages on a terminal: on lines with the same beginning they never decrease."""
        main, side = pty.openpty()
        process = subprocess.Popen([COVOL, "segment", str(self.image), "--init", "sphere:3,-2,1,8", "--coarse-levels", "1",
                                    "--rho", "1", "-o", "s.vdb", "--voxel-size", "0.25"], cwd=self.out, stderr=side,
                                   stdout=side)
        os.close(side)
        text = b""
        while True:
            try:
                piece = os.read(main, 65536)
            except OSError:
                break
            if not piece:
                break
            text += piece
        self.assertEqual(process.wait(), 0, text)
        os.close(main)
        seen, bars = {}, re.findall(r"covol: (.{9,}?) \[[#.]+\] +(\d+) %", text.decode())
        self.assertGreater(len(bars), 3)
        for stage, percent in bars:
            self.assertGreaterEqual(int(percent), seen.get(stage.strip(), 0), stage)
            seen[stage.strip()] = int(percent)


class Reports(Case):
    def runs(self):
        """A report of each command, by the command's name."""
        self.segment("--mesh", "m.ply", "--mask", "k.nrrd", "--fields", "f.vdb", "--quiet", "--suggest", "2")
        two = ("--points", f"a={self.points}", "--suggest", "1")
        for words in (("segment", self.image, "--points", self.points, "-o", "o.vdb", "--evidence", "e.csv"),
                      ("segment", self.image, *two, "-o", "o.vdb"),
                      ("segment", self.image, "--points", self.points, "-o", "o.vdb", "--init", "tag"),
                      ("segment", self.image, "--init", "sphere:3,-2,1,5", "-o", "o.vdb", "--coarse-levels", "1"),
                      ("segment", self.image, "--inside", "3,-2,1", "--outside", "10,5,8", "-o", "o.vdb"),
                      ("segment", self.image, "--points", self.points, "-o", "o.vdb", "--rho", "0"),
                      ("segment", self.image, self.image, "--points", self.points, "-o", "t.vdb"),
                      ("reconstruct", self.points, "-o", "o.vdb"),
                      ("reconstruct", self.points, "-o", "o.vdb", "--holes", "open"),
                      ("distance", self.points, "-o", "1.vdb"),
                      ("band", "1.vdb", "--points", self.points, "-o", "2.vdb"),
                      ("edge", self.image, "--band", "2.vdb", "-o", "3.vdb"),
                      ("evolve", "2.vdb", "--distance", "1.vdb", "--edge", "3.vdb", "-o", "4.vdb", "--max-steps", "3"),
                      ("surface", "4.vdb", "-o", "5.vdb"), ("mesh", "s.vdb", "-o", "5.ply", "--target-edge", "2vx"),
                      ("mesh", "s.vdb", "-o", "6.ply", "--plain"), ("mask", "s.vdb", "--like", self.image, "-o", "m.nrrd"),
                      ("compare", "s.vdb", "m.ply"), ("compare", "s.vdb", self.points), ("info", "s.vdb"),
                      ("info", self.image), ("info", "m.ply"), ("info", self.points), ("check", "s.vdb"), ("check", self.image),
                      ("check", "m.ply"), ("convert", self.image, "i.vdb"), ("convert", "s.vdb", "i.nrrd"),
                      ("convert", self.points, "p.csv"), ("convert", "m.ply", "m.stl"),
                      ("render", "s.vdb", "-o", "r.png"), ("phantom", "sphere", "-o", "x.nrrd", "--size", "24"),
                      ("doctor",), ("plan", "segment", self.image, "--points", self.points, "-o", "x.vdb")):
            begin = time.monotonic()
            yield words, self.report(*words), time.monotonic() - begin

    def test_every_field_is_documented_and_the_total_is_the_whole_time(self):
        documented = re.findall(r"^\| `([^`]+)` \|", (DOCS / "report.md").read_text(), re.M)
        self.assertGreater(len(documented), 100)
        patterns = {name: re.compile(re.escape(name).replace(r"\*", r".+") + r"(\[\])?$") for name in documented}
        seen, missing = set(), set()
        for words, report, wall in self.runs():
            with self.subTest(words=[str(word) for word in words[:1] + words[2:]]):
                self.assertEqual(report["schema"], 1)
                seconds = report["seconds"]
                self.assertEqual(list(seconds)[-1], "total")
                parts = sum(value for name, value in seconds.items() if name != "total")
                self.assertGreaterEqual(seconds["total"], 0.999 * parts)
                self.assertLessEqual(seconds["total"], wall)
                self.assertGreater(seconds["total"], 0.3 * wall - 0.1)
                for structure in [report, *report.get("structures", []), *report.get("frames", [])]:
                    for name, value in structure.get("resolved", {}).items():
                        self.assertNotIn(value, ("auto", -1), name)
                for field in fields_of(report):
                    field = re.sub(r"^(frames\[\]\.)?(structures\[\]\.)?", "", field)
                    names = {name for name, pattern in patterns.items() if pattern.match(field)}
                    seen |= names
                    if not names:
                        missing.add(field)
        self.assertEqual(missing, set(), "fields that docs/report.md lacks")
        self.assertGreater(len(seen), 0.8 * len(documented), sorted(set(documented) - seen))

    def test_what_was_not_chosen_is_null(self):
        report = self.report("segment", self.image, "--points", self.points, "-o", "o.vdb", "--rho", "0")
        self.assertIsNone(report["resolved"]["edge_feature"])
        self.assertIsNone(report["resolved"]["edge_k"])
        self.assertGreater(report["resolved"]["delta"], 0)
        report = self.report("segment", self.image, "--points", self.points, "-o", "o.vdb", "--model", "paper",
                             "--max-steps", 3)
        self.assertEqual(report["resolved"]["edge_feature"], "slope")
        self.assertGreater(report["resolved"]["edge_k"], 0)


class Outputs(Case):
    def test_a_mesh_or_a_mask_alone(self):
        job = ("segment", self.image, "--points", self.points, "--quiet")
        self.run_covol(*job, "-o", "s.vdb", "--mesh", "s.ply", "--mask", "s.nrrd")
        for name in "a.ply", "a.nrrd":
            self.run_covol(*job, "-o", name)
            self.assertEqual(self.report("compare", name, "s" + name[1:])["compare"]["dice"], 1)
        self.assertEqual(self.files(), ["a.nrrd", "a.ply", "s.nrrd", "s.ply", "s.vdb"])
        self.run_covol("reconstruct", self.points, "-o", "c.stl", "--quiet")
        self.run_covol("reconstruct", self.points, "-o", "d.glb", "--density", "d.vdb", "--quiet")
        self.assertTrue({"c.stl", "d.glb", "d.vdb"} <= set(self.files()))

    def test_with_the_other_outputs_and_with_a_configuration(self):
        self.run_covol("segment", self.image, "--points", self.points, "-o", "a.ply", "--mask", "a.nrrd", "--save-config",
                       "c.toml", "--quiet")
        (self.out / "a.ply").unlink()
        self.run_covol("--config", "c.toml", "segment", "--quiet")
        self.assertEqual(self.files(), ["a.nrrd", "a.ply", "c.toml"])
        self.run_covol("segment", self.image, self.image, "--points", self.points, "-o", "t.nrrd", "--quiet")
        self.assertTrue({"t_t000.nrrd", "t_t001.nrrd"} <= set(self.files()))

    def test_what_cannot_be(self):
        job = ("segment", self.image, "--points", self.points)
        self.refuse(*job, "-o", "a.ply", "--mesh", "b.stl", code=2, expected_text="expected only one of them")
        self.refuse(*job, "-o", "a.nrrd", "--mask", "b.nrrd", code=2, expected_text="expected only one of them")
        self.refuse(*job, "-o", "a.doc", code=3, expected_text=".vdb")
        self.refuse("reconstruct", self.points, "-o", "a.nrrd", code=3, expected_text=".vdb")

    def test_what_a_failed_run_had(self):
        points = self.out / "flat.xyz"
        write_xyz(points, [(CENTER[0] + 0.5 * math.cos(n), CENTER[1] + 0.5 * math.sin(n), CENTER[2]) for n in range(40)])
        job = ("segment", self.image, "--points", points, "--init", "sphere:3,-2,1,3", "--model", "paper", "--rho", "0",
               "--theta", "0", "--delta", "4", "--max-steps", "500", "-o", "s.vdb", "--quiet")
        done = self.run_covol(*job, code=3)
        self.assertIn("vanished", done.stderr)
        self.assertEqual(self.files(), ["flat.xyz"])
        done = self.run_covol(*job, "--keep-failed", "kept.vdb", code=3)
        self.assertIn("vanished", done.stderr)
        self.assertEqual(self.files(), ["flat.xyz", "kept.vdb"])
        grids = {grid["name"]: grid for grid in self.report("info", "kept.vdb")["grids"]}
        self.assertIn("start", grids)
        self.assertIn("u", grids)
        self.assertIn("vanished", grids["start"]["metadata"]["covol_failed"])
        self.assertEqual(self.run_covol("mesh", "kept.vdb:start", "-o", "start.ply", "--quiet").returncode, 0)
        volume = self.report("info", "start.ply")["mesh"]["volume"]
        self.assertAlmostEqual(volume / (4 / 3 * math.pi * 27), 1, 1)
        # A run that succeeds does not write the file of --keep-failed.
        self.segment("--keep-failed", "none.vdb", "--quiet", points=self.sparse)
        self.assertNotIn("none.vdb", self.files())


class Words(Case):
    def test_nearest_command_and_option(self):
        self.refuse("segmnt", self.image, code=2, expected_text="'segmnt' is not a command of covol; did you mean segment?")
        self.refuse("reconstuct", "x", code=2, expected_text="did you mean reconstruct?")
        line = self.refuse("melt", code=2, expected_text="'melt' is not a command")
        self.assertNotIn("did you mean", line)
        job = ("segment", self.image, "-o", "s.vdb")
        self.refuse(*job, "--point", self.points, code=2, expected_text="--point is not an option of covol segment; did you mean --points?")
        self.refuse(*job, "--voxelsize=2", code=2, expected_text="did you mean --voxel-size?")
        self.refuse(*job, "--thread", "2", code=2, expected_text="did you mean --threads?")
        self.refuse("mesh", "s.vdb", "--tetra", "1", code=2, expected_text="--tetra is not an option of covol mesh. See covol mesh")
        self.assertIn("--points", self.run_covol("segment", "--help").stdout)

    def test_a_blank_before_the_unit(self):
        job = ("segment", self.image, "--points", self.points, "-o", "s.vdb")
        for unit in "vx", "voxels":
            self.refuse(*job, "--delta", "0.5", unit, code=2, expected_text="--delta: expected a length in voxels without a blank, 0.5vx")
        self.refuse(*job, "--voxel-size", "2", "um", code=2, expected_text="lengths are in the unit of the input")
        self.run_covol(*job, "--delta", "0.5vx", "--quiet")


class Marks(Case):
    def test_a_contour_table_given_as_points_is_noticed(self):
        rows = ["slice,contour,x_px,y_px"]
        for k in range(10, 30, 2):
            r = math.sqrt(12 ** 2 - (k - 19.5) ** 2)
            rows += [f"{k},{k},{19.5 + r * math.cos(t / 5):.3f},{19.5 + r * math.sin(t / 5):.3f}" for t in range(31)]
        (self.out / "c.csv").write_text("\n".join(rows) + "\n")
        done = self.run_covol("segment", self.image, "--points", "c.csv", "-o", "s.vdb")
        self.assertIn("warning: c.csv: its marks form 10 lines", done.stderr)
        self.assertIn("--contours", done.stderr)
        self.assertNotIn("lines, but are used", self.run_covol("segment", self.image, "--contours", "c.csv", "-o",
                                                                 "s.vdb").stderr)
        self.assertNotIn("marks form", self.segment().stderr)

    def test_no_word_of_channels_where_slices_are_between_voxels(self):
        index = [tuple((p[a] - ORIGIN[a]) / H for a in range(3)) for p in sphere_points(200)]
        write_xyz(self.out / "i.xyz", index)
        done = self.run_covol("segment", self.image, "--points", "i.xyz", "--points-space", "index", "-o", "s.vdb")
        self.assertNotIn("--points-channels", done.stderr)

    def test_many_structures_are_a_table(self):
        names, values = [], bytearray(SIZE ** 3)
        for n in range(8):
            at = tuple(10 + 20 * (n >> a & 1) for a in range(3))
            for k in range(-6, 7):
                for j in range(-6, 7):
                    for i in range(-6, 7):
                        if i * i + j * j + k * k <= 36:
                            values[((at[2] + k) * SIZE + at[1] + j) * SIZE + at[0] + i] = 200
            write_xyz(self.out / f"{n}.xyz", [tuple(ORIGIN[a] + H * at[a] + 6 * H * (p[a] - CENTER[a]) / RADIUS
                                                    for a in range(3)) for p in sphere_points(80)])
            names.append(f"cell{n}={n}.xyz")
        write_nrrd(self.out / "cells.nrrd", (SIZE,) * 3, bytes(values))
        done = self.run_covol("segment", "cells.nrrd", "--points", *names, "-o", "s.vdb")
        lines = done.stderr.splitlines()
        self.assertLess(len(lines), 20, done.stderr)
        rows = [line for line in lines if re.match(r"covol: cell\d +\d", line)]
        self.assertEqual(len(rows), 8, done.stderr)
        self.assertEqual(len({len(line) for line in rows}), 1)
        volume = float(rows[0].split()[2])
        self.assertLess(abs(volume / (4 / 3 * math.pi * 27) - 1), 0.15)


if __name__ == "__main__":
    unittest.main()
