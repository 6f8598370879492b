"""Each page of docs/in shows its picture, and the picture is approximately what tests/pictures/make.py makes now.

    COVOL=build/bin/covol PYTHONPATH=build/python /usr/bin/python3 -m unittest tests/pictures/made_test.py
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import make  # noqa: E402

DOCS = HERE.parents[1] / "docs"
# Columns and rows of cells over which a picture is averaged. In cells this large, letters and noise have almost no
# effect.
COARSE = (48, 32)


def look(path):
    """Its size, and its grey values averaged over a few cells."""
    with Image.open(path) as picture:
        return picture.size, np.asarray(picture.convert("L").resize(COARSE, Image.Resampling.BOX), float)


class Made(unittest.TestCase):
    def test_each_page_shows_its_picture(self):
        pages = sorted(path.stem for path in (DOCS / "in").glob("*.md"))
        self.assertEqual(pages, sorted(make.NEEDS))
        for name in pages:
            self.assertEqual(re.findall(r"pictures/(in_\w+)\.png", (DOCS / f"in/{name}.md").read_text()), [f"in_{name}"])

    def test_an_unknown_picture_is_reported(self):
        done = subprocess.run([sys.executable, HERE / "make.py", "out", "houdini"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no such picture: houdini", done.stderr)

    def distances(self, name):
        """Mean difference of grey values, averaged over coarse cells, between the new picture and each picture of docs, if the sizes are equal."""
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, HERE / "make.py", folder, name], capture_output=True, text=True, timeout=600)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            size, seen = look(pathlib.Path(folder) / f"in_{name}.png")
        kept = {other: look(DOCS / f"pictures/in_{other}.png") for other in make.NEEDS}
        return {other: np.abs(seen - grey).mean() if np.allclose(size, kept[name][0], rtol=0.1) else np.inf for other, (_, grey) in kept.items()}

    def compare(self, name):
        """The new picture has the size of that in docs, and is far more similar to it than to any other."""
        if absent := make.missing(name):
            self.skipTest(f"SKIPPED: {', '.join(absent)} not installed; see tests/run.sh")
        # Repeated, as a busy machine may capture a window before it is painted; a stale picture differs each time.
        for _ in range(3):
            far = self.distances(name)
            own = far.pop(name)
            if own < 0.1 * min(far.values()):
                return
        self.fail(f"docs/pictures/in_{name}.png is stale, by {own:.3g} grey values: make it anew by tests/pictures/make.py")


for name in make.NEEDS:
    setattr(Made, f"test_{name}", lambda self, name=name: self.compare(name))

if __name__ == "__main__":
    unittest.main()
