"""Images whose headers state the positions of their voxels in unusual ways: NIfTI, NRRD, TIFF, Imaris.

    COVOL=build/bin/covol python3 -m unittest tests/cli/cases_images_test.py
"""
import gzip
import unittest

from cases_case import SIZE, Case, body, on_body

try:
    import h5py
    import nibabel
    import numpy as np
    import tifffile
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

LPS = np.diag([-1.0, -1.0, 1.0]) if not MISSING else None
# A rotation with exact decimals: 7 / 25 = 0.28, 24 / 25 = 0.96.
TURNED = ((0.96, -0.28, 0.0), (0.28, 0.96, 0.0), (0.0, 0.0, 1.0))


def affine(steps, origin):
    """The affine from voxels to RAS; its columns are the steps along the axes."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.asarray(steps).T
    matrix[:3, 3] = origin
    return matrix


def nifti(path, sform=None, qform=None, codes=(0, 0), pixdim=None):
    image = nibabel.Nifti1Image(body().transpose(2, 1, 0), sform if sform is not None else np.eye(4))
    image.header.set_xyzt_units("mm")
    if qform is not None:
        image.set_qform(qform, code=1)
    if sform is not None:
        image.set_sform(sform, code=1)
    plain = path.with_suffix("") if path.suffix == ".gz" else path
    nibabel.save(image, str(plain))
    raw = bytearray(plain.read_bytes())  # codes and pixdim are patched: nibabel would write its own
    raw[252:256] = np.array(codes, "<i2").tobytes()
    if pixdim is not None:
        raw[80:92] = np.array(pixdim, "<f4").tobytes()
    path.write_bytes(gzip.compress(raw) if path.suffix == ".gz" else raw)
    return nibabel.load(str(path)).affine


def affine_of(image):
    """covol's geometry as an affine from voxels to RAS."""
    matrix = np.eye(4)
    matrix[:3, :3] = LPS @ (np.asarray(image["direction"]) * np.asarray(image["spacing"]))
    matrix[:3, 3] = LPS @ np.asarray(image["origin"])
    return matrix


