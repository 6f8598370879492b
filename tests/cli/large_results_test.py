"""Masks written box by box and meshes written piece by piece, read back by other programs.

    COVOL=build/bin/covol python3 -m unittest tests/cli/large_results_test.py
"""
import gzip
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

COVOL = os.environ.get("COVOL", "build/bin/covol")

try:
    import nibabel
    import numpy as np
    import pyopenvdb as vdb
    import tifffile
    import zarr
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

SIZE = (150, 141, 139)         # voxels along x, y, z: two Zarr chunks along each axis
SPACING = (0.5, 0.625, 1.25)
ORIGIN = (10.0, -20.0, 5.5)
CENTRE = (46.3, 22.1, 90.4)
RADIUS = 31.0


def run(*arguments, code=0):
    done = subprocess.run([COVOL, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == code, f"{arguments}: exit {done.returncode}\n{done.stderr}"
    return done


def write_like(path):
    path.write_bytes(("NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: %d %d %d\n" % SIZE +
                      "space directions: (%g,0,0) (0,%g,0) (0,0,%g)\n" % SPACING + "space origin: (%g,%g,%g)\n" % ORIGIN +
                      "kinds: domain domain domain\nspace units: \"um\" \"um\" \"um\"\nencoding: raw\n\n").encode() +
                     bytes(SIZE[0] * SIZE[1] * SIZE[2]))


def ball():
    """A level set with voxels of 0.5, and its trilinear samples at the image's voxels: [z, y, x]."""
    h = 0.5
    grid = vdb.createLevelSetSphere(radius=RADIUS, center=CENTRE, voxelSize=h, halfWidth=3.0)
    grid.name = "surface"
    low = [int((o - 2) / h) for o in ORIGIN]
    high = [int((o + s * n + 2) / h) for o, s, n in zip(ORIGIN, SPACING, SIZE)]
    values = np.empty([b - a for a, b in zip(low, high)], np.float32)
    grid.copyToArray(values, ijk=low)
    for axis in range(3):
        at = (ORIGIN[axis] + SPACING[axis] * np.arange(SIZE[axis])) / h - low[axis]
        base = np.floor(at).astype(int)
        part = (at - base).reshape([-1 if a == axis else 1 for a in range(3)])
        values = (1 - part) * np.take(values, base, axis) + part * np.take(values, base + 1, axis)
    return grid, values.transpose(2, 1, 0)


def nrrd(path):
    data = path.read_bytes()
    begin = data.index(b"\n\n") + 2
    header = data[:begin].decode()
    voxels = gzip.decompress(data[begin:]) if "encoding: gzip" in header else data[begin:]
    return header, np.frombuffer(voxels, "<i4" if "type: int" in header else np.uint8).reshape(SIZE[::-1])


def mha(path):
    data = path.read_bytes()
    begin = data.index(b"ElementDataFile = LOCAL\n") + len(b"ElementDataFile = LOCAL\n")
    header = data[:begin].decode()
    fields = dict(line.split(" = ", 1) for line in header.splitlines())
    packed = data[begin:]
    if fields["CompressedData"] == "True":
        assert int(fields["CompressedDataSize"]) == len(packed)
        packed = zlib.decompress(packed)
    return header, np.frombuffer(packed, np.uint8).reshape(SIZE[::-1])


@unittest.skipIf(MISSING, MISSING)
class Masks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.like = cls.folder / "like.nrrd"
        write_like(cls.like)
        grid, cls.distance = ball()
        cls.vdb = cls.folder / "ball.vdb"
        vdb.write(str(cls.vdb), [grid])

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def mask(self, name, *more):
        path = self.folder / name
        report = json.loads(run("mask", self.vdb, "--like", self.like, "-o", path, "--json", "-", *more).stdout)
        return path, report

    def check(self, voxels, label=1):
        """Equal to the dense samples except for rounding."""
        inside = self.distance < 0
        differs = (np.asarray(voxels) != label * inside) & (np.abs(self.distance) > 1e-5)
        self.assertEqual(np.asarray(voxels).shape, inside.shape)
        self.assertEqual(int(differs.sum()), 0)
        self.assertTrue(0.1 < inside.mean() < 0.9)

    def test_nrrd_and_metaimage(self):
        for more, encoding in ((), "gzip"), (("--raw",), "raw"):
            path, report = self.mask("m.nrrd", "--label", 7, *more)
            header, voxels = nrrd(path)
            self.assertIn("encoding: " + encoding, header)
            self.assertIn('space units: "um" "um" "um"', header)
            self.check(voxels, 7)
            self.assertEqual(report["mask"]["voxels"], int((voxels == 7).sum()))
            path, _ = self.mask("m.mha", *more)
            header, voxels = mha(path)
            self.assertIn("Offset = 10 -20 5.5\n", header)
            self.check(voxels)

    def test_nifti(self):
        for name in "m.nii", "m.nii.gz":
            path, _ = self.mask(name)
            image = nibabel.load(path)
            self.check(np.asarray(image.dataobj).transpose(2, 1, 0))
            for affine in image.affine, image.get_qform(), image.get_sform():
                np.testing.assert_allclose(affine[:3, 3], (-10, 20, 5.5))
                np.testing.assert_allclose(affine[:3, :3], np.diag((-0.5, -0.625, 1.25)), atol=1e-6)

    def test_nifti_of_a_turned_image(self):
        """qform and sform agree, for rotations about each axis and for mirror images."""
        pixels = np.zeros((5, 6, 7), np.uint8)
        for n, axes in enumerate(((0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1))):
            for flip in (1, 1, 1), (-1, 1, 1), (-1, -1, 1), (-1, -1, -1):
                turn = np.eye(3)[:, list(axes)] * np.array(flip)
                angle = 0.4 * n
                turn = turn @ np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
                affine = np.eye(4)
                affine[:3, :3] = turn * (0.5, 2, 3)
                affine[:3, 3] = 46, 22, 90
                like = self.folder / "turned.nii"
                nibabel.save(nibabel.Nifti1Image(pixels, affine), like)
                path = self.folder / "turned_mask.nii"
                run("mask", self.vdb, "--like", like, "-o", path)
                made = nibabel.load(path)
                for got in made.get_qform(), made.get_sform():
                    np.testing.assert_allclose(got, affine, atol=2e-5)

    def test_tiff(self):
        path, _ = self.mask("m.tif")
        with tifffile.TiffFile(path) as tiff:
            self.assertFalse(tiff.is_bigtiff)
            self.assertEqual(tiff.imagej_metadata["unit"], "um")
            self.assertEqual(tiff.imagej_metadata["spacing"], 1.25)
            self.check(tiff.asarray())

    def test_ome_zarr(self):
        path, _ = self.mask("m.ome.zarr", "--label", 3)
        group = zarr.open(str(path), "r")
        self.check(group["0"][:], 3)
        scale = group.attrs["multiscales"][0]["datasets"]
        self.assertEqual(scale[0]["coordinateTransformations"],
                         [{"type": "scale", "scale": [1.25, 0.625, 0.5]}, {"type": "translation", "translation": [5.5, -20, 10]}])
        self.assertIn("image-label", group.attrs)
        # A voxel of level 1 has the most frequent value of the 2 x 2 voxels of level 0 that it covers; ties are not
        # tested.
        fine, coarse = group["0"][:], group["1"][:]
        factors = [round(b / a) for a, b in zip(scale[0]["coordinateTransformations"][0]["scale"],
                                                scale[1]["coordinateTransformations"][0]["scale"])]
        self.assertEqual(factors, [1, 2, 2])
        self.assertEqual(coarse.shape, (139, 71, 75))
        whole = (fine[:, :140] == 3).reshape(139, 70, 2, 75, 2).sum((2, 4))
        decided = whole != 2
        self.assertTrue(((coarse[:, :70] == 3) == (whole > 2))[decided].all())
        # covol reads this store as the same mask as an NRRD file.
        self.mask("m.nrrd", "--label", 3)
        same = json.loads(run("compare", path, self.folder / "m.nrrd", "--json", "-").stdout)
        self.assertEqual(same["compare"]["dice"] if "compare" in same else same["dice"], 1)

    def test_a_store_is_replaced_and_nothing_else(self):
        path, _ = self.mask("again.zarr")
        self.mask("again.zarr")
        for name in "other.zarr", "m.zarr":
            (self.folder / name).mkdir()
            (self.folder / name / "notes.txt").write_text("mine")
            done = run("mask", self.vdb, "--like", self.like, "-o", self.folder / name, code=4)
            self.assertIn("is not a Zarr store", done.stderr)
            self.assertEqual((self.folder / name / "notes.txt").read_text(), "mine")
        for like in path, path / "0":
            done = run("mask", self.vdb, "--like", like, "-o", path, code=3)
            self.assertIn("lies in it", done.stderr)
        self.assertFalse([p for p in self.folder.iterdir() if p.name.startswith(".covol")])


def read_ply(path):
    data = path.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    counts = [int(line.split()[2]) for line in data[:begin].decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(data, np.dtype("<f4"), 6 * counts[0], begin).reshape(-1, 6)
    faces = np.frombuffer(data, np.dtype([("n", "u1"), ("v", "<u4", 3)]), counts[1], begin + 24 * counts[0])
    assert begin + 24 * counts[0] + 13 * counts[1] == len(data) and (faces["n"] == 3).all()
    return vertices[:, :3], vertices[:, 3:], faces["v"]


def read_obj(path):
    rows = {"v": [], "vn": [], "f": []}
    for line in path.read_text().splitlines():
        key, *words = line.split()
        if key == "f":
            assert all(w.split("//")[0] == w.split("//")[1] for w in words)
            rows["f"].append([int(w.split("//")[0]) - 1 for w in words])
        elif key in rows:
            rows[key].append([float(w) for w in words])
    return np.array(rows["v"], np.float32), np.array(rows["vn"], np.float32), np.array(rows["f"])


def read_stl(path):
    data = path.read_bytes()
    count, = struct.unpack_from("<I", data, 80)
    assert len(data) == 84 + 50 * count
    records = np.frombuffer(data, np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")]), count, 84)
    return records["n"], records["p"]


@unittest.skipIf(MISSING, MISSING)
class Meshes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        h = 0.5
        one = vdb.createLevelSetSphere(radius=60.0, center=(3.1, -7.7, 12.3), voxelSize=h, halfWidth=3.0)
        other = vdb.createLevelSetSphere(radius=4.0, center=(80, 0.3, 0.1), voxelSize=h, halfWidth=3.0)
        # The union of both balls in one grid: the level set is the minimum of the two level sets.
        one.combine(other, min)
        one.name = "surface"
        cls.vdb = cls.folder / "balls.vdb"
        vdb.write(str(cls.vdb), [one])

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def mesh(self, name, *more):
        path = self.folder / name
        report = json.loads(run("mesh", self.vdb, "-o", path, "--plain", "--json", "-", *more).stdout)
        return path, report

    def check_closed(self, points, faces):
        self.assertEqual(len(np.unique(points, axis=0)), len(points), "a vertex is there twice")
        self.assertEqual(set(np.unique(faces)), set(range(len(points))), "a vertex of no face")
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
        forth = edges[:, 0] * len(points) + edges[:, 1]
        back = edges[:, 1] * len(points) + edges[:, 0]
        self.assertEqual(len(np.unique(forth)), len(forth))
        self.assertTrue((np.sort(forth) == np.sort(back)).all())

    def check_measures(self, report, points, faces):
        corners = points.astype(float)[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        surface = report["surface"]
        self.assertAlmostEqual(surface["area"] / (np.linalg.norm(normal, axis=1).sum() / 2), 1, 9)
        volume = (corners[:, 0] * normal).sum() / 6
        self.assertAlmostEqual(surface["volume"] / volume, 1, 6)
        self.assertAlmostEqual(volume / (4 / 3 * np.pi * (60 ** 3 + 4 ** 3)), 1, 3)
        self.assertEqual((surface["components"], surface["genus"], surface["closed"], surface["manifold"]), (2, 0, True, True))
        self.assertEqual(report["mesh"], {"vertices": len(points), "triangles": len(faces)})

    def test_the_three_formats_hold_one_closed_mesh(self):
        path, report = self.mesh("a.ply")
        points, normals, faces = read_ply(path)
        self.check_closed(points, faces)
        self.check_measures(report, points, faces)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
        # The normals on the large ball (x < 70) point outward.
        large = points[:, 0] < 70
        outward = ((points - (3.1, -7.7, 12.3)) * normals).sum(1)[large] / 60
        self.assertTrue(outward.min() > 0.5 and outward.mean() > 0.99, (outward.min(), outward.mean()))
        got, got_normals, got_faces = read_obj(self.mesh("a.obj")[0])
        np.testing.assert_array_equal(got, points)
        np.testing.assert_array_equal(got_normals, normals)
        np.testing.assert_array_equal(got_faces, faces)
        np.testing.assert_array_equal(read_stl(self.mesh("a.stl")[0])[1], points[faces])
        self.assertEqual(sorted(p.name for p in self.folder.iterdir() if p.name.startswith(".")), [])

    def test_axes_and_units(self):
        points, normals, faces = read_ply(self.mesh("a.ply")[0])
        turned, turned_normals, same = read_ply(self.mesh("up.ply", "--up", "y", "--unit-scale", "2")[0])
        np.testing.assert_array_equal(turned, 2 * points[:, [0, 2, 1]] * (1, 1, -1))
        np.testing.assert_allclose(turned_normals, normals[:, [0, 2, 1]] * (1, 1, -1), atol=1e-6)
        np.testing.assert_array_equal(same, faces)

    def test_what_needs_the_whole_mesh_is_refused(self):
        for more in ("--smooth", "2"), ("--adaptive", "1vx"), ("--min-component", "3vx"):
            done = run("mesh", self.vdb, "-o", self.folder / "x.ply", "--plain", *more, code=2)
            self.assertIn("--plain", done.stderr)
        self.assertIn(".stl", run("mesh", self.vdb, "-o", self.folder / "x.glb", "--plain", code=2).stderr)
        done = run("mesh", self.vdb, "-o", self.folder / "x.ply", "--plain", "--isovalue", "-1000", code=3)
        self.assertFalse((self.folder / "x.ply").exists())


if __name__ == "__main__":
    unittest.main()
