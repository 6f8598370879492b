"""Independent readers agree on what covol writes: VTK, meshio, pyopenvdb, nibabel, tifffile and a reader of NanoVDB
find the same vertices, orientation, box and spacing in every format, and the body that the image shows.

    COVOL=build/bin/covol python3 -m unittest tests/cli/readers_test.py
"""
import re
import shutil
import subprocess
import unittest

from interchange_test import Folder

try:
    import meshio
    import nibabel
    import numpy as np
    import pyopenvdb
    import tifffile
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter
    from vtkmodules.vtkFiltersGeometry import vtkCompositeDataGeometryFilter
    from vtkmodules.vtkIOGeometry import vtkGLTFReader, vtkOBJReader, vtkSTLReader
    from vtkmodules.vtkIOImage import (vtkMetaImageReader, vtkNIFTIImageReader, vtkNrrdReader, vtkTIFFReader)
    from vtkmodules.vtkIOPLY import vtkPLYReader
    MISSING = None
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

# An ellipsoid with three different axes, away from the image's centre, with anisotropic voxels: a rotation, a
# reflection or a shift gives a different body. Lengths are in micrometres.
SPACING = (0.5, 0.4, 0.75)
SIZE = (44, 52, 30)
ORIGIN = (10.0, -20.0, 5.0)
CENTRE = (20.2, -9.1, 16.5)
AXES = (6.5, 4.0, 8.0)
H = 0.4

VERTEX = 1e-5   # um; tolerance for vertices: single precision at these coordinates
MEASURE = 1e-5  # relative tolerance for volume and area of the same triangles
# tolerance, in voxels of the image, for bounding boxes and for the distance of misclassified voxels from the ellipsoid.
BODY = 1.0


def voxel_places():
    k, j, i = np.meshgrid(*(np.arange(n) for n in reversed(SIZE)), indexing="ij")
    return np.stack([ORIGIN[a] + SPACING[a] * n for a, n in enumerate((i, j, k))], -1)


def outside(places):
    """Distance to the ellipsoid, < 0 inside, to first order."""
    q = (places - CENTRE) / AXES
    r = np.linalg.norm(q, axis=-1)
    return (r - 1) * r / np.maximum(np.linalg.norm(q / AXES, axis=-1), 1e-9)


def marks(count):
    n = np.arange(count)
    up, turn = 1 - (2 * n + 1) / count, np.pi * (3 - np.sqrt(5)) * n
    flat = np.sqrt(1 - up ** 2)
    return np.array(CENTRE) + AXES * np.stack([flat * np.cos(turn), flat * np.sin(turn), up], 1)


def signed_volume(v, t):
    a, b, c = (v[t[:, n]].astype(float) for n in range(3))
    return (a * np.cross(b, c)).sum() / 6