@unittest.skipIf(MISSING, MISSING)
class Nifti(Case):
    PLAIN = ((-1, 0, 0), (0, -1, 0), (0, 0, 1.5))

    def test_the_rule_is_nibabels(self):
        s, q = affine(self.PLAIN, (5, 6, 7)), affine(((0, 1, 0), (1, 0, 0), (0, 0, 1.5)), (-3, 2, 1))
        for codes in ((1, 1), (1, 2), (0, 3), (2, 0), (4, 1), (0, 0)):
            for name in ("a.nii", "a.nii.gz"):
                with self.subTest(codes=codes, name=name):
                    right = nifti(self.folder / name, s, q, codes)
                    image = self.info(name)
                    np.testing.assert_allclose(affine_of(image), right, atol=1e-5)
                    used = "sform" if codes[1] else "qform" if codes[0] else "pixdim"
                    self.assertIn(used, image["fields"]["place of the voxels"])

    def test_forms_that_differ_are_reported(self):
        s = affine(self.PLAIN, (5, 6, 7))
        for shift, loud in ((0.2, False), (0.6, True), (40, True)):
            with self.subTest(shift=shift):
                nifti(self.folder / "a.nii", s, affine(self.PLAIN, (5 + shift, 6, 7)), (1, 1))
                done = self.run_covol("info", "a.nii")
                self.assertIn(f"apart by up to {shift:g} mm", done.stdout)
                self.assertEqual("its qform and sform place the same voxel" in done.stderr, loud, done.stderr)

    def test_rows_of_length_one_beside_another_pixdim(self):
        right = nifti(self.folder / "a.nii", affine(np.eye(3), (-30, -20, -10)), codes=(0, 2), pixdim=(0.8, 0.8, 1.2))
        done = self.run_covol("info", "a.nii")
        self.assertIn("pixdim states a spacing of 0.8 x 0.8 x 1.2, the sform one of 1 x 1 x 1", done.stderr)
        np.testing.assert_allclose(affine_of(self.info("a.nii")), right, atol=1e-6)

    def test_a_sform_that_is_none(self):
        zero = np.zeros((4, 4))
        nifti(self.folder / "a.nii", None, affine(self.PLAIN, (5, 6, 7)), (1, 1))
        raw = bytearray((self.folder / "a.nii").read_bytes())
        raw[280:328] = bytes(48)
        (self.folder / "a.nii").write_bytes(raw)
        self.assertIn("the qform is used", self.run_covol("info", "a.nii").stderr)
        raw[252:254] = bytes(2)
        (self.folder / "a.nii").write_bytes(raw)
        self.assertIn("srow_x", self.refused("info", "a.nii"))
        self.assertFalse(zero.any())

    def test_sheared_lattices_and_masks_on_them(self):
        for name, steps in (("much", ((1, 0, 0), (0.2, 1, 0), (0.1, -0.3, 1.5))),
                            ("slightly", ((1, 0, 0), (0.004, 1, 0), (0, 0, 1.5))),
                            ("mirrored", ((-1, 0.1, 0), (0, 1, 0.2), (0.3, 0, 1.25)))):
            with self.subTest(name):
                right = nifti(self.folder / "a.nii.gz", affine(steps, (-12, 20, 5)), codes=(0, 2))
                np.testing.assert_allclose(affine_of(self.info("a.nii.gz")), right, atol=1e-5)
                data = np.asarray(nibabel.load(str(self.folder / "a.nii.gz")).dataobj)
                world = on_body() @ right[:3, :3].T + right[:3, 3]
                np.savetxt(self.folder / "marks.xyz", world @ LPS)
                for end in (".nii.gz", ".nrrd"):
                    self.run_covol("segment", "a.nii.gz", "--points", "marks.xyz", "--mask", "mask" + end, "-o", "s.vdb", "--quiet")
                    np.testing.assert_allclose(affine_of(self.info("mask" + end)), right, atol=1e-4)
                mask = nibabel.load(str(self.folder / "mask.nii.gz"))
                np.testing.assert_allclose(mask.affine, right, atol=1e-5)
                found, truth = np.asarray(mask.dataobj) > 0, data > 120
                self.assertGreater(2 * (found & truth).sum() / (found.sum() + truth.sum()), 0.9)

    def test_axes_in_a_plane_are_refused(self):
        nifti(self.folder / "a.nii", affine(((1, 0, 0), (0, 1, 0), (1, 1, 0.01)), (0, 0, 0)), codes=(0, 2))
        message = self.refused("info", "a.nii")
        self.assertIn("expected axes that span the space", message)
        self.assertIn("resample", message)

    def test_rescaled_values(self):
        image = nibabel.Nifti1Image(body().transpose(2, 1, 0).astype(np.int16), affine(np.eye(3), (0, 0, 0)))
        image.header.set_slope_inter(0.5, 3)
        nibabel.save(image, str(self.folder / "a.nii"))
        raw = bytearray((self.folder / "a.nii").read_bytes())
        raw[112:120] = np.array([0.5, 3], "<f4").tobytes()
        (self.folder / "a.nii").write_bytes(raw)
        values = nibabel.load(str(self.folder / "a.nii")).get_fdata()
        self.assertEqual(self.info("a.nii")["range"], [values.min(), values.max()])


