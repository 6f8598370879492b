"""Common to the tests of files around a run: the program, short command lines, and a folder with marks."""
import os
import pathlib
import subprocess

from covol_case import COVOL, Case

PROGRAM = str(pathlib.Path(COVOL).resolve())
PHANTOM = ["phantom", "sphere", "--size", "16"]
LINE = ["--points", "marks.xyz", "--init", "tag", "--max-steps", "1"]


class Files(Case):
    def setUp(self):
        super().setUp()
        os.symlink(self.points, self.out / "marks.xyz")

    def hidden(self, folder="."):
        return sorted(p.name for p in (self.out / folder).iterdir() if p.name.startswith("."))

    def text(self, name):
        return (self.out / name).read_text()

    def bytes(self, name):
        return (self.out / name).read_bytes()

    def start(self, *args, **how):
        return subprocess.Popen([PROGRAM, *map(str, args)], cwd=self.out, stderr=subprocess.PIPE, text=True, **how)

    def fails(self, *args, code, expected_text, **how):
        done = subprocess.run([PROGRAM, *map(str, args), "--quiet"], cwd=self.out, capture_output=True, text=True, timeout=120, **how)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(expected_text, done.stderr.strip().splitlines()[-1])
        return done