def area(v, t):
    a, b, c = (v[t[:, n]].astype(float) for n in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def in_order(v):
    """Vertices of a triangle soup or a mesh as one sorted list without duplicates."""
    return np.unique(np.round(v / VERTEX).astype(np.int64), axis=0)


class Job(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        pixels = np.uint8(20 + 200 * np.clip(0.5 - outside(voxel_places()) / 0.5, 0, 1))
        tifffile.imwrite(cls.out / "e.tif", pixels, imagej=True, resolution=(1 / SPACING[0], 1 / SPACING[1]),
                         metadata={"axes": "ZYX", "spacing": SPACING[2], "unit": "um",
                                   **{f"{name}origin": -ORIGIN[a] / SPACING[a] for a, name in enumerate("xyz")}})
        np.savetxt(cls.out / "e.xyz", marks(400))
        cls.run_covol("segment", "e.tif", "--points", "e.xyz", "-o", "e.vdb", "--density", "e.vdb", "--voxel-size", H,
                      "--quiet")


@unittest.skipIf(MISSING, MISSING)
class Meshes(Job):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for end in "ply", "obj", "stl", "off", "glb":
            cls.run_covol("mesh", "e.vdb", "-o", f"e.{end}", "--quiet")

    def by_vtk(self, name, reader):
        reader.SetFileName(str(self.out / name))
        if name.endswith(".glb"):
            flat = vtkCompositeDataGeometryFilter()
            flat.SetInputConnection(reader.GetOutputPort())
            reader = flat
        triangles = vtkTriangleFilter()
        triangles.SetInputConnection(reader.GetOutputPort())
        triangles.Update()
        made = triangles.GetOutput()
        faces = vtk_to_numpy(made.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        vertices = vtk_to_numpy(made.GetPoints().GetData())
        normals = made.GetPointData().GetNormals()
        if name.endswith(".glb"):  # in glTF, y is up: the rotation is undone
            vertices = np.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], 1)
        return vertices, faces, None if normals is None else vtk_to_numpy(normals)

    def by_meshio(self, name):
        mesh = meshio.read(self.out / name)
        return mesh.points, mesh.cells_dict["triangle"], None

    def test_all_formats_hold_one_mesh(self):
        found = {"PLY, VTK": self.by_vtk("e.ply", vtkPLYReader()), "OBJ, VTK": self.by_vtk("e.obj", vtkOBJReader()),
                 "STL, VTK": self.by_vtk("e.stl", vtkSTLReader()), "GLB, VTK": self.by_vtk("e.glb", vtkGLTFReader()),
                 "PLY, meshio": self.by_meshio("e.ply"), "OFF, meshio": self.by_meshio("e.off"),
                 "STL, meshio": self.by_meshio("e.stl"), "OBJ, meshio": self.by_meshio("e.obj")}
        vertices, faces, _ = found["PLY, VTK"]
        self.assertGreater(len(faces), 5000)
        self.assertGreater(signed_volume(vertices, faces), 0, "outward")
        for name, (v, t, normals) in found.items():
            with self.subTest(name):
                self.assertEqual(len(t), len(faces))
                np.testing.assert_allclose(v[t].reshape(-1, 3).min(0), vertices.min(0), atol=VERTEX)
                np.testing.assert_allclose(v[t].reshape(-1, 3).max(0), vertices.max(0), atol=VERTEX)
                # Triangles are equal corner by corner, so that they have the same order and orientation.
                np.testing.assert_allclose(v[t], vertices[faces], atol=VERTEX)
                np.testing.assert_allclose(signed_volume(v, t), signed_volume(vertices, faces), rtol=MEASURE)
                np.testing.assert_allclose(area(v, t), area(vertices, faces), rtol=MEASURE)
                if name in ("PLY, VTK", "OBJ, VTK"):
                    self.assertIsNotNone(normals, "normals at vertices")
                    outward = (v - CENTRE) / np.square(AXES)
                    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
                    self.assertGreater(np.percentile((outward * normals).sum(1), 1), 0.97)

    def test_the_mesh_is_the_body(self):
        vertices, faces, _ = self.by_vtk("e.ply", vtkPLYReader())
        np.testing.assert_allclose(vertices.min(0), np.subtract(CENTRE, AXES), atol=BODY * 0.75)
        np.testing.assert_allclose(vertices.max(0), np.add(CENTRE, AXES), atol=BODY * 0.75)
        np.testing.assert_allclose(signed_volume(vertices, faces), 4 / 3 * np.pi * np.prod(AXES), rtol=0.03)

    def test_level_set_and_fog_lie_where_the_mesh_lies(self):
        vertices, faces, _ = self.by_vtk("e.ply", vtkPLYReader())
        grid = pyopenvdb.read(str(self.out / "e.vdb"), "surface")
        self.assertEqual(grid.gridClass, "level set")
        np.testing.assert_allclose(grid.transform.voxelSize(), H, rtol=1e-6)
        values = grid.getConstAccessor()
        # At the vertices of the mesh the level set is about 0, one voxel outward about +1 voxel, one voxel inward -1.
        normal = np.zeros_like(vertices, dtype=float)
        face_normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
        for n in range(3):
            np.add.at(normal, faces[:, n], face_normals)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)

        def at(place):
            low = np.floor(place).astype(int)
            part, total = place - low, 0.0
            for corner in np.ndindex(2, 2, 2):
                weight = np.prod(np.where(corner, part, 1 - part))
                total += weight * values.getValue(tuple(int(c) for c in low + corner))
            return total

        chosen = np.arange(0, len(vertices), 37)
        index = [[np.array(grid.transform.worldToIndex(tuple(map(float, vertices[n] + side * H * normal[n]))))
                  for n in chosen] for side in (-1, 0, 1)]
        inside, on, out = ([at(place) / H for place in places] for places in index)
        self.assertLess(np.abs(on).max(), 0.3)
        self.assertLess(np.abs(on).mean(), 0.02)
        np.testing.assert_allclose(inside, -1, atol=0.3)
        np.testing.assert_allclose(out, 1, atol=0.3)
        fog = pyopenvdb.read(str(self.out / "e.vdb"), "density")
        self.assertEqual(fog.gridClass, "fog volume")
        low, high = fog.evalActiveVoxelBoundingBox()
        for corner, side in (low, vertices.min(0)), (high, vertices.max(0)):
            np.testing.assert_allclose(fog.transform.indexToWorld(corner), side, atol=H * 1.01)
        self.assertEqual(fog.getConstAccessor().getValue(tuple(int(round(x)) for x in fog.transform.worldToIndex(CENTRE))), 1)

    def test_compressions(self):
        expected = pyopenvdb.read(str(self.out / "e.vdb"), "surface")
        # OpenVDB does not apply zip to level sets and fog volumes, even if it was requested: only Blosc or no
        # compression. A distance grid, which is neither, is compressed by zip.
        for packing in "zip", "none":
            self.run_covol("distance", "e.xyz", "-o", f"d_{packing}.vdb", "--voxel-size", "0.5", "--compression", packing,
                           "--quiet")
        grid, other = (pyopenvdb.read(str(self.out / f"d_{packing}.vdb"), "distance") for packing in ("zip", "none"))
        self.assertEqual(grid.metadata["file_compression"], "zip + active values")
        self.assertEqual(other.metadata["file_compression"], "active values")
        values, others = np.zeros((2, 60, 60, 60), np.float32)
        for g, array in (grid, values), (other, others):
            g.copyToArray(array, ijk=g.evalActiveVoxelBoundingBox()[0])
        np.testing.assert_array_equal(values, others)
        self.assertLess((self.out / "d_zip.vdb").stat().st_size, (self.out / "d_none.vdb").stat().st_size)
        for compression, flag in ("none", "active values"), ("zip", "active values"), ("blosc", "blosc + active"):
            with self.subTest(compression):
                name = f"c_{compression}.vdb"
                self.run_covol("convert", "e.vdb", name, "--compression", compression, "--quiet")
                metadata = pyopenvdb.readGridMetadata(str(self.out / name), "surface").metadata
                self.assertTrue(metadata["file_compression"].startswith(flag), metadata["file_compression"])
                grid = pyopenvdb.read(str(self.out / name), "surface")
                self.assertEqual(grid.activeVoxelCount(), expected.activeVoxelCount())
                for item in grid.citerOnValues():
                    self.assertEqual(item.value, expected.getConstAccessor().getValue(item.min))
                    break
                if shutil.which("vdb_print"):
                    shown = subprocess.run(["vdb_print", "-l", self.out / name], capture_output=True, text=True)
                    self.assertEqual(shown.returncode, 0, shown.stderr)
                    self.assertIn("density", shown.stdout)

    @unittest.skipUnless(shutil.which("nanovdb_validate"), "SKIPPED: nanovdb_validate (libnanovdb-tools) is not here")
    def test_nanovdb(self):
        self.run_covol("convert", "e.vdb", "e.nvdb", "--quiet")
        checked = subprocess.run(["nanovdb_validate", "-v", self.out / "e.nvdb"], capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
        self.assertNotIn("FAIL", checked.stdout.upper(), checked.stdout)
        shown = subprocess.run(["nanovdb_print", "-v", self.out / "e.nvdb"], capture_output=True, text=True).stdout
        grid = pyopenvdb.read(str(self.out / "e.vdb"), "surface")
        self.assertIn("surface", shown)
        self.assertIn("density", shown)
        self.assertIn(str(grid.activeVoxelCount()), re.sub(r"[,']", "", shown))
        damaged = bytearray((self.out / "e.nvdb").read_bytes())
        damaged[len(damaged) // 2] ^= 0xFF
        (self.out / "damaged.nvdb").write_bytes(damaged)
        checked = subprocess.run(["nanovdb_validate", self.out / "damaged.nvdb"], capture_output=True, text=True)
        self.assertTrue(checked.returncode != 0 or "FAIL" in (checked.stdout + checked.stderr).upper())
        self.assertIn("are not read", self.run_covol("info", "e.nvdb", code=3).stderr)


@unittest.skipIf(MISSING, MISSING)
class Masks(Job):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for end in "nrrd", "seg.nrrd", "nii.gz", "tif", "ome.tif", "mha":
            cls.run_covol("mask", "e.vdb", "--like", "e.tif", "-o", f"m.{end}", "--quiet")

    def by_vtk(self, name, reader, lps=True):
        """Voxels z, y, x; spacing and origin in LPS."""
        self.assertTrue(reader.CanReadFile(str(self.out / name)), name)
        reader.SetFileName(str(self.out / name))
        reader.Update()
        made = reader.GetOutput()
        voxels = vtk_to_numpy(made.GetPointData().GetScalars()).reshape(tuple(reversed(made.GetDimensions())))
        return voxels, made.GetSpacing(), made.GetOrigin()

    def expect(self, name, voxels, spacing=None, origin=None, tolerance=1e-5):
        self.assertEqual(voxels.shape, SIZE[::-1], name)
        wrong = (voxels > 0) != (outside(voxel_places()) < 0)
        self.assertLess(np.abs(outside(voxel_places())[wrong]).max(initial=0), BODY * min(SPACING), name)
        self.assertGreater((voxels > 0).sum(), 4000, name)
        np.testing.assert_array_equal(voxels, tifffile.imread(self.out / "m.tif"), name)
        if spacing is not None:
            np.testing.assert_allclose(spacing, SPACING, rtol=tolerance, err_msg=name)
        if origin is not None:
            np.testing.assert_allclose(origin, ORIGIN, atol=tolerance, err_msg=name)

    def test_vtk_nrrd_and_metaimage(self):
        self.expect("m.mha", *self.by_vtk("m.mha", vtkMetaImageReader()))
        for name in "m.nrrd", "m.seg.nrrd":
            self.expect(name, *self.by_vtk(name, vtkNrrdReader()))

    def test_nifti(self):
        image = nibabel.load(self.out / "m.nii.gz")
        to_lps = np.diag([-1, -1, 1, 1]) @ image.affine
        self.expect("nibabel", np.asarray(image.dataobj).transpose(2, 1, 0), np.diag(to_lps)[:3], to_lps[:3, 3])
        np.testing.assert_allclose(to_lps[:3, :3], np.diag(SPACING), atol=1e-6)
        reader = vtkNIFTIImageReader()
        voxels, spacing, _ = self.by_vtk("m.nii.gz", reader)
        for matrix in reader.GetQFormMatrix(), reader.GetSFormMatrix():
            affine = np.diag([-1, -1, 1, 1]) @ [[matrix.GetElement(r, c) for c in range(4)] for r in range(4)]
            # In VTK the spacing is separate from the matrix, which is a rotation.
            np.testing.assert_allclose(np.abs(affine[:3, :3]).max(1), 1, atol=1e-5)
            self.expect("VTK", voxels, spacing, affine[:3, 3])

    def test_tiff(self):
        with tifffile.TiffFile(self.out / "m.tif") as tiff:
            x, y = (tiff.pages[0].tags[f"{axis}Resolution"].value for axis in "XY")
            spacing = (x[1] / x[0], y[1] / y[0], tiff.imagej_metadata["spacing"])
            origin = [-tiff.imagej_metadata[f"{axis}origin"] * spacing[a] for a, axis in enumerate("xyz")]
            self.expect("tifffile", tiff.asarray(), spacing, origin, 1e-4)
        with tifffile.TiffFile(self.out / "m.ome.tif") as tiff:
            pixels = tifffile.xml2dict(tiff.ome_metadata)["OME"]["Image"]["Pixels"]
            self.expect("tifffile, OME", tiff.asarray(), [pixels[f"PhysicalSize{axis}"] for axis in "XYZ"])
        for name in "m.tif", "m.ome.tif":  # VTK decodes the pages by libtiff, unlike tifffile
            reader = vtkTIFFReader()
            reader.SetOrientationType(1)  # orientation top left: VTK does not reverse the rows
            voxels, _, _ = self.by_vtk(name, reader)
            if name == "m.tif" or voxels.shape == SIZE[::-1]:
                self.expect(name, voxels[:, ::1])


if __name__ == "__main__":
    unittest.main()
