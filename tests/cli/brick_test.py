"""Tests covol brick plan, run and join, and --memory-limit, which does the same.

    COVOL=build/bin/covol python3 -m unittest tests/cli/brick_test.py
"""
import json
import random
import shutil
import signal
import subprocess
import time
import unittest

import numpy as np

from covol_case import COVOL, Case

SIZE = 128  # voxels along each axis of the image


class Bricks(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.image, cls.marks = cls.inputs / "torus.nrrd", cls.inputs / "torus.xyz"
        subprocess.run([COVOL, "phantom", "torus", "--size", str(SIZE), "--count", "6000", "-o", cls.image, "--points", cls.marks],
                       check=True, capture_output=True)
        cls.job = ["segment", str(cls.image), "--points", str(cls.marks), "--model", "paper"]

    def plan(self, folder, *more):
        self.run_covol("brick", "plan", *self.job, *more, "--brick-voxels", "40000", "-o", folder, "--json", "plan.json")
        return json.loads((self.out / "plan.json").read_text())["plan"]

    def states(self, folder):
        return {path.relative_to(self.out / folder): path.read_bytes() for path in sorted((self.out / folder).glob("sweep-*/brick-*.vdb"))}

    def values(self, path, grid="surface"):
        import pyopenvdb as vdb
        surface = vdb.read(str(path), grid)
        low, high = surface.evalActiveVoxelBoundingBox()
        array = np.zeros([b - a + 1 for a, b in zip(low, high)], np.float32)
        surface.copyToArray(array, low)
        return low, array

    def test_joined_is_whole(self):
        planned = self.plan("plan")
        self.assertGreaterEqual(planned["bricks"], 4)
        self.run_covol("brick", "run", "plan")
        self.run_covol("brick", "join", "plan", "-o", "joined.vdb", "--mesh", "joined.ply", "--json", "joined.json")
        # The run in one piece starts from a coarse solution, as the bricks do. Without it, the two results differ by up
        # to 0.07 voxels.
        self.run_covol(*self.job, "--coarse-levels", "1", "-o", "whole.vdb")
        report = json.loads((self.out / "joined.json").read_text())
        self.assertTrue(report["surface"]["closed"])
        self.assertEqual(report["surface"]["genus"], 1)
        (low, joined), (other, whole) = self.values(self.out / "joined.vdb"), self.values(self.out / "whole.vdb")
        self.assertEqual(low, other)
        h = float(np.abs(whole).max()) / 3
        near = np.abs(whole) < h
        self.assertGreater(near.sum(), 10000)
        self.assertLess(np.abs(joined - whole)[near].max(), 0.05 * h)

    def test_a_killed_run_goes_on_with_the_same_bits(self):
        self.plan("calm")
        self.run_covol("brick", "run", "calm")
        calm = self.states("calm")
        shutil.copytree(self.out / "calm", self.out / "torn", ignore=lambda folder, names: [n for n in names if n.startswith("sweep")])
        chance, command = random.Random(1), [COVOL, "brick", "run", "torn", "--quiet"]
        for kill in range(20):
            run = subprocess.Popen(command, cwd=self.out, stderr=subprocess.DEVNULL)
            time.sleep(chance.uniform(0, 0.6))
            run.send_signal(signal.SIGKILL)
            run.wait()
        self.run_covol("brick", "run", "torn")
        torn = self.states("torn")
        self.assertEqual(sorted(calm), sorted(torn))
        for path in calm:
            (low, one), (other, two) = self.values(self.out / "calm" / path, "u"), self.values(self.out / "torn" / path, "u")
            self.assertEqual(low, other)
            self.assertTrue(np.array_equal(one, two), path)

    def test_a_folder_as_an_input(self):
        self.run_covol("phantom", "sphere", "--size", "40", "--count", "5000", "-o", "t.zarr", "--points", "t.xyz")
        self.run_covol("brick", "plan", "segment", "t.zarr", "--points", "t.xyz", "--model", "paper", "--up", "y", "--brick-voxels", "20000", "-o", "plan")
        self.run_covol("brick", "run", "plan")
        self.run_covol("brick", "join", "plan", "-o", "t.vdb")

    def test_bricks_by_number(self):
        planned = self.plan("plan")
        error = self.run_covol("brick", "run", "plan", "0", "--sweep", "2", code=3).stderr
        self.assertIn("run that first", error)
        self.assertIn("expected bricks 0 to", self.run_covol("brick", "run", "plan", "999", code=2).stderr)
        self.assertIn("brick run", self.run_covol("brick", "join", "plan", "-o", "s.vdb", code=3).stderr)
        for brick in range(planned["bricks"]):
            self.run_covol("brick", "run", "plan", str(brick))
        before = {path: path.stat().st_mtime_ns for path in (self.out / "plan/sweep-01").iterdir()}
        # These bricks are done, and must not be solved and written again.
        self.run_covol("brick", "run", "plan", "0", "1")
        self.assertEqual(before, {path: path.stat().st_mtime_ns for path in before})
        self.run_covol("brick", "join", "plan", "-o", "s.vdb")

    def test_not_steady(self):
        planned = self.plan("plan", "--max-steps", "2", "--tolerance", "0")
        self.run_covol("brick", "run", "plan")
        output = self.run_covol("brick", "join", "plan", "-o", "s.vdb", "--json", "s.json", "--strict", code=5).stderr
        self.assertRegex(output, f"[0-9]+ of {planned['bricks']} bricks are not steady after [0-9]+ steps")
        report = json.loads((self.out / "s.json").read_text())
        self.assertEqual(report["solve"]["stop_reason"], "max_steps")
        self.assertEqual(report["resolved"]["edge_feature"], "slope")
        self.assertGreater(report["resolved"]["edge_k"], 0)

    def test_the_surface_has_the_same_bits_whatever_else_is_made(self):
        self.plan("plan")
        self.run_covol("brick", "run", "plan")
        self.run_covol("brick", "join", "plan", "-o", "alone.vdb")
        alone = self.values(self.out / "alone.vdb")
        for more in (["--mesh", "s.ply"], ["--mesh", "s.ply", "--plain"], ["--fields", "f.vdb"]):
            with self.subTest(more):
                self.run_covol("brick", "join", "plan", "-o", "joined.vdb", *more)
                low, joined = self.values(self.out / "joined.vdb")
                self.assertEqual(low, alone[0])
                self.assertEqual(np.count_nonzero(joined != alone[1]), 0)

    def test_within_a_memory_limit(self):
        run = self.run_covol(*self.job, "-o", "s.vdb", "--mesh", "s.ply", "--memory-limit", "175M", "--json", "s.json")
        self.assertRegex(run.stderr, r"about [1-9][0-9]+000 voxels in the band, .* in [0-9]+ bricks")
        report = json.loads((self.out / "s.json").read_text())
        self.assertTrue(report["surface"]["closed"])
        self.assertIn("bricks", report["automatic"])
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), ["s.json", "s.ply", "s.vdb"])

    def test_a_mesh_that_does_not_fit_is_streamed(self):
        self.plan("plan")
        self.run_covol("brick", "run", "plan")
        self.run_covol("brick", "join", "plan", "-o", "s.vdb", "--mesh", "s.ply", "--plain", "--json", "s.json")
        report = json.loads((self.out / "s.json").read_text())
        self.assertTrue(report["surface"]["closed"])
        self.assertEqual(list(report["mesh"]), ["triangles"])
        again = self.run_covol("mesh", "s.vdb", "-o", "again.ply", "--plain", "--json", "-")
        self.assertEqual(json.loads(again.stdout)["mesh"]["triangles"], report["mesh"]["triangles"])
        faces = [(self.out / name).read_bytes().partition(b"end_header")[2] for name in ("s.ply", "again.ply")]
        self.assertEqual(*faces)
        self.assertIn(".ply", self.run_covol("brick", "join", "plan", "-o", "t.vdb", "--mesh", "t.glb", "--plain", code=2).stderr)
        refused = self.run_covol("brick", "join", "plan", "-o", "t.vdb", "--memory-limit", "60M", code=3).stderr
        self.assertIn("--memory-limit", refused)

    def test_what_cannot_be_planned(self):
        self.assertIn("expected -o FOLDER", self.run_covol("brick", "plan", *self.job, code=2).stderr)
        self.assertIn("expected plan, run or join", self.run_covol("brick", "split", "x", code=2).stderr)
        self.assertIn("cannot read", self.run_covol("brick", "run", "nowhere", code=4).stderr)
        guess = self.run_covol("brick", "plan", "segment", self.image, "--points", self.few(), "-o", "plan", code=3).stderr
        self.assertIn("marks for a guess", guess)
        self.plan("plan")
        self.assertIn("already", self.run_covol("brick", "plan", *self.job, "-o", "plan", code=3).stderr)
        path = self.out / "plan/plan.json"
        plan = json.loads(path.read_text())
        plan["bricks"][0]["neighbours"] = [10 ** 6]
        path.write_text(json.dumps(plan))
        self.assertIn("expected a plan", self.run_covol("brick", "run", "plan", code=3).stderr)
        path.write_text(path.read_text()[:1000])
        self.assertIn("expected a plan", self.run_covol("brick", "run", "plan", code=3).stderr)

    def test_inputs_that_changed(self):
        self.plan("plan")
        copy = self.inputs / "marks2.xyz"
        shutil.copy(self.marks, copy)
        path = self.out / "plan/plan.json"
        path.write_text(path.read_text().replace(str(self.marks), str(copy)))
        with open(copy, "a") as file:
            file.write("0 0 0\n")
        self.assertIn("plan again", self.run_covol("brick", "run", "plan", code=3).stderr)

    def few(self):
        path = self.inputs / "few.xyz"
        path.write_text("".join(line + "\n" for line in self.marks.read_text().splitlines()[::60]))
        return path


if __name__ == "__main__":
    unittest.main()
