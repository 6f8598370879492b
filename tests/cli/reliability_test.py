"""No lost data and no silent errors: kills, signals, hostile numbers, marks of another image, with the real program.

    COVOL=build/bin/covol python3 -m unittest tests/cli/reliability_test.py
"""
import hashlib
import os
import pathlib
import signal
import struct
import subprocess
import sys
import time
import unittest

import numpy as np

from covol_case import CENTER, COVOL, H, RADIUS, SIZE, Case, sphere_points, write_nrrd, write_xyz

OUTPUTS = ["-o", "s.vdb", "--mesh", "s.ply", "--mask", "s.nrrd", "--table", "s.csv", "--json", "s.json"]


class Sets(Case):
    """The outputs of a run appear together, or none does."""

    def segment(self, *more):
        return [COVOL, "segment", self.image, "--points", self.points, "--quiet", "--threads", "1", "--init", "tag", *OUTPUTS, *more]

    def state(self):
        """A digest of each output; outputs that contain times change from run to run."""
        return {name: hashlib.sha256((self.out / name).read_bytes()).hexdigest() for name in self.files()
                if name not in ("s.json", "s.csv")}

    def clear(self):
        """The next run in this folder removes leftovers."""
        self.run_covol("phantom", "sphere", "--size", "16", "-o", "next.nrrd")
        (self.out / "next.nrrd").unlink()
        self.assertEqual([p.name for p in self.out.iterdir() if p.name.startswith(".")], [])

    def complete_sets(self, *choices):
        sets = []
        for more in choices:
            subprocess.run(self.segment(*more), cwd=self.out, check=True)
            sets.append(self.state())
        self.assertTrue(all(sets[0][name] != sets[1][name] for name in sets[0]))
        return sets

    @unittest.skipUnless("COVOL_KILL_AT" in os.environ, "COVOL_KILL_AT, the library that kills, is not set")
    def test_killed_at_any_call_the_set_is_old_or_new(self):
        choices = [["--max-steps", "1", "--delta", delta] for delta in ("1vx", "3vx")]
        sets = self.complete_sets(*choices)
        new = 0
        for call in range(1, 200):
            last = self.state()
            choice = 1 - sets.index(last)
            environment = {**os.environ, "LD_PRELOAD": os.environ["COVOL_KILL_AT"], "KILL_AT": str(call)}
            code = subprocess.run(self.segment(*choices[choice]), cwd=self.out, env=environment).returncode
            if code == 0:
                break
            self.assertEqual(code, -signal.SIGKILL)
            self.clear()
            self.assertIn(self.state(), sets, f"killed before call {call}")
            new += self.state() != last
        self.assertEqual(code, 0)
        self.assertEqual(self.state(), sets[choice])
        # A separate call puts each of the outputs in place. If the run was killed between these calls, the next run
        # completed the set: there are at least as many such kills as outputs.
        self.assertGreaterEqual(new, len(sets[0]))
        self.assertGreater(call, 2 * len(sets[0]))

    def test_killed_while_files_are_written(self):
        choices = [["--max-steps", "1", "--delta", delta] for delta in ("1vx", "3vx")]
        sets = self.complete_sets(*choices)
        for n in range(6):
            run = subprocess.Popen(self.segment(*choices[n % 2]), cwd=self.out)
            while run.poll() is None and not any(self.out.glob(".covol-*/s.*")):
                pass
            time.sleep(n * 2e-3)
            run.kill()
            run.wait()
            self.clear()
            self.assertIn(self.state(), sets)

    def test_signals_end_a_run_and_leave_nothing(self):
        subprocess.run(self.segment(), cwd=self.out, check=True)
        before = self.state()
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            run = subprocess.Popen([COVOL, "segment", self.image, "--points", self.points, "--init", "tag", *OUTPUTS, "--max-steps",
                                    "100000000", "--tolerance", "0"], cwd=self.out, stderr=subprocess.PIPE, text=True)
            while not run.stderr.readline().startswith("covol: tag_distance"):
                self.assertIsNone(run.poll(), "ended before the signal")
            run.send_signal(getattr(signal, name))
            start = time.monotonic()
            _, text = run.communicate(timeout=60)
            self.assertEqual(run.returncode, 130, text)
            self.assertLess(time.monotonic() - start, 10)
            self.assertEqual(self.state(), before)
            self.assertEqual([p.name for p in self.out.iterdir() if p.name.startswith(".")], [])

    def test_a_hangup_that_is_ignored_stays_so(self):
        run = subprocess.Popen(["nohup", *map(str, self.segment())], cwd=self.out, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
        time.sleep(0.1)
        run.send_signal(signal.SIGHUP)
        self.assertEqual(run.wait(timeout=120), 0)


class Inputs(Case):
    def test_an_image_that_is_cut_short_while_it_is_read(self):
        size = 704  # 350 MB: a file this large is mapped into memory instead of read
        image, points = self.inputs / "large.nrrd", self.inputs / "marks.xyz"
        write_nrrd(image, (size,) * 3, b"", spacing=1, origin=(0, 0, 0))
        with open(image, "r+b") as file:
            file.truncate(file.seek(0, os.SEEK_END) + size**3)
        middle = np.array((size / 2,) * 3)
        write_xyz(points, map(tuple, middle + 60 / RADIUS * (np.array(sphere_points(6000)) - CENTER)))
        run = subprocess.Popen([COVOL, "segment", image, "--points", points, "--init", "tag", "-o", "s.vdb"], cwd=self.out,
                               stderr=subprocess.PIPE, text=True)
        while not run.stderr.readline().startswith("covol: tag_distance"):
            self.assertIsNone(run.poll(), "ended too early")
        os.truncate(image, 4096)
        _, text = run.communicate(timeout=120)
        self.assertEqual(run.returncode, 4, text)
        self.assertIn("cut short by another program", text)
        self.run_covol("phantom", "sphere", "--size", "16", "-o", "next.nrrd")
        self.assertEqual([p.name for p in self.out.iterdir()], ["next.nrrd"])

    def test_a_point_that_no_grid_holds(self):
        """Detected at once, not after minutes or by running out of memory."""
        wild = (np.array(sphere_points(6000)) - CENTER) / RADIUS
        wild[17] = (1e7, 3, 4)
        path = self.inputs / "cloud.xyz"
        np.savetxt(path, wild, "%.9g")
        self.refuse("reconstruct", path, "-o", "o.vdb", code=3, expected_text="points: (1e+07, 3, 4) lies")

    def test_small_parts_far_apart(self):
        """Two balls up to 10^4 radii apart need no more than their points do."""
        path = self.inputs / "cloud.xyz"
        for place in (1, 0, 0), (20, -30, 7), (30, 50, 80), (100, 0, 0):
            with self.subTest(place=place):
                apart = 0.01 * (np.array(sphere_points(6000)) - CENTER) / RADIUS
                apart[::2] += place
                np.savetxt(path, apart, "%.9g")
                report = self.report("reconstruct", path, "-o", "o.vdb")
                self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (2, 0))
                self.assertAlmostEqual(report["surface"]["volume"], 2 * 4 / 3 * np.pi * 1e-6, delta=0.01 * 8.4e-6)
                self.assertLess(report["peak_rss_bytes"], 200e6)


