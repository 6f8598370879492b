"""Common to the tests of unusual inputs: the real program, and a body that each small input contains."""
import subprocess
import unittest

import covol_case
from covol_case import COVOL

try:
    import numpy as np
    import pyopenvdb
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

SIZE = (14, 12, 10)  # voxels along x, y, z


def body(size=SIZE, spacing=(1, 1, 1)):
    """[z, y, x] of bytes: a bright ellipsoid, not centred, and a ramp so that neighbouring voxels differ."""
    z, y, x = np.meshgrid(*(np.arange(n) * s for n, s in zip(size[::-1], spacing[::-1])), indexing="ij")
    inside = ((x - 6) / 4.2) ** 2 + ((y - 5.5) / 3.4) ** 2 + ((z - 4) / 3.1) ** 2 < 1
    return (np.where(inside, 180, 20) + x + 2 * y + 3 * z).astype(np.uint8)


def on_body(count=150):
    """Points on its surface, in voxels (x, y, z)."""
    n = np.arange(count) + 0.5
    z, turn = 1 - 2 * n / count, np.pi * (3 - np.sqrt(5)) * n
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], 1) * (4.2, 3.4, 3.1) + (6, 5.5, 4)


@unittest.skipIf(MISSING, MISSING)
class Case(covol_case.Case):
    def setUp(self):
        super().setUp()
        self.folder = self.out

    def info(self, *args):
        return self.report("info", *args)["image"]

    def refused(self, *args):
        """The error message for a file that must not be read."""
        done = subprocess.run([COVOL, *map(str, args)], capture_output=True, text=True, cwd=self.folder, timeout=300)
        self.assertIn(done.returncode, (2, 3), done.stderr)
        return done.stderr

    def voxels(self, *args):
        """[z, y, x] of an image with cubic voxels along the axes of the world."""
        self.run_covol("convert", args[0], "voxels.vdb", *args[1:], "--quiet")
        grid = pyopenvdb.readAll(str(self.folder / "voxels.vdb"))[0][0]
        low, high = grid.evalActiveVoxelBoundingBox()
        values = np.zeros([h - l + 1 for l, h in zip(low, high)], np.float32)
        grid.copyToArray(values, ijk=low)
        return values.transpose(2, 1, 0)
