"""Checkpoints of long flows: runs that are killed, signalled or stopped are resumed and give exactly the result of an
uninterrupted run.

    COVOL=build/bin/covol COVOL_KILL_AT=build/tests/libcovol_kill_at.so python3 -m unittest tests/cli/checkpoint_test.py
"""
import os
import shutil
import signal
import subprocess
import unittest

from covol_case import COVOL, Case, sphere_points, write_xyz


class Checkpoints(Case):
    def setUp(self):
        super().setUp()
        shutil.copy(self.image, self.out / "ball.nrrd")
        shutil.copy(self.points, self.out / "marks.xyz")

    def jobs(self):
        """Jobs, each with the number of the call before which its runs are killed, which is larger than publishing the results
        takes: a tracked band, through two flows and new edges; a fixed one; the coarse level first; two structures."""
        write_xyz(self.out / "dense.xyz", sphere_points(4000))
        marks = "marks.xyz"
        yield "tracked", 37, ["segment", "ball.nrrd", "--points", marks, "--init", "sphere:3,-2,1,4", "--model", "paper", "--max-steps", "40"]
        yield "fixed", 61, ["reconstruct", "dense.xyz", "--init", "tag", "--model", "paper", "--max-steps", "25", "--tolerance", "0"]
        yield "coarse", 43, ["segment", "ball.nrrd", "--points", marks, "--init", "tag", "--coarse-levels", "1", "--tolerance", "1e-5"]
        yield "two", 97, ["segment", "ball.nrrd", "--points", f"a={marks}", "b=dense.xyz", "--model", "paper", "--max-steps", "15"]

    def outputs(self):
        return {path.name: path.read_bytes() for path in self.out.iterdir() if path.name.startswith("s") and path.is_file()}

    def run_until_done(self, words, *more, calls):
        """Runs the job, killed before its calls-th call that puts files in place, and resumes it until it ends by itself. @return
        how often it was killed"""
        environment = {**os.environ, "LD_PRELOAD": os.environ["COVOL_KILL_AT"], "KILL_AT": str(calls)}
        killed = 0
        while True:
            done = subprocess.run([COVOL, *words, *more], cwd=self.out, env=environment, capture_output=True, text=True)
            if done.returncode == 0:
                return killed
            self.assertEqual(done.returncode, -signal.SIGKILL, done.stderr)
            killed += 1
            self.assertLess(killed, 400)

    @unittest.skipUnless("COVOL_KILL_AT" in os.environ, "COVOL_KILL_AT, the library that kills, is not set")
    def test_killed_runs_end_with_the_same_bits(self):
        for name, calls, words in self.jobs():
            with self.subTest(job=name):
                self.run_covol(*words, "-o", "s.vdb", "--mesh", "s.ply")
                undisturbed = self.outputs()
                for file in undisturbed:
                    (self.out / file).unlink()
                killed = self.run_until_done([*words, "-o", "s.vdb", "--mesh", "s.ply"], "--resume", "states", "--checkpoint-every", "0",
                                             calls=calls)
                self.assertGreater(killed, 1)
                self.assertEqual(self.outputs(), undisturbed)
                self.assertFalse((self.out / "states").exists())
                for file in undisturbed:
                    (self.out / file).unlink()

    def interrupt(self, words, *more, awaited=None):
        """Ends a run by a signal, once a file exists: its checkpoints are in `states`, and none is incomplete."""
        run = subprocess.Popen([COVOL, *words, *more, "--checkpoint", "states"], cwd=self.out, stderr=subprocess.PIPE, text=True)
        try:
            while not run.stderr.readline().startswith("covol: tag_distance"):
                self.assertIsNone(run.poll(), "ended before the signal")
            while awaited is not None and not awaited.exists():
                self.assertIsNone(run.poll(), f"ended without {awaited}")
            run.terminate()
            _, text = run.communicate(timeout=60)
        finally:
            run.kill()
        self.assertEqual(run.returncode, 130, text)

    def test_a_signal_keeps_the_state(self):
        words = ["segment", "ball.nrrd", "--points", "marks.xyz", "--init", "tag", "-o", "s.vdb", "--max-steps", "3000", "--tolerance", "0"]
        self.interrupt(words)
        self.assertIn("--resume", self.run_covol(*words, "--checkpoint", "states", code=3).stderr)
        other = [*words[:-1], "1e-9"]
        self.assertIn("other options", self.run_covol(*other, "--resume", "states", code=3).stderr)
        with open(self.out / "marks.xyz", "a") as file:
            file.write("\n")
        self.assertIn("inputs", self.run_covol(*words, "--resume", "states", code=3).stderr)

    def test_single_step(self):
        self.run_covol("distance", "marks.xyz", "--like", "ball.nrrd", "-o", "d.vdb", "--max-distance", "8vx")
        self.run_covol("band", "d.vdb", "-o", "b.vdb", "--tag-distance", "3vx")
        words = ["evolve", "b.vdb", "--distance", "d.vdb", "--max-steps", "12", "--tolerance", "0"]
        self.run_covol(*words, "-o", "u.vdb")
        undisturbed = (self.out / "u.vdb").read_bytes()
        if "COVOL_KILL_AT" in os.environ:
            self.assertGreater(self.run_until_done([*words, "-o", "u.vdb"], "--resume", "states", "--checkpoint-every", "0", calls=61), 1)
        self.assertEqual((self.out / "u.vdb").read_bytes(), undisturbed)

    def test_damaged_states(self):
        words = ["reconstruct", "marks.xyz", "--init", "tag", "--model", "paper", "-o", "s.vdb", "--max-steps", "300", "--tolerance", "0"]
        file = self.out / "states/flow-01.state"
        self.interrupt(words, "--checkpoint-every", "0", awaited=file)
        whole = file.read_bytes()
        for damaged in (b"", whole[:3], whole[:len(whole) // 2], whole + b"\0", bytes([whole[0] ^ 1]) + whole[1:],
                        whole[:-1000] + bytes([whole[-1000] ^ 4]) + whole[-999:]):
            file.write_bytes(damaged)
            self.assertIn("flow-01.state", self.run_covol(*words, "--resume", "states", code=3).stderr)
        file.write_bytes(whole)
        grids = self.out / "states/flow-01.vdb"
        kept = grids.read_bytes()
        grids.write_bytes(kept[:len(kept) // 2])
        self.assertIn("flow-01.vdb", self.run_covol(*words, "--resume", "states", code=3).stderr)
        grids.write_bytes(kept)
        self.run_covol(*words, "--resume", "states")

    def test_what_is_refused(self):
        words = ["segment", "ball.nrrd", "--points", "marks.xyz", "-o", "s.vdb"]
        self.assertIn("one folder", self.run_covol(*words, "--checkpoint", "a", "--resume", "b", code=2).stderr)
        self.assertIn("--checkpoint-every", self.run_covol(*words, "--checkpoint", "a", "--checkpoint-every", "-1", code=3).stderr)
        self.assertIn("not a folder", self.run_covol(*words, "--checkpoint", "ball.nrrd", code=4).stderr)
        self.assertIn("time-lapse", self.run_covol("segment", "ball.nrrd", "ball.nrrd", *words[2:-1], "s_{frame}.vdb", "--checkpoint", "a",
                                                   code=2).stderr)
        self.assertEqual(self.files(), ["ball.nrrd", "marks.xyz"])


if __name__ == "__main__":
    unittest.main()