class Memory(Case):
    """--memory-limit bounds the program's memory in every phase."""

    # Bytes by which the peak may exceed the limit: the memory of the program before it reads anything, and what it may
    # allocate between two checks of the limit.
    OWN = 76 << 20

    def peak(self, *words):
        """@return exit code, peak of resident memory in bytes, standard error"""
        with open(self.out / "errors", "w+") as errors:
            run = subprocess.Popen([COVOL, *map(str, words), "--quiet"], cwd=self.out, stderr=errors)
            _, status, usage = os.wait4(run.pid, 0)
            run.returncode = os.waitstatus_to_exitcode(status)
            errors.seek(0)
            return run.returncode, usage.ru_maxrss * 1024, errors.read()

    def test_is_not_passed(self):
        self.run_covol("phantom", "torus", "--size", 224, "--count", 150000, "-o", "t.nrrd", "--points", "t.ply")
        self.run_covol("phantom", "torus", "--size", 64, "--count", 30000, "-o", "c.nrrd", "--points", "c.ply")
        self.run_covol("segment", "t.nrrd", "--points", "t.ply", "--init", "tag", "--max-steps", 1, "-o", "t.vdb", "--mesh", "m.ply",
                       "--mask", "k.nrrd")
        jobs = {
            "tagged": ["segment", "t.nrrd", "--points", "t.ply", "--init", "tag", "-o", "o.vdb"],
            "cloud": ["reconstruct", "c.ply", "-o", "o.vdb"],
            "edge": ["edge", "t.nrrd", "--band", "t.vdb", "-o", "o.vdb"],
            "mesh": ["mesh", "t.vdb", "-o", "o.ply", "--target-edge", "2vx"],
            "repair": ["mesh", "t.vdb", "-o", "o.ply", "--repair"],
            "compare": ["compare", "m.ply", "t.vdb"],
            "check": ["check", "m.ply"],
            "render": ["render", "t.vdb", "-o", "o.png", "--size", "1600x1200"],
            "flow": ["segment", "t.nrrd", "--points", "t.ply", "--model", "paper", "-o", "o.vdb"],
            "page": ["segment", "t.nrrd", "--points", "t.ply", "--init", "tag", "--max-steps", 3, "-o", "o.vdb", "--report", "o.html"],
            "compare meshes": ["compare", "m.ply", "m.ply"],
            "compare masks": ["compare", "k.nrrd", "k.nrrd"],
            "rerun": ["rerun", "t.vdb"],
        }
        self.stay_within(jobs, 8)

    def test_is_not_passed_by_single_steps(self):
        self.run_covol("phantom", "torus", "--size", 448, "--count", 200000, "-o", "t.nrrd", "--points", "t.ply")
        self.run_covol("distance", "t.ply", "--like", "t.nrrd", "-o", "d.vdb", "--max-distance", "8vx")
        self.run_covol("band", "d.vdb", "-o", "b.vdb", "--tag-distance", "3vx")
        self.stay_within({
            "distance": ["distance", "t.ply", "--like", "t.nrrd", "-o", "o.vdb", "--max-distance", "30vx"],
            "band": ["band", "d.vdb", "-o", "o.vdb", "--tag-distance", "3vx"],
            # 3 steps are sufficient, because all steps need the same memory.
            "evolve": ["evolve", "b.vdb", "--distance", "d.vdb", "-o", "o.vdb", "--rho", 0, "--max-steps", 3],
            "surface": ["surface", "b.vdb", "-o", "o.vdb"],
            "convert": ["convert", "t.nrrd", "o.vdb"],
            "fine mesh": ["mesh", "b.vdb", "-o", "o.ply"],
            "fine decimated mesh": ["mesh", "b.vdb", "-o", "o.ply", "--target-edge", "2vx"],
            "compare points": ["compare", "t.ply", "b.vdb"],
        }, 6)

    def stay_within(self, jobs, minimum):
        seen = 0
        for name, words in jobs.items():
            with self.subTest(name):
                code, whole, text = self.peak(*words)
                self.assertIn(code, (0, 5), text)
                limit = int(0.6 * (whole - self.OWN))
                if limit < 20 << 20:
                    continue
                seen += 1
                before = self.files()
                code, peak, text = self.peak(*words, "--memory-limit", f"{limit >> 10}K", *(["--brick-voxels", "1000000000"]
                                                                                           if words[0] in ("segment", "reconstruct") else []))
                self.assertEqual(code, 3, text)
                self.assertIn("memory", text)
                self.assertLess(peak, 1.05 * limit + self.OWN)
                self.assertEqual(self.files(), before)
        self.assertGreaterEqual(seen, minimum)