@unittest.skipIf(MISSING, MISSING)
class Nrrd(Case):
    def write(self, name="a.nrrd", **fields):
        lines = ["NRRD0005", "type: uint8", "dimension: 3", "sizes: %d %d %d" % SIZE, "encoding: raw"]
        lines += [f"{key.replace('_', ' ')}: {value}" for key, value in fields.items()]
        (self.folder / name).write_bytes("\n".join(lines).encode() + b"\n\n" + body().tobytes())
        return self.info(name)

    def test_spaces_of_all_handedness(self):
        columns = np.array(TURNED) * (1, 1, 1.5)
        steps = " ".join("(" + ",".join(map(repr, column)) + ")" for column in columns.T.tolist())
        for space, signs in (("left-anterior-superior", (1, -1, 1)), ("LAS", (1, -1, 1)),
                             ("right-anterior-superior", (-1, -1, 1)), ("RAS", (-1, -1, 1)),
                             ("left-posterior-superior", (1, 1, 1)), ("LPS", (1, 1, 1))):
            with self.subTest(space):
                image = self.write(space=space, space_directions=steps, space_origin="(5,6,7)")
                np.testing.assert_allclose(np.asarray(image["direction"]) * image["spacing"],
                                           np.diag(signs) @ columns, atol=1e-9)
                np.testing.assert_allclose(image["origin"], np.array((5, 6, 7)) * signs)

    def test_units_that_differ(self):
        for fields, spacing in (
                ({"space_directions": "(1000,0,0) (0,1,0) (0,0,0.0015)", "space_units": '"nm" "um" "mm"'}, [1000, 1000, 1500]),
                ({"space_directions": "(1,0,0) (0,1,0) (0,0,0.0015)", "space_units": '"um" "um" "mm"'}, [1, 1, 1.5]),
                ({"space_directions": "(0,0.0015,0) (0,0,1) (1,0,0)", "space_units": '"um" "mm" "um"'}, [1.5, 1, 1])):
            with self.subTest(**fields):
                image = self.write(space="LPS", space_origin="(0,0,0)", **fields)
                np.testing.assert_allclose(image["spacing"], spacing)
        image = self.write(spacings="1 1 0.0015", units='"um" "um" "mm"')
        np.testing.assert_allclose(image["spacing"], [1, 1, 1.5])
        self.assertEqual(image["unit"], "um")

    def test_an_unknown_unit_is_loud(self):
        image = self.write(space="LPS", space_directions="(1,0,0) (0,1,0) (0,0,1.5)", space_origin="(0,0,0)",
                           space_units='"um" "um" "spam"')
        self.assertEqual(image["spacing_known"], [True, True, False])
        self.assertIn("got 'spam' for axis 3", self.run_covol("info", "a.nrrd").stderr)

    def test_sheared(self):
        steps = np.array([[1, 0.2, 0.1], [0, 1, -0.3], [0, 0, 1.5]])
        text = " ".join("(" + ",".join(map(repr, column)) + ")" for column in steps.T.tolist())
        image = self.write(space="LPS", space_directions=text, space_origin="(1,2,3)")
        np.testing.assert_allclose(np.asarray(image["direction"]) * image["spacing"], steps, atol=1e-9)


