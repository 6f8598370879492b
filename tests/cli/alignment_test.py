"""Level set, mesh and label image of one run coincide, also with the truth, in the world of a rotated image with anisotropic
voxels; other programs read the level set.

    COVOL=build/bin/covol python3 -m unittest tests/cli/alignment_test.py
"""
import gzip
import json
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

try:
    import numpy as np
    import pyopenvdb as vdb
    MISSING = None
except ImportError as error:
    np = vdb = None
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

COVOL = os.environ.get("COVOL", "build/bin/covol")
SPACING = (0.4, 0.5, 1.1)
SIZE = (60, 50, 24)
CENTER = (11.0, -7.0, 30.0)
RADIUS = 8.0
H = min(SPACING)


def rotation():
    """Rotated about z by 25 degrees, then about x by -40, so that every axis changes."""
    a, b = math.radians(25), math.radians(-40)
    about_z = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]])
    return about_x @ about_z


def read_nrrd(path):
    """Fields and voxels, indexed i, j, k."""
    header, data = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in header.decode().splitlines() if ": " in line)
    if fields["encoding"] in ("gzip", "gz"):
        data = gzip.decompress(data)
    return fields, np.frombuffer(data, {"unsigned char": "u1", "int": "<i4"}[fields["type"]]).reshape(
        [int(n) for n in fields["sizes"].split()], order="F")


def vectors(text):
    return np.array([[float(c) for c in part.strip("() ").split(",")] for part in text.split(") ")])


def read_vertices(path):
    header, data = path.read_bytes().split(b"end_header\n", 1)
    count = int(header.split(b"element vertex ")[1].split()[0])
    columns = header.split(b"element face")[0].count(b"property float")
    return np.frombuffer(data, "<f4", count * columns).reshape(count, columns)[:, :3].astype(float)


def sample(grid, positions):
    """Values of the grid at world positions, by trilinear interpolation."""
    values, accessor = [], grid.getConstAccessor()
    for position in positions:
        index = np.array(grid.transform.worldToIndex(tuple(position)))
        low = np.floor(index).astype(int)
        t, value = index - low, 0.0
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, t, 1 - t))
            value += weight * accessor.getValue(tuple(int(c) for c in low + corner))
        values.append(value)
    return np.array(values)


@unittest.skipIf(MISSING, MISSING)
class Alignment(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = pathlib.Path(tempfile.mkdtemp(prefix="covol-alignment-"))
        cls.addClassCleanup(shutil.rmtree, cls.out)
        # Column a: the step in the world from a voxel to the next along axis a.
        cls.axes = rotation() @ np.diag(SPACING)
        cls.origin = np.array(CENTER) - cls.axes @ ((np.array(SIZE) - 1) / 2)
        i, j, k = np.meshgrid(*map(np.arange, SIZE), indexing="ij")
        cls.lattice = np.stack([i, j, k], axis=-1) @ cls.axes.T + cls.origin
        # Depth of each voxel below the surface of the sphere, > 0 inside.
        cls.depth = RADIUS - np.linalg.norm(cls.lattice - CENTER, axis=-1)
        image = (40 + 160 * np.clip(cls.depth / H + 0.5, 0, 1)).astype("u1")
        steps = " ".join("(" + ",".join(repr(float(c)) for c in cls.axes[:, a]) + ")" for a in range(3))
        header = "\n".join(["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior",
                            "sizes: %d %d %d" % SIZE, f"space directions: {steps}", "endian: little", "encoding: raw",
                            "space origin: (" + ",".join(repr(float(c)) for c in cls.origin) + ")", "", ""])
        (cls.out / "i.nrrd").write_bytes(header.encode() + image.tobytes(order="F"))
        n = np.arange(1500)
        up, turn = 1 - (2 * n + 1) / len(n), math.pi * (3 - math.sqrt(5)) * n
        flat = np.sqrt(1 - up ** 2)
        np.savetxt(cls.out / "p.xyz", CENTER + RADIUS * np.stack([flat * np.cos(turn), flat * np.sin(turn), up], 1))
        subprocess.run([COVOL, "segment", "i.nrrd", "--points", "p.xyz", "-o", "s.vdb", "--mesh", "m.ply", "--mask",
                        "m.nrrd", "--density", "d.vdb", "--quiet"], check=True, cwd=cls.out)
        cls.grid = vdb.read(str(cls.out / "s.vdb"), "surface")
        cls.vertices = read_vertices(cls.out / "m.ply")
        cls.fields, cls.mask = read_nrrd(cls.out / "m.nrrd")

    def test_mask_has_the_images_lattice(self):
        self.assertEqual(self.mask.shape, SIZE)
        np.testing.assert_allclose(vectors(self.fields["space directions"]), self.axes.T, atol=1e-6)
        np.testing.assert_allclose(vectors(self.fields["space origin"])[0], self.origin, atol=1e-5)

    def test_mesh_lies_on_the_level_set(self):
        some = self.vertices[:: max(1, len(self.vertices) // 2000)]
        self.assertGreater(len(some), 1000)
        self.assertLess(np.abs(sample(self.grid, some)).max(), 0.5 * H)

    def test_mask_lies_in_the_level_set(self):
        near = np.abs(self.depth) < 2 * H
        values = sample(self.grid, self.lattice[near])
        clear = np.abs(values) > 1e-4 * H
        np.testing.assert_array_equal(values[clear] < 0, self.mask[near][clear] > 0)
        self.assertTrue(np.all(self.mask[self.depth > 2 * H] > 0))
        self.assertFalse(np.any(self.mask[self.depth < -2 * H]))

    def test_all_lie_on_the_truth(self):
        off = np.linalg.norm(self.vertices - CENTER, axis=1) - RADIUS
        self.assertLess(np.abs(off).max(), 0.5 * H)
        clear = np.abs(self.depth) > 0.5 * H
        np.testing.assert_array_equal(self.mask[clear] > 0, self.depth[clear] > 0)

    def test_openvdb_reads_class_names_transform_and_metadata(self):
        self.assertEqual([g.name for g in vdb.readAllGridMetadata(str(self.out / "s.vdb"))], ["surface"])
        self.assertEqual(self.grid.gridClass, vdb.GridClass.LEVEL_SET)
        np.testing.assert_allclose(self.grid.transform.voxelSize(), (H, H, H))
        self.assertAlmostEqual(self.grid.background, 3 * H, places=5)
        self.assertIn("covol_version", self.grid.metadata)
        self.assertEqual(json.loads(self.grid.metadata["covol_options"])["command"], "segment")
        fog = vdb.read(str(self.out / "d.vdb"), "density")
        self.assertEqual(fog.gridClass, vdb.GridClass.FOG_VOLUME)

    def test_vdb_print(self):
        if not shutil.which("vdb_print"):
            self.skipTest("SKIPPED: there is no vdb_print; see tests/install_packages.sh")
        output = subprocess.run(["vdb_print", "-l", "s.vdb"], check=True, capture_output=True, text=True, cwd=self.out).stdout
        for word in ("surface", "level set", "covol_version", "voxel size: 0.4"):
            self.assertIn(word, output)


if __name__ == "__main__":
    unittest.main()
