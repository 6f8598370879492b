"""Every numbered example runs unchanged, makes the files that it names, and is listed in the README. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/examples_test.py
"""
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COVOL = pathlib.Path(os.environ.get("COVOL", "build/bin/covol")).resolve()
SCRIPTS = sorted((ROOT / "houdini_free_examples").glob("[0-9]*.sh"))


class Examples(unittest.TestCase):
    def run_script(self, script):
        out = pathlib.Path(tempfile.mkdtemp(prefix="covol-example-"))
        self.addCleanup(shutil.rmtree, out)
        done = subprocess.run(["bash", str(script)], capture_output=True, text=True, timeout=300, cwd=out,
                              env={**os.environ, "COVOL": str(COVOL), "COVOL_OUT": str(out)})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertNotIn("warning", done.stderr)
        output = done.stdout.split("== results", 1)
        self.assertEqual(len(output), 2, done.stdout)
        named = {pathlib.Path(path) for path in re.findall(rf"{re.escape(str(out))}/[\w/.-]*\w", output[1])}
        self.assertTrue(named, "no file is named")
        for path in named:
            self.assertTrue(path.is_file() and path.stat().st_size > 0, f"{path} is named, but not there")
        pictures = list(out.rglob("*.png"))
        self.assertTrue(pictures, "no picture")
        for picture in pictures:
            data = picture.read_bytes()
            self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
            width, height = struct.unpack(">II", data[16:24])
            # A picture of a single colour compresses to almost nothing.
            self.assertGreater(len(data), width * height / 100, f"{picture} is empty")

    def test_readme_lists_each(self):
        text = (ROOT / "README.md").read_text()
        for script in SCRIPTS:
            self.assertIn(script.name, text)


for path in SCRIPTS:
    setattr(Examples, f"test_{path.stem}", lambda self, path=path: self.run_script(path))

if __name__ == "__main__":
    unittest.main()