@unittest.skipIf(MISSING, MISSING)
class Tiff(Case):
    def write(self, name, data=None, **more):
        tifffile.imwrite(str(self.folder / name), body() if data is None else data, **more)
        return self.info(name)

    def test_negative_spacing(self):
        for spacing in (-1.5, 1.5):
            image = self.write("a.tif", imagej=True, resolution=(2, 2), metadata={"spacing": spacing, "unit": "um", "axes": "ZYX"})
            self.assertEqual(image["spacing"], [0.5, 0.5, 1.5])
        image = self.write("b.tif", metadata={"spacing": -2.0, "unit": "um", "axes": "ZYX"})
        self.assertEqual(image["spacing"][2], 2)

    def ome(self, units, sizes=(1000, 1, 1.5e-5), axes="ZYX", data=None):
        metadata = {"axes": axes}
        for axis, size, unit in zip("XYZ", sizes, units):
            metadata[f"PhysicalSize{axis}"], metadata[f"PhysicalSize{axis}Unit"] = size, unit
        return self.write("a.ome.tif", data, ome=True, metadata=metadata)

    def test_units_of_the_ome_schema(self):
        image = self.ome(("nm", "\xb5m", "dm"))
        self.assertEqual((image["spacing"], image["unit"]), ([1, 1, 1.5], "um"))
        for unit, um in (("pm", 1e-6), ("\xc5", 1e-4), ("mm", 1e3), ("cm", 1e4), ("dm", 1e5), ("thou", 25.4), ("in", 25400),
                         ("pt", 25400 / 72), ("ft", 304800), ("li", 25400 / 12)):
            with self.subTest(unit):
                image = self.ome(("\xb5m", unit, "\xb5m"), (2, 3, 4))
                np.testing.assert_allclose(image["spacing"], [2, 3 * um, 4], rtol=1e-10)
                self.assertEqual(image["unit"], "um")
        self.assertEqual(self.ome(("mm",) * 3, (1, 2, 3))["unit"], "mm")
        self.assertEqual(self.ome(("dam",) * 3, (1e-6, 2e-6, 3e-6))["spacing"], [10, 20, 30])

    def test_units_that_the_schema_does_not_know(self):
        image = self.ome(("\xb5m", "\xb5m", "furlong"))
        self.assertEqual(image["spacing_known"], [True, True, False])
        errors = self.run_covol("info", "a.ome.tif").stderr
        self.assertIn("expected a unit of the OME schema, got 'furlong'", errors)
        self.assertEqual(self.ome(("reference frame",) * 3, (1, 2, 3))["spacing"], [1, 2, 3])

    def test_slices_that_were_saved_as_something_else(self):
        data = body()
        for name, axes, more in (("c.tif", "CYX", {"imagej": True}), ("t.tif", "TYX", {"imagej": True}),
                                 ("t.ome.tif", "TYX", {"ome": True}), ("c.ome.tif", "CYX", {"ome": True})):
            with self.subTest(name):
                tifffile.imwrite(str(self.folder / name), data, metadata={"axes": axes}, **more)
                message = self.refused("info", name)
                self.assertIn(f"{SIZE[2]} {'channels' if axes[0] == 'C' else 'time points'}", message)
                self.assertIn(f"{name}:ZYX", message)
                image = self.info(f"{name}:ZYX", "--spacing", "1,1,1")
                self.assertEqual((image["size"], image["channels"], image["frames"]), (list(SIZE), 1, 1))
                np.testing.assert_array_equal(self.voxels(f"{name}:zyx", "--spacing", "1,1,1"), data)

    def test_slices_saved_as_time_beside_channels(self):
        data = np.stack([body(), body() // 2], 1)
        tifffile.imwrite(str(self.folder / "tc.ome.tif"), data, ome=True, metadata={"axes": "TCYX"})
        self.assertIn("tc.ome.tif:ZCYX", self.refused("info", "tc.ome.tif"))
        np.testing.assert_array_equal(self.voxels("tc.ome.tif:ZCYX", "--spacing", "1,1,1", "--channel", 1), data[:, 1])
        self.assertIn("expected ZYX", self.refused("info", "tc.ome.tif:ZTCYX"))
        self.assertIn("expected ZYX", self.refused("info", "tc.ome.tif:nonsense"))

    def test_a_run_on_renamed_axes(self):
        data = body()
        tifffile.imwrite(str(self.folder / "t.tif"), data, imagej=True, metadata={"axes": "TYX"})
        np.savetxt(self.folder / "marks.xyz", on_body())
        self.run_covol("segment", "t.tif:ZYX", "--spacing", "1,1,1", "--points", "marks.xyz", "-o", "s.vdb", "--mask", "m.nrrd", "--quiet")
        self.assertEqual(self.info("m.nrrd")["size"], list(SIZE))


@unittest.skipIf(MISSING, MISSING)
class Imaris(Case):
    def write(self, whole=None, own=None, level=None):
        """An array padded to whole chunks of 16."""
        data = np.zeros((16, 16, 16), np.uint8)
        data[:SIZE[2], :SIZE[1], :SIZE[0]] = body()
        text = lambda value: np.array([c.encode() for c in str(value)], "S1")  # noqa: E731
        with h5py.File(self.folder / "a.ims", "w") as file:
            info = file.create_group("DataSetInfo/Image")
            for a in range(3):
                info.attrs[f"ExtMin{a}"], info.attrs[f"ExtMax{a}"] = text(-0.5), text(SIZE[a] - 0.5)
                if whole:
                    info.attrs["XYZ"[a]] = text(whole[a])
            info.attrs["Unit"] = text("um")
            for n in range(2 if level else 1):
                group = file.create_group(f"DataSet/ResolutionLevel {n}/TimePoint 0/Channel 0")
                group.create_dataset("Data", data=data[::1 + n, ::1 + n, ::1 + n], chunks=(8, 8, 8))
                for a in range(3 if own else 0):
                    group.attrs[f"ImageSize{'XYZ'[a]}"] = text(own[a])
        return self.info("a.ims")

    def test_the_size_of_the_image_where_the_channel_has_none(self):
        image = self.write(whole=SIZE)
        self.assertEqual((image["size"], image["spacing"]), (list(SIZE), [1, 1, 1]))
        self.assertEqual(image["fields"]["size"], "DataSetInfo/Image X, Y, Z")
        np.testing.assert_array_equal(self.voxels("a.ims"), body())

    def test_the_channels_size_goes_first(self):
        image = self.write(whole=(16, 16, 16), own=SIZE)
        self.assertEqual((image["size"], image["spacing"]), (list(SIZE), [1, 1, 1]))

    def test_a_coarse_level(self):
        self.write(whole=SIZE, level=True)
        image = self.info("a.ims:/DataSet/ResolutionLevel 1")
        self.assertEqual((image["size"], image["spacing"]), ([n // 2 for n in SIZE], [2, 2, 2]))

    def test_a_size_that_cannot_be_is_loud(self):
        self.assertEqual(self.write()["fields"]["size"], "not stated, the array's")
        self.assertEqual(self.write(whole=(40, 40, 40))["spacing_known"], [False] * 3)


if __name__ == "__main__":
    unittest.main()
