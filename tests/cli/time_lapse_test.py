"""Time-lapse, with the real binary.

    COVOL=build/bin/covol python3 -m unittest tests/cli/time_lapse_test.py
"""
import json
import math
import pathlib
import signal
import subprocess
import unittest

import numpy as np
import tifffile

from covol_case import COVOL, Case
from structures_case import DATA, H, ball_image, ball_points, fibonacci, rows_of, write_points


class TimeLapse(Case):
    FRAMES, N = 6, 40

    @staticmethod
    def ball_at(t):
        return (-2.0 + 0.5 * t, 0.3 * t, 0.2 * t), 4.0 + 0.3 * t

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.origin = (0.0, 0.0, 0.0)
        cls.middle = H * (cls.N - 1) / 2
        frames = []
        for t in range(cls.FRAMES):
            (x, y, z), r = cls.ball_at(t)
            m = cls.middle
            frames.append(ball_image((x + m, y + m, z + m), r, cls.N, H, cls.origin))
        cls.movie = cls.inputs / "movie.tif"
        tifffile.imwrite(cls.movie, np.stack(frames), imagej=True, resolution=(1 / H, 1 / H),
                         metadata={"axes": "TZYX", "spacing": H, "unit": "um"})
        cls.singles = []
        for t, frame in enumerate(frames):
            cls.singles.append(cls.inputs / f"single{t}.tif")
            tifffile.imwrite(cls.singles[-1], frame, imagej=True, resolution=(1 / H, 1 / H),
                             metadata={"axes": "ZYX", "spacing": H, "unit": "um"})
            write_points(cls.inputs / f"marks_{t:03d}.xyz", cls.marks(t, 1500))
            write_points(cls.inputs / f"few_{t:03d}.xyz", cls.marks(t, 100))  # sufficient for the first frame
        cls.first = cls.inputs / "few_000.xyz"

    @classmethod
    def marks(cls, t, count):
        center, r = cls.ball_at(t)
        return ball_points(np.asarray(center) + cls.middle, r, count)

    def check_radius(self, volume, t):
        r = (3 * volume / (4 * math.pi)) ** (1 / 3)
        self.assertLess(abs(r - self.ball_at(t)[1]), 0.35 * H, f"frame {t}")

    def test_each_frame_starts_from_the_one_before(self):
        report = self.report("segment", self.movie, "--points", self.first, "--frame", "all", "-o", "s.vdb", "--table", "t.csv",
                             "--mesh", "m.ply", "--mask", "m.nrrd")
        names = [f"{stem}_t{t:03d}.{end}" for stem, end in (("m", "nrrd"), ("m", "ply"), ("s", "vdb")) for t in range(self.FRAMES)]
        self.assertEqual(self.files(), sorted(names + ["t.csv"]))
        self.assertEqual([f["frame"] for f in report["frames"]], list(range(self.FRAMES)))
        rows = rows_of(self.out / "t.csv")
        self.assertEqual([r["frame"] for r in rows], [str(t) for t in range(self.FRAMES)])
        for t, (frame, row) in enumerate(zip(report["frames"], rows)):
            self.assertEqual((frame["status"], row["status"]), ("ok", "ok"))
            self.assertEqual(row["structure"], "surface")
            self.assertEqual(frame["input"]["points"]["count"], 100 if t == 0 else 0)
            self.assertEqual(frame["resolved"]["delta"], 0.25 * H)
            self.check_radius(frame["surface"]["volume"], t)
            self.assertAlmostEqual(float(row["volume (um^3)"]), frame["surface"]["volume"], delta=1e-5 * frame["surface"]["volume"])
            self.assertAlmostEqual(float(row["sphericity"]), 1, delta=0.02)
            center, radius = self.ball_at(t)
            for a, name in enumerate("xyz"):
                self.assertAlmostEqual(float(row[f"centroid_{name} (um)"]), center[a] + self.middle, delta=0.3 * H)
                self.assertAlmostEqual(float(row[f"extent_{name} (um)"]), 2 * radius, delta=0.7 * H)
        # The mask of a frame's surface has the right centre of gravity.
        for t in (0, self.FRAMES - 1):
            self.run_covol("mask", f"s_t{t:03d}.vdb", "--like", self.singles[0], "-o", "c.tif")
            where = np.argwhere(tifffile.imread(self.out / "c.tif") > 0).mean(axis=0)[::-1] * H
            np.testing.assert_allclose(where, np.asarray(self.ball_at(t)[0]) + self.middle, atol=0.3 * H)

    def test_a_range_and_one_frame(self):
        report = self.report("segment", self.movie, "--points", self.inputs / "few_002.xyz", "--frame", "2-3", "-o", "s.vdb",
                             "--delta", "0.3vx")
        self.assertEqual(self.files(), ["s_t002.vdb", "s_t003.vdb"])
        self.check_radius(report["frames"][1]["surface"]["volume"], 3)
        report = self.report("segment", self.movie, "--points", self.inputs / "few_004.xyz", "--frame", "4", "-o", "one.vdb",
                             "--delta", "0.3vx")
        self.assertIn("one.vdb", self.files())
        self.check_radius(report["surface"]["volume"], 4)
        for wrong in ("some", "3-1", "-1", "1-", ""):
            self.run_covol("segment", self.movie, "--points", self.first, "-o", "x.vdb", f"--frame={wrong}", code=2)
        self.run_covol("segment", self.movie, "--points", self.first, "-o", "x.vdb", "--frame", "4-6", code=3)
        self.assertNotIn("x.vdb", self.files())

    def test_marks_of_each_frame(self):
        pattern = self.inputs / "marks_{frame:03d}.xyz"
        report = self.report("segment", self.movie, "--points", pattern, "--frame", "0-2", "-o", "s.vdb", "--rho", 0)
        for t, frame in enumerate(report["frames"]):
            self.assertEqual(frame["input"]["points"]["count"], 1500)
            self.check_radius(frame["surface"]["volume"], t)
        self.run_covol("segment", self.movie, "--points", self.inputs / "marks_{frame:x}.xyz", "--frame", "0-2", "-o", "s.vdb", code=2)

    def test_a_frame_that_fails_does_not_lose_the_others(self):
        broken = self.inputs / "broken.tif"
        broken.write_bytes(self.singles[1].read_bytes()[:3000])
        images = [self.singles[0], broken, self.singles[1], self.singles[2]]
        done = self.run_covol("segment", *images, "--points", self.first, "-o", "s.vdb", "--table", "t.csv", "--json", "r.json",
                              "--delta", "0.3vx", code=3)
        self.assertIn("frame 1 failed", done.stderr)
        self.assertEqual(self.files(), ["r.json", "s_t000.vdb", "s_t002.vdb", "s_t003.vdb", "t.csv"])
        report = json.loads((self.out / "r.json").read_text())
        self.assertTrue(report["frames"][1]["status"].startswith("failed: "))
        rows = rows_of(self.out / "t.csv")
        self.assertEqual([r["status"] == "ok" for r in rows], [True, False, True, True])
        self.check_radius(report["frames"][2]["surface"]["volume"], 1)
        self.check_radius(report["frames"][3]["surface"]["volume"], 2)

    def test_nothing_but_failures(self):
        done = self.run_covol("segment", "none0.tif", "none1.tif", "--points", self.first, "-o", "s.vdb", code=4)
        self.assertIn("none0.tif", done.stderr.splitlines()[-1])
        self.assertEqual(self.files(), [])

    def test_outputs_are_checked_first(self):
        self.refuse("segment", self.movie, "--points", self.first, "--frame", "all", "-o", "no/folder/s.vdb", code=4)
        self.refuse("segment", self.movie, "--points", self.first, "--frame", "all", "-o", "s.vdb", "--table", "t.txt", code=3, expected_text="--table")

    def test_an_interrupt_leaves_the_frames_that_are_done(self):
        process = subprocess.Popen([COVOL, "segment", *[self.singles[0]] * 2000, "--points", self.first, "-o", "s.vdb",
                                    "--table", "t.csv"], cwd=self.out, stderr=subprocess.PIPE, text=True)
        try:
            # This line is printed when the second frame is done, and 1998 of 2000 frames are left.
            while "wrote s_t0001.vdb" not in (line := process.stderr.readline()):
                self.assertNotEqual(line, "", "ended before the second frame")
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
        finally:
            process.kill()
        self.assertEqual(process.returncode, 130)
        done = self.files()
        self.assertGreaterEqual(len(done), 2)
        self.assertLess(len(done), 2000)
        self.assertEqual(done, [f"s_t{t:04d}.vdb" for t in range(len(done))])
        self.assertEqual(self.report("info", done[-1])["grids"][0]["name"], "surface")

    def test_several_structures(self):
        # Two structures, the halves of a ball. Both have marks on their common flat side.
        shell = fibonacci(1500)
        for t in range(2):
            center, r = self.ball_at(t)
            steps = np.arange(-r, r, H)
            disc = np.array([(x, y, 0) for x in steps for y in steps if x * x + y * y < r * r])
            for name, side in (("low", shell[:, 2] < 0), ("up", shell[:, 2] > 0)):
                write_points(self.inputs / f"{name}_{t}.xyz",
                             np.asarray(center) + self.middle + np.concatenate([r * shell[side], disc]))
        report = self.report("segment", self.movie, "--points", f"low={self.inputs}/low_{{frame}}.xyz",
                             f"up={self.inputs}/up_{{frame}}.xyz", "--frame", "0-1", "-o", "s.vdb", "--mesh", "m.ply",
                             "--table", "t.csv", "--rho", 0, "--delta", "0.15vx", "--voxel-size", H / 2)
        self.assertEqual(self.files(), ["m_t000_low.ply", "m_t000_up.ply", "m_t001_low.ply", "m_t001_up.ply", "s_t000.vdb",
                                        "s_t001.vdb", "t.csv"])
        before, after = ([s["surface"]["volume"] for s in frame["structures"]] for frame in report["frames"])
        for t, volumes in enumerate((before, after)):
            half = 2 / 3 * math.pi * self.ball_at(t)[1] ** 3
            # At a radius of 16 voxels, 3 % of the volume is missing because the surface is 0.1 voxel inside the points,
            # and 1 % because the sharp rim is rounded by two voxels.
            for volume in volumes:
                self.assertTrue(0.95 < volume / half < 1, (t, volume / half))
        for old, new in zip(before, after):
            self.assertAlmostEqual(new / old, (self.ball_at(1)[1] / self.ball_at(0)[1]) ** 3, delta=0.03)
        self.assertEqual([(row["frame"], row["structure"]) for row in rows_of(self.out / "t.csv")],
                         [("0", "low"), ("0", "up"), ("1", "low"), ("1", "up")])

    @unittest.skipUnless(DATA, "SKIPPED: COVOL_DATA is not set")
    def test_droplet(self):
        folder = pathlib.Path(DATA) / "images"
        report = self.report("segment", folder / "droplet_t21.tif", "--frame", "all", "--init", "sphere:17.5,16,7,8", "-o", "d.vdb",
                             "--table", "t.csv", "--delta", "0.3vx")
        volumes = [f["surface"]["volume"] for f in report["frames"]]
        self.assertEqual(len(volumes), 21)
        # The droplet is incompressible, so that its volume must be equal in all frames, within 5 %.
        for v in volumes:
            self.assertLess(abs(v / np.median(volumes) - 1), 0.05)


if __name__ == "__main__":
    unittest.main()
