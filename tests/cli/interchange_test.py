"""What other programs find in covol's files: positions, units, names, ranges; read by other libraries, or by readers that are
written here from the formats' specifications.

    COVOL=build/bin/covol python3 -m unittest tests/cli/interchange_test.py
"""
import json
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest

from covol_case import COVOL

try:
    import nibabel
    import numpy as np
    import pyopenvdb
    import tifffile
    MISSING = None
except ImportError as error:
    nibabel = np = pyopenvdb = tifffile = None
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

SPACING = (0.5, 0.5, 0.5)
ORIGIN = (10.0, -20.0, 5.0)
SIZE = (40, 32, 24)
CENTRE = (10.0 + 0.5 * 14, -20.0 + 0.5 * 16, 5.0 + 0.5 * 12)
RADIUS = 3.5


def read_ply(path):
    """Vertices with all of their properties, triangles, comments."""
    header, data = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    names = [line.split()[-1] for line in lines if line.startswith("property float")]
    count = [int(line.split()[2]) for line in lines if line.startswith("element")]
    vertices = np.frombuffer(data, "<f4", count[0] * len(names)).reshape(count[0], len(names))
    faces = np.frombuffer(data, np.dtype([("n", "u1"), ("v", "<u4", 3)]), count[1], vertices.nbytes)
    return names, vertices, faces["v"], [line[8:] for line in lines if line.startswith("comment ")]


