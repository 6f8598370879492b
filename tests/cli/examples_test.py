"""Every numbered example runs unchanged, makes the files that it names, and is listed in the README. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/examples_test.py

Scripts that a block of the docs runs are left out here: docs_test.py runs them, with the same checks.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from examples_case import PAGES, ROOT, blocks, check_example, examples_in  # noqa: E402

COVOL = pathlib.Path(os.environ.get("COVOL", "build/bin/covol")).resolve()
SCRIPTS = sorted((ROOT / "houdini_free_examples").glob("[0-9]*.sh"))
IN_PAGES = {name for page in PAGES for block in blocks(page, "bash") for name in examples_in(block)}


class Examples(unittest.TestCase):
    def run_script(self, script):
        out = pathlib.Path(tempfile.mkdtemp(prefix="covol-example-"))
        self.addCleanup(shutil.rmtree, out)
        done = subprocess.run(["bash", str(script)], capture_output=True, text=True, timeout=300, cwd=out,
                              env={**os.environ, "COVOL": str(COVOL), "COVOL_OUT": str(out)})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        check_example(self, done, out, out)

    def test_readme_lists_each(self):
        text = (ROOT / "README.md").read_text()
        for script in SCRIPTS:
            self.assertIn(script.name, text)


for path in SCRIPTS:
    if path.name not in IN_PAGES:
        setattr(Examples, f"test_{path.stem}", lambda self, path=path: self.run_script(path))

if __name__ == "__main__":
    unittest.main()
