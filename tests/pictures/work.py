"""Common to the scripts that make pictures: the sample stack and its marks, a folder, the program, and drawing."""
import csv
import os
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np
from PIL import Image, ImageChops

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "houdini_free_examples/data"


class Work:
    """A folder that is removed when the pictures are done."""

    def __init__(self):
        self.program = pathlib.Path(os.environ.get("COVOL", "build/bin/covol")).resolve()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="covol-pictures-"))
        self.stack, self.marks_file = DATA / "celegans_embryo.tif", DATA / "celegans_marks.csv"
        with open(self.marks_file, newline="") as file:
            self.marks = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
        self.spacing = (1.0, 1.0, 3.5)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.folder)

    def new_folder(self):
        return pathlib.Path(tempfile.mkdtemp(dir=self.folder))

    def covol(self, *words, cwd=None):
        done = subprocess.run([self.program, *map(str, words)], capture_output=True, text=True, cwd=cwd or self.folder)
        if done.returncode:
            raise RuntimeError(done.stderr)
        return done.stdout


def crop(picture):
    """Without the black area of a screen that has no desktop."""
    picture = picture.convert("RGB")
    return picture.crop(ImageChops.difference(picture, Image.new("RGB", picture.size)).getbbox())