class Numbers(Case):
    def test_steps_that_round_to_nothing_are_refused(self):
        for option, value in (("--tau", "1e-9"), ("--tau", "1e300"), ("--delta", "1e308")):
            with self.subTest(option + " " + value):
                self.refuse("segment", self.image, "--points", self.points, "-o", "s.vdb", "--init", "tag", option, value, code=3,
                            expected_text=option)

    def test_more_frames_than_memory_are_refused(self):
        path = self.inputs / "frames.nrrd"
        header = ("NRRD0004\ntype: uint8\ndimension: 4\nsizes: 8 8 8 3000000\nspacings: 1 1 1 1\nencoding: raw\nbyte skip: {}\n\n")
        for skip in (-1, 5):
            path.write_bytes(header.format(skip).encode() + bytes(5000))
            self.refuse("info", path, code=3, expected_text="frames")
        path = self.inputs / "frames.mha"
        path.write_bytes(b"ObjectType = Image\nNDims = 4\nDimSize = 8 8 8 3000000\nElementSpacing = 1 1 1 1\nHeaderSize = 150\n"
                         b"ElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + bytes(5000))
        self.refuse("info", path, code=3)


class Damaged(Case):
    def test_files_that_crashed_a_library_are_refused(self):
        """Found by tests/fuzz/mutate.py: these files made OpenVDB write beyond a buffer, ITK abort, or MetaIO run for hours."""
        files = sorted(p for p in (pathlib.Path(__file__).resolve().parents[1] / "fuzz/regressions").iterdir() if p.is_file())
        self.assertGreaterEqual(len(files), 4)
        for path in files:
            with self.subTest(path.name):
                self.refuse("mesh" if path.suffix == ".vdb" else "info", path, *(["-o", "o.ply"] if path.suffix == ".vdb" else []),
                            code=3, expected_text="damaged")

    def test_metadata_of_another_length_than_its_type(self):
        """OpenVDB takes the stored length of the type, and the following bytes for the length of a string."""
        self.segment()
        data = (self.out / "s.vdb").read_bytes()
        (self.out / "s.vdb").unlink()
        kind = b"\x05\0\0\0vec3i"
        for length in (11, 13, 2**31):
            path = self.inputs / "metadata.vdb"
            self.assertIn(kind + struct.pack("<I", 12), data)
            path.write_bytes(data.replace(kind + struct.pack("<I", 12), kind + struct.pack("<I", length)))
            self.refuse("info", path, code=3, expected_text="damaged")

    def test_what_is_kept_of_leaves_for_delayed_loading(self):
        """OpenVDB allocates the stored size, reads beyond its blocks, and takes the following bytes for the next string."""
        self.segment()
        data = (self.out / "s.vdb").read_bytes()
        (self.out / "s.vdb").unlink()
        kind = b"\x0d\0\0\0__delayedload"
        begin = data.index(kind) + len(kind)
        length, leaves, packed = struct.unpack_from("<3I", data, begin)
        # The metadata has two arrays, each after its packed size in bytes. The first has a byte per leaf and is not
        # packed (size 0); the second has 8 bytes per leaf and is packed by Blosc.
        self.assertEqual(packed, 0)
        block = begin + 12 + leaves
        # 4-byte numbers: the packed size of the second array, and Blosc's header of versions, unpacked size, block size
        # and packed size.
        header = struct.unpack_from("<5I", data, block)
        self.assertEqual(header[2::2], (8 * leaves, header[0]))
        for place, value in ((begin + 4, leaves + 1), (begin + 4, 2**32 - 1), (begin + 8, 2**32 - 2), (begin + 8, 7), (begin + 8, leaves),
                             (block, 2**32 - 2), (block, 7), (block, header[0] - 1), (block + 8, 2**31 - 1), (block + 16, header[0] + 100)):
            path = self.inputs / "leaves.vdb"
            path.write_bytes(data[:place] + struct.pack("<I", value) + data[place + 4:])
            with self.subTest(place=place - begin, value=value):
                self.refuse("info", path, code=3, expected_text="damaged")

    def test_a_minute_of_fuzzing(self):
        script = pathlib.Path(__file__).resolve().parents[1] / "fuzz/mutate.py"
        done = subprocess.run([sys.executable, script, "--covol", COVOL, "--seconds", "1.5", "--seed", "3", "--keep",
                               self.out / "findings"], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class WrongInSilence(Case):
    """Runs that succeed on flawed inputs."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        rng = np.random.default_rng(3)
        ball = cls.image.read_bytes().split(b"\n\n", 1)[1]
        cls.values = np.frombuffer(ball, np.uint8).astype(np.float32) + rng.normal(0, 5, SIZE**3).astype(np.float32)
        cls.noise = rng.normal(100, 30, SIZE**3).astype(np.float32)
        cls.marks = np.array(sphere_points(300))

    def warnings(self, values, marks, *options):
        image, points = self.inputs / "i.nrrd", self.inputs / "m.xyz"
        write_nrrd(image, (SIZE,) * 3, np.asarray(values, "<f4").tobytes(), kind="float")
        write_xyz(points, map(tuple, marks))
        report = self.report("segment", image, "--points", points, "-o", "s.vdb", *options)
        return report.get("warnings", []), report["fit"]["image_support"]

    def test_what_belongs_together_is_not_doubted(self):
        for values in (self.values, 300 - self.values):
            warnings, support = self.warnings(values, self.marks)
            self.assertEqual(warnings, [])
            self.assertGreater(support, 0.9)

    def test_marks_on_the_middle_of_a_wide_line_are_not_doubted(self):
        # The image is uniform there, but predicts the marks well.
        for kind in ("round", "slit"):
            with self.subTest(kind):
                self.run_covol("phantom", f"sphere-{kind}", "--size", 64, "-o", "p.nrrd", "--points", "p.csv", "--count", 300, "--seed", 3)
                report = self.report("segment", "p.nrrd", "--points", "p.csv", "-o", "s.vdb")
                self.assertEqual(report.get("warnings", []), [])
                self.assertLess(report["fit"]["image_support"], 0.55)

    def test_noise(self):
        warnings, support = self.warnings(self.noise, self.marks)
        self.assertIn("does not show a border at the marks", " ".join(warnings))
        self.assertLess(abs(support - 0.5), 0.1)

    def test_marks_of_another_place_or_size(self):
        middle = np.array(CENTER)
        for marks in (self.marks + (8 * H, 0, 0), middle + 1.5 * (self.marks - middle), middle + 0.6 * (self.marks - middle)):
            warnings, _ = self.warnings(self.values, marks)
            self.assertIn("check whether the marks belong to this image", " ".join(warnings))

    def test_random_marks(self):
        marks = np.random.default_rng(7).uniform(-0.4, 0.4, (60, 3)) * SIZE * H + CENTER
        warnings, _ = self.warnings(self.values, marks)
        self.assertNotEqual(warnings, [])

    def test_marks_that_went_astray(self):
        """The surface follows the marks, and the image has no influence; the user has to check the marks."""
        far = np.array(CENTER) + [[0.45 * SIZE * H, 0, 0], [0, 0.46 * SIZE * H, 0.45 * SIZE * H]]
        small = np.array(CENTER) + 0.4 * (self.marks - CENTER)
        for marks, astray in ((small, 0), (np.concatenate([small, far]), 2)):
            warnings, _ = self.warnings(self.values, marks)
            found = [w for w in warnings if "lie far from all others" in w]
            self.assertEqual(len(found), astray > 0, warnings)
            if astray:
                self.assertTrue(found[0].startswith(f"2 of {len(marks)} marks"), found)
                warnings, _ = self.warnings(self.values, marks, "--remove-outliers")
                self.assertEqual([w for w in warnings if "lie far" in w], [])

    def test_values_that_single_precision_does_not_hold(self):
        warnings, _ = self.warnings(self.values + 1e9, self.marks)
        self.assertIn("subtract an offset", " ".join(warnings))


if __name__ == "__main__":
    unittest.main()
