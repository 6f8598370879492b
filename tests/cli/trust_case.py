"""Common to the tests of untrusted files: a small result whose metadata is changed, and the check that a command leaves its folder as it was."""
import json
import re
import shutil
import subprocess

import pyopenvdb as vdb

from covol_case import COVOL, Case

ESC = "\x1b]0;title\x07\x1b[31m"
# Characters that steer a terminal: controls (C0 without line ends, C1), and those that change the direction of writing.
STEERS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


class Stranger(Case):
    """A folder with a small result whose metadata is changed."""

    def setUp(self):
        super().setUp()
        shutil.copy(self.image, self.out / "ball.nrrd")
        shutil.copy(self.points, self.out / "ball.xyz")

    def make(self, *more, image="ball.nrrd"):
        self.run_covol("segment", "--points", "ball.xyz", "--init", "tag", "-o", "s.vdb", "--max-steps", "2", "--quiet", *more, "--", image)
        facts = vdb.readMetadata(str(self.out / "s.vdb"))
        return {key: json.loads(facts[f"covol_{key}"]) for key in ("options", "given", "inputs")}

    def write(self, **changed):
        """Writes t.vdb: s.vdb with other metadata."""
        grids, facts = vdb.readAll(str(self.out / "s.vdb"))
        texts = {f"covol_{key}": value if isinstance(value, str) else json.dumps(value) for key, value in changed.items()}
        for grid in grids:
            for key, value in texts.items():
                grid[key] = value
        vdb.write(str(self.out / "t.vdb"), grids, facts | texts)

    def state(self):
        return {str(path.relative_to(self.out)): path.read_bytes() if path.is_file() else None for path in sorted(self.out.rglob("*"))}

    def untouched(self, *command, code=3, expected_text=""):
        before = self.state()
        done = subprocess.run([COVOL, *map(str, command)], cwd=self.out, capture_output=True, timeout=120)
        error = done.stderr.decode(errors="replace")
        self.assertEqual(done.returncode, code, error)
        self.assertIn(expected_text, error)
        self.assertIsNone(STEERS.search(error + done.stdout.decode(errors="replace")), error)
        self.assertEqual(self.state(), before)
        return error