def read_glb(path):
    """Positions, normals and triangles of each primitive, by glTF 2.0: y is up."""
    data = path.read_bytes()
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON"
    scene = json.loads(data[20:20 + size])
    size2, kind = struct.unpack("<I4s", data[20 + size:28 + size])
    assert kind == b"BIN\0"
    binary = data[28 + size:28 + size + size2]

    def values(number):
        accessor = scene["accessors"][number]
        view = scene["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        found = np.frombuffer(binary, kind, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
        if "min" in accessor:
            np.testing.assert_array_equal(found.min(0), np.float32(accessor["min"]))
            np.testing.assert_array_equal(found.max(0), np.float32(accessor["max"]))
        return found

    parts = []
    for node in scene["nodes"]:
        assert not {"matrix", "rotation", "scale", "translation"} & set(node)
        for primitive in scene["meshes"][node["mesh"]]["primitives"]:
            parts.append((values(primitive["attributes"]["POSITION"]), values(primitive["attributes"]["NORMAL"]),
                          values(primitive["indices"]).reshape(-1, 3)))
    return parts


def to_z_up(v):
    """The conversion that importers of glTF make if z is up, Blender's among them."""
    return np.stack([v[:, 0], -v[:, 2], v[:, 1]], axis=1)


def ball(centre=CENTRE, radius=RADIUS):
    k, j, i = np.meshgrid(*(np.arange(n) for n in reversed(SIZE)), indexing="ij")
    place = np.stack([i * SPACING[0] + ORIGIN[0], j * SPACING[1] + ORIGIN[1], k * SPACING[2] + ORIGIN[2]], -1)
    return np.clip((radius - np.linalg.norm(place - centre, axis=-1)) / SPACING[0] + 0.5, 0, 1)


def sphere(count, centre=CENTRE, radius=RADIUS):
    n = np.arange(count)
    up, turn = 1 - (2 * n + 1) / count, np.pi * (3 - np.sqrt(5)) * n
    flat = np.sqrt(1 - up ** 2)
    return np.array(centre) + radius * np.stack([flat * np.cos(turn), flat * np.sin(turn), up], 1)


def write_um_tiff(path, pixels):
    tifffile.imwrite(path, pixels, imagej=True, resolution=(1 / SPACING[0], 1 / SPACING[1]),
                     metadata={"axes": "TZYX"[-pixels.ndim:], "spacing": SPACING[2], "unit": "um", "mode": "grayscale",
                               "xorigin": -ORIGIN[0] / SPACING[0], "yorigin": -ORIGIN[1] / SPACING[1],
                               "zorigin": -ORIGIN[2] / SPACING[2]})


class Folder(unittest.TestCase):
    """An image in micrometres of a ball, its marks, and the files of one run."""

    @classmethod
    def setUpClass(cls):
        cls.out = pathlib.Path(tempfile.mkdtemp(prefix="covol-interchange-"))
        cls.addClassCleanup(shutil.rmtree, cls.out)
        cls.private = cls.out / "private folder"
        cls.private.mkdir()
        write_um_tiff(cls.private / "i.tif", np.uint8(20 + 200 * ball()))
        np.savetxt(cls.private / "p.xyz", sphere(300))
        cls.job = ("segment", cls.private / "i.tif", "--points", cls.private / "p.xyz", "--quiet")
        cls.run_covol(*cls.job, "-o", "s.vdb", "--mesh", "m.ply")

    @classmethod
    def run_covol(cls, *words, code=0):
        done = subprocess.run([COVOL, *map(str, words)], cwd=cls.out, capture_output=True, text=True)
        assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
        return done

    def report(self, *words):
        return json.loads(self.run_covol(*words, "--json", "-", "--quiet").stdout)


@unittest.skipIf(MISSING, MISSING)
class MeshFiles(Folder):
    def test_glb_lies_where_ply_lies_once_y_up_is_undone(self):
        self.run_covol("mesh", "s.vdb", "-o", "a.ply", "--quiet")
        self.run_covol("mesh", "s.vdb", "-o", "a.glb", "--quiet")
        names, ply, faces, _ = read_ply(self.out / "a.ply")
        self.assertEqual(names[:6], ["x", "y", "z", "nx", "ny", "nz"])
        (positions, normals, triangles), = read_glb(self.out / "a.glb")
        np.testing.assert_array_equal(to_z_up(positions), ply[:, :3])
        np.testing.assert_allclose(to_z_up(normals), ply[:, 3:6], atol=1e-6)
        np.testing.assert_array_equal(triangles, faces)
        self.assertGreater(np.abs(positions - ply[:, :3]).max(), 1, "the format is y up")
        # Vertex normals, for smooth shading: each points away from the centre of the ball.
        outward = (ply[:, :3] - CENTRE) / np.linalg.norm(ply[:, :3] - CENTRE, axis=1, keepdims=True)
        self.assertGreater((outward * ply[:, 3:6]).sum(1).min(), 0.95)
        self.run_covol("mesh", "s.vdb", "-o", "z.glb", "--up", "z", "--quiet")
        np.testing.assert_array_equal(read_glb(self.out / "z.glb")[0][0], ply[:, :3])

    def test_covol_reads_glb_as_z_up(self):
        self.run_covol("mesh", "s.vdb", "-o", "b.glb", "--quiet")
        self.run_covol("convert", "b.glb", "back.ply", "--quiet")
        self.run_covol("mesh", "s.vdb", "-o", "b.ply", "--quiet")
        np.testing.assert_array_equal(read_ply(self.out / "back.ply")[1][:, :3], read_ply(self.out / "b.ply")[1][:, :3])
        self.assertGreater(self.report("compare", "s.vdb", "b.glb")["compare"]["dice"], 0.98)

    def test_touching_structures_do_not_intersect_themselves(self):
        left, right = np.array(CENTRE) - (0, 2, 0), np.array(CENTRE) + (0, 3, 0)
        write_um_tiff(self.out / "two.tif", np.uint8(20 + 200 * np.maximum(ball(left), ball(right))))
        np.savetxt(self.out / "l.xyz", sphere(300, left))
        np.savetxt(self.out / "r.xyz", sphere(300, right))
        for name in "two.glb", "two.obj":
            with self.subTest(name):
                self.run_covol("segment", "two.tif", "--points", "l=l.xyz", "r=r.xyz", "-o", "two.vdb", "--mesh", name,
                               "--quiet")
                report = self.report("check", name)
                self.assertEqual(report["problems"], 0)
                self.assertTrue(any("different pieces intersect" in f["text"] for f in report["findings"]), report["findings"])
        # In a file of a single object, crossing surfaces are still an error. Here: two copies of a mesh, shifted by 1.
        parts = read_glb(self.out / "two.glb")
        vertices = np.concatenate([parts[0][0], parts[0][0] + (1, 0, 0)])
        faces = np.concatenate([parts[0][2], parts[0][2] + len(parts[0][0])])
        with open(self.out / "crossing.off", "w") as file:
            file.write(f"OFF\n{len(vertices)} {len(faces)} 0\n")
            np.savetxt(file, vertices, "%.9g")
            np.savetxt(file, np.c_[np.full(len(faces), 3), faces], "%d")
        done = self.run_covol("check", "crossing.off", code=3)
        self.assertIn("self-intersections", done.stdout)

    def test_comments_state_unit_and_space(self):
        comments = read_ply(self.out / "m.ply")[3]
        self.assertIn("covol_unit um", comments)
        self.assertIn("covol_space LPS", comments)
        np.savetxt(self.out / "cloud.xyz", sphere(800))
        self.run_covol("reconstruct", "cloud.xyz", "-o", "c.vdb", "--mesh", "c.ply", "--quiet")
        comments = read_ply(self.out / "c.ply")[3]
        self.assertIn("covol_unit not stated", comments)
        self.assertIn("covol_space none", comments)
        self.run_covol("mesh", "s.vdb", "-o", "later.ply", "--quiet")
        self.assertIn("covol_unit um", read_ply(self.out / "later.ply")[3])

    def test_folders_stay_private(self):
        self.run_covol("mesh", "s.vdb", "-o", "p.glb", "--quiet")
        self.run_covol("convert", self.private / "p.xyz", "p.csv", "--quiet")
        for name in "s.vdb", "m.ply", "p.glb", "p.csv":
            data = (self.out / name).read_bytes()
            self.assertNotIn(b"private folder", data, name)
            self.assertNotIn(str(self.out).encode(), data, name)
        metadata = pyopenvdb.read(str(self.out / "s.vdb"), "surface").metadata
        options = json.loads(metadata["covol_options"])
        self.assertEqual(options["points"], ["p.xyz"])


@unittest.skipIf(MISSING, MISSING)
class Vdb(Folder):
    def test_same_runs_write_the_same_bytes(self):
        for n in 0, 1:
            (self.out / f"run{n}").mkdir()
            subprocess.run([COVOL, *map(str, self.job), "-o", "a.vdb", "--density", "d.vdb"], check=True,
                           cwd=self.out / f"run{n}")
        for name in "a.vdb", "d.vdb":
            first, second = ((self.out / f"run{n}" / name).read_bytes() for n in (0, 1))
            self.assertEqual(first, second, name)
        uuids = {(self.out / "run0" / name).read_bytes()[21:57] for name in ("a.vdb", "d.vdb")}
        self.assertEqual(len(uuids), 2, "files that differ have numbers that differ")
        for uuid in uuids:
            self.assertRegex(uuid.decode(), "^[0-9a-f]{8}-[0-9a-f]{4}-8[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$")

    def test_other_readers_take_it_and_find_unit_and_space(self):
        grid = pyopenvdb.read(str(self.out / "s.vdb"), "surface")
        self.assertEqual(grid.metadata["covol_unit"], "um")
        self.assertEqual(grid.metadata["covol_space"], "LPS")
        if shutil.which("vdb_print"):
            shown = subprocess.run(["vdb_print", "-l", str(self.out / "s.vdb")], capture_output=True, text=True)
            self.assertEqual(shown.returncode, 0, shown.stderr)
            self.assertIn("covol_space", shown.stdout)
        # The command surface keeps the unit of its input.
        self.run_covol("surface", "s.vdb:surface", "-o", "again.vdb", "--quiet")
        self.assertEqual(pyopenvdb.read(str(self.out / "again.vdb"), "surface").metadata["covol_unit"], "um")


@unittest.skipIf(MISSING, MISSING)
class MaskFiles(Folder):
    def mask(self, name, *more, like=None):
        self.run_covol("mask", "s.vdb", "--like", like or self.private / "i.tif", "-o", name, "--quiet", *more)
        return self.out / name

    def expected(self):
        return tifffile.imread(self.mask("expected.tif"))

    def test_segmentation_of_one_structure_has_its_segment(self):
        self.run_covol(*self.job, "-o", "x.vdb", "--mask", "x.seg.nrrd")
        for path in self.out / "x.seg.nrrd", self.mask("y.seg.nrrd", "--label", "3"):
            header = path.read_bytes().split(b"\n\n", 1)[0].decode()
            for key in "Segment0_ID", "Segment0_Name:=surface", "Segment0_LabelValue", "Segment0_Extent":
                self.assertIn(key, header, path)
        self.assertIn("Segment0_LabelValue:=3", header)
        self.assertNotIn("Segment0_", self.mask("y.nrrd").read_bytes().split(b"\n\n", 1)[0].decode())

    def test_nrrd_states_its_unit_as_the_format_has_it(self):
        lines = self.mask("m.nrrd").read_bytes().split(b"\n\n", 1)[0].decode().splitlines()
        self.assertIn('space units: "um" "um" "um"', lines)
        self.assertLess(lines.index("space: left-posterior-superior"), lines.index('space units: "um" "um" "um"'))
        self.assertFalse([line for line in lines if line.startswith("unit")])
        self.assertEqual(self.report("info", "m.nrrd")["image"]["unit"], "um")

    def test_imagej_shows_labels_from_black_to_white(self):
        for label in 1, 7:
            with tifffile.TiffFile(self.mask("m.tif", "--label", label)) as tiff:
                self.assertEqual(tiff.imagej_metadata["min"], 0)
                self.assertEqual(tiff.imagej_metadata["max"], label)
                self.assertEqual(tiff.asarray().max(), label)
        self.run_covol("segment", self.private / "i.tif", "--points", f"a={self.private}/p.xyz", "-o", "n.vdb", "--mask",
                       "n.tif", "--quiet")
        with tifffile.TiffFile(self.out / "n.tif") as tiff:
            self.assertEqual(tiff.imagej_metadata["max"], 1)

    def test_ome_tiff(self):
        for name in "m.ome.tif", "M.OME.TIFF":
            with self.subTest(name), tifffile.TiffFile(self.mask(name)) as tiff:
                self.assertTrue(tiff.is_ome)
                self.assertFalse(tiff.is_imagej)
                self.assertEqual(tiff.series[0].axes, "ZYX")
                self.assertEqual(tiff.series[0].shape, SIZE[::-1])
                np.testing.assert_array_equal(tiff.asarray(), self.expected())
                pixels = tifffile.xml2dict(tiff.ome_metadata)["OME"]["Image"]["Pixels"]
                for a, axis in enumerate("XYZ"):
                    self.assertEqual(pixels["PhysicalSize" + axis], SPACING[a])
                    self.assertEqual(pixels[f"PhysicalSize{axis}Unit"], "\u00b5m")
                self.assertEqual(pixels["Type"], "uint8")
            image = self.report("info", name)["image"]
            self.assertEqual((image["format"], image["unit"], image["spacing"]), ("OME-TIFF", "um", list(SPACING)))
        done = self.run_covol("mask", "s.vdb", "--like", self.private / "i.tif", "-o", "w.ome.tif")
        self.assertIn("cannot store the image's origin", done.stderr)

    def test_nifti_states_micrometres(self):
        image = nibabel.load(self.mask("m.nii.gz"))
        self.assertEqual(image.header.get_xyzt_units()[0], "micron")
        np.testing.assert_allclose(image.header.get_zooms(), SPACING)
        read = self.report("info", "m.nii.gz")["image"]
        self.assertEqual(read["unit"], "um")
        np.testing.assert_allclose(read["spacing"], SPACING)
        np.testing.assert_allclose(read["origin"], ORIGIN)
        self.assertGreater(self.report("compare", "s.vdb", "m.nii.gz")["compare"]["dice"], 0.97)
        for unit, code in ("mm", "mm"), ("meter", "meter"):
            header = nibabel.load(self.write_nifti("u.nii", unit=unit))
            self.assertEqual(nibabel.load(self.mask("u_mask.nii", like="u.nii")).header.get_xyzt_units()[0], code)
            self.assertEqual(self.report("info", "u.nii")["image"]["unit"], {"mm": "mm", "meter": "m"}[unit])
            np.testing.assert_allclose(self.report("info", "u.nii")["image"]["spacing"], header.header.get_zooms())

    def write_nifti(self, name, q=1, s=1, unit="mm", qform=None, big=False):
        affine = np.diag([-SPACING[0], -SPACING[1], SPACING[2], 1.0])
        affine[:3, 3] = -ORIGIN[0], -ORIGIN[1], ORIGIN[2]
        header = nibabel.Nifti1Header(endianness=">" if big else "<")
        image = nibabel.Nifti1Image(np.uint8(200 * ball()).transpose(2, 1, 0), affine, header)
        image.header.set_xyzt_units(unit)
        image.set_sform(affine, code=s)
        image.set_qform(affine if qform is None else qform, code=q)
        nibabel.save(image, self.out / name)
        return self.out / name

    def test_nifti_keeps_the_codes_of_qform_and_sform(self):
        for big in False, True:
            for codes in (1, 1), (2, 4), (0, 2), (3, 0), (1, 0):
                with self.subTest(codes=codes, big=big):
                    given = nibabel.load(self.write_nifti("codes.nii", *codes, big=big))
                    made = nibabel.load(self.mask("codes_mask.nii.gz", like="codes.nii"))
                    self.assertEqual((int(made.header["qform_code"]), int(made.header["sform_code"])), codes)
                    np.testing.assert_allclose(made.affine, given.affine, atol=1e-5)
        self.run_covol("segment", "codes.nii", "--points", self.private / "p.xyz", "-o", "q.vdb", "--mask", "q.nii",
                       "--quiet")
        self.assertEqual(int(nibabel.load(self.out / "q.nii").header["qform_code"]), 1)
        self.assertEqual(int(nibabel.load(self.out / "q.nii").header["sform_code"]), 0)

    def test_nifti_keeps_a_qform_that_differs_from_the_sform(self):
        scanner = np.diag([-SPACING[0], -SPACING[1], SPACING[2], 1.0])
        scanner[:3, 3] = 1, 2, 3
        given = nibabel.load(self.write_nifti("both.nii", 1, 4, qform=scanner))
        made = nibabel.load(self.mask("both_mask.nii", like="both.nii"))
        np.testing.assert_allclose(made.get_qform(), given.get_qform(), atol=1e-5)
        np.testing.assert_allclose(made.get_sform(), given.get_sform(), atol=1e-5)

    def test_a_part_of_a_nifti_image_has_its_own_place(self):
        self.write_nifti("whole.nii", 2, 4)
        roi = "12,-18,6,20,-10,12"
        self.run_covol("mask", "s.vdb", "--like", "whole.nii", "--roi", roi, "-o", "part.nii", "--quiet")
        made, whole = nibabel.load(self.out / "part.nii"), nibabel.load(self.mask("all.nii", like="whole.nii"))
        self.assertNotEqual(made.shape, whole.shape)
        np.testing.assert_allclose(made.get_qform(), made.get_sform(), atol=1e-5)
        first = np.linalg.inv(whole.affine) @ made.affine @ (0, 0, 0, 1)
        low = np.rint(first[:3]).astype(int)
        part = tuple(slice(low[a], low[a] + made.shape[a]) for a in range(3))
        np.testing.assert_array_equal(np.asarray(made.dataobj), np.asarray(whole.dataobj)[part])

    def test_numpy_masks(self):
        voxels = np.load(self.mask("m.npy"))
        self.assertEqual((voxels.dtype, voxels.flags["C_CONTIGUOUS"]), (np.uint8, True))
        np.testing.assert_array_equal(voxels, self.expected())


@unittest.skipIf(MISSING, MISSING)
class NumpyImages(Folder):
    def test_an_image_in_another_format_keeps_its_voxels(self):
        values = np.arange(7 * 6 * 5).reshape(7, 6, 5)
        for kind in (np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.float32, np.float64):
            with self.subTest(kind.__name__):
                large = 2**31 if kind == np.uint32 else -2**30 + 1 if kind == np.int32 else 0.1 if kind == np.float64 else 0
                array = (values + large if large else values - (100 if np.dtype(kind).kind == "i" else 0)).astype(kind)
                np.save(self.out / "same.npy", array)
                self.run_covol("convert", "same.npy", "same.nrrd", "--spacing", "0.5,0.25,2", "--quiet")
                self.run_covol("convert", "same.nrrd", "again.npy", "--quiet")
                again = np.load(self.out / "again.npy")
                self.assertEqual(again.dtype, array.dtype)
                np.testing.assert_array_equal(again, array)
        self.run_covol("convert", self.private / "i.tif", "i.nii.gz", "--quiet")
        one, two = (self.report("info", path)["image"] for path in (self.private / "i.tif", "i.nii.gz"))
        for name in ("size", "spacing", "origin", "unit", "type"):
            self.assertEqual(one[name], two[name], name)
        x, y, z = ORIGIN
        self.run_covol("convert", self.private / "i.tif", "part.nrrd", "--roi", f"{x + 1},{y + 1},{z + 1},{x + 3},{y + 3},{z + 3}", "--quiet")
        part = self.report("info", "part.nrrd")["image"]
        self.assertLess(max(part["size"]), 10)
        self.assertGreater(part["origin"][0], x)
        self.assertIn("--like", self.run_covol("convert", "i.nii.gz", "j.nrrd", "--like", self.private / "i.tif", code=2).stderr)

    def test_types_and_orders(self):
        pixels = np.random.default_rng(5).integers(0, 100, SIZE[::-1])
        spacing = ("--spacing", ",".join(map(str, SPACING)))
        for kind in "|b1", "|u1", "|i1", "<u2", ">i2", "<u4", ">i4", "<f2", ">f4", "<f8":
            for order in "CF":
                with self.subTest(kind=kind, order=order):
                    given = np.asarray(pixels > 50 if kind == "|b1" else pixels, dtype=kind, order=order)
                    np.save(self.out / "a.npy", given)
                    self.run_covol("convert", "a.npy", "a.vdb", *spacing, "--quiet")
                    values = np.zeros(SIZE, np.float32)
                    pyopenvdb.read(str(self.out / "a.vdb"), "density").copyToArray(values)
                    np.testing.assert_array_equal(values.transpose(2, 1, 0), given.astype(np.float32))
        image = self.report("info", "a.npy", *spacing)["image"]
        self.assertEqual((image["size"], image["spacing"]), (list(SIZE), list(SPACING)))
        self.assertIn("--spacing", self.run_covol("info", "a.npy").stderr)

    def test_what_is_no_image_is_named(self):
        def refused(name, expected_text, code=3):
            done = self.run_covol("info", name, code=code)
            self.assertIn(expected_text, done.stderr)
        np.save(self.out / "flat.npy", np.zeros((4, 5)))
        refused("flat.npy", "three axes z, y, x")
        np.save(self.out / "long.npy", np.zeros((4, 5, 6), np.int64))
        refused("long.npy", "astype")
        np.save(self.out / "objects.npy", np.array([[[{}] * 2] * 2] * 2, dtype=object), allow_pickle=True)
        refused("objects.npy", "expected bool, integers")
        np.save(self.out / "good.npy", np.zeros((4, 5, 6), np.uint16))
        good = (self.out / "good.npy").read_bytes()
        for name, data in {"cut.npy": good[:-1], "short.npy": good[:40], "mark.npy": b"X" + good[1:],
                           "length.npy": good[:8] + b"\xff\xff" + good[10:],
                           "huge.npy": good.replace(b"(4, 5, 6), }        ", b"(4, 5, 600000000), }"),
                           "order.npy": good.replace(b"False", b"Maybe"),
                           "shape.npy": good.replace(b"(4, 5, 6)", b"(4, x, 6)")}.items():
            with self.subTest(name):
                (self.out / name).write_bytes(data)
                self.assertNotEqual(data, good)
                self.run_covol("info", name, code=3)


if __name__ == "__main__":
    unittest.main()
