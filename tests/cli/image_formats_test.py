"""One structure in every image format: the same surface in world space.

    COVOL=build/bin/covol python3 -m unittest tests/cli/image_formats_test.py
"""
import gzip
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import unittest
import zlib

from covol_case import COVOL
from image_formats_case import (CENTRE, ORIGIN, RADII, SIZE, SPACING, Case, nibabel, np, nrrd_header, ome_xml, pydicom, pyopenvdb, tifffile,
                                write_dicom_series, write_ics, write_mrc)


class SameSurface(Case):
    """Compares every format with a raw NRRD."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        self = cls()
        nrrd = self.write_nrrd()
        cls.reference = self.surface(nrrd).rename(cls.folder / "reference.vdb")
        self.assert_ellipsoid(cls.reference)
        at_zero = cls.folder / "zero.nrrd"
        at_zero.write_bytes(nrrd.read_bytes().replace(b"origin: (%r,%r,%r)" % ORIGIN, b"origin: (0,0,0)"))
        cls.shifted = self.surface(at_zero, points=cls.shifted_marks).rename(cls.folder / "reference0.vdb")

    def assert_ellipsoid(self, path):
        """The reference itself is correct: the marks lie on its surface."""
        fit = self.report("compare", self.world_marks, path)["fit"]["points_to_surface"]
        self.assertLess(fit["mean"], 0.5 * SPACING[0])

    def check(self, image, *options, origin=True, unit=None):
        info = self.report("info", image, *options)["image"]
        self.assertEqual(tuple(info["size"]), SIZE)
        for a in range(3):
            self.assertAlmostEqual(info["spacing"][a], SPACING[a], places=5)
            self.assertAlmostEqual(info["origin"][a], ORIGIN[a] if origin else 0, places=4)
        self.assertEqual(info["spacing_known"], [True] * 3)
        if unit is not None:
            self.assertEqual(info["unit"], unit)
        points = self.world_marks if origin else self.shifted_marks
        compare = self.report("compare", self.reference if origin else self.shifted,
                              self.surface(image, *options, points=points))["compare"]
        self.assertGreater(compare["dice"], 0.9999)
        self.assertLess(compare["hausdorff"], 1e-3 * SPACING[0])
        return info

    def test_nrrd(self):
        raw = self.data.tobytes()
        (self.folder / "packed.nrrd").write_bytes(nrrd_header(encoding="gzip").encode() + b"\n" + gzip.compress(raw))
        self.check("packed.nrrd", unit="um")
        (self.folder / "pixels.raw").write_bytes(raw)
        (self.folder / "detached.nhdr").write_text(nrrd_header(data_file="pixels.raw"))
        self.check("detached.nhdr", unit="um")
        (self.folder / "Pixels.raw.gz").write_bytes(gzip.compress(raw))
        (self.folder / "packed.nhdr").write_text(nrrd_header(encoding="gz", data_file="./Pixels.raw.gz"))
        self.check("packed.nhdr", unit="um")
        ras = nrrd_header().replace("left-posterior-superior", "right-anterior-superior")
        ras = ras.replace("(0.5,0,0) (0,0.625,0)", "(-0.5,0,0) (0,-0.625,0)").replace("(10.0,-20.0,5.5)", "(-10,20,5.5)")
        (self.folder / "ras.nrrd").write_bytes(ras.encode() + b"\n" + raw)
        self.check("ras.nrrd", unit="um")

    def test_metaimage(self):
        header = ("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n{}"
                  "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = %r %r %r\nElementSpacing = %r %r %r\n"
                  "DimSize = %d %d %d\nElementType = MET_UCHAR\nElementDataFile = {}\n" % (*ORIGIN, *SPACING, *SIZE))
        raw = self.data.tobytes()
        (self.folder / "one.mha").write_bytes(header.format("", "LOCAL").encode() + raw)
        self.check("one.mha")
        packed = zlib.compress(raw)
        (self.folder / "two.zraw").write_bytes(packed)
        (self.folder / "two.mhd").write_text(
            header.format(f"CompressedData = True\nCompressedDataSize = {len(packed)}\n", "two.zraw"))
        self.check("two.mhd")

    def test_nifti(self):
        ras = np.diag([-SPACING[0], -SPACING[1], SPACING[2], 1.0])
        ras[:3, 3] = (-ORIGIN[0], -ORIGIN[1], ORIGIN[2])
        nibabel.save(nibabel.Nifti2Image(self.data.transpose(2, 1, 0), ras), str(self.folder / "two.nii"))
        self.assertIn("NIfTI-2", self.run_covol("info", "two.nii", code=3).stderr)
        for name, forms in [("s.nii", "s"), ("q.nii.gz", "q")]:
            with self.subTest(name):
                image = nibabel.Nifti1Image(self.data.transpose(2, 1, 0), ras)
                image.header.set_xyzt_units("mm")
                image.set_sform(ras, code=1 if forms == "s" else 0)
                image.set_qform(ras, code=1 if forms == "q" else 0)
                nibabel.save(image, str(self.folder / name))
                self.check(name, unit="mm")

    def test_nifti_with_flipped_and_swapped_axes(self):
        ras = np.zeros((4, 4))
        ras[3, 3] = 1
        # In the file, z varies fastest and y runs backwards; the affine `ras` describes this.
        stored = self.data[:, ::-1, :].transpose(0, 1, 2)
        lps = np.zeros((3, 4))
        lps[2, 0] = SPACING[2]
        lps[1, 1] = -SPACING[1]
        lps[0, 2] = SPACING[0]
        lps[:, 3] = (ORIGIN[0], ORIGIN[1] + SPACING[1] * (SIZE[1] - 1), ORIGIN[2])
        ras[:3] = np.diag([-1, -1, 1]) @ lps
        image = nibabel.Nifti1Image(stored, ras)
        image.header.set_xyzt_units("mm")
        nibabel.save(image, str(self.folder / "swapped.nii"))
        compare = self.report("compare", self.reference, self.surface("swapped.nii"))["compare"]
        self.assertGreater(compare["dice"], 0.9999)

    def test_nifti_in_micrometres(self):
        """In the file's own unit, in each of the forms that a file may have."""
        scaled = np.diag([-SPACING[0] * 1000, -SPACING[1] * 1000, SPACING[2] * 1000, 1.0])
        scaled[:3, 3] = (-ORIGIN[0] * 1000, -ORIGIN[1] * 1000, ORIGIN[2] * 1000)
        for forms in "sq":
            with self.subTest(forms):
                image = nibabel.Nifti1Image(self.data.transpose(2, 1, 0), scaled)
                image.header.set_xyzt_units("micron")
                image.set_sform(scaled, code=1 if forms == "s" else 0)
                image.set_qform(scaled, code=1 if forms == "q" else 0)
                nibabel.save(image, str(self.folder / "um.nii"))
                info = self.report("info", "um.nii")["image"]
                self.assertEqual(info["unit"], "um")
                for a in range(3):
                    self.assertAlmostEqual(info["spacing"][a], 1000 * SPACING[a], places=3)
                    self.assertAlmostEqual(info["origin"][a], 1000 * ORIGIN[a], places=2)

    def test_mrc(self):
        for name, mode, kind, big in [("b.mrc", 0, "i1", False), ("i.mrc", 1, "i2", True), ("f.map", 2, "f4", False),
                                      ("u.mrc", 6, "u2", True), ("h.mrc", 12, "f2", False)]:
            with self.subTest(name):
                data = self.data.astype(np.int16)
                if kind == "i1":
                    data = data - 128
                write_mrc(self.folder / name, data.astype(kind), mode, big)
                self.check(name, unit="angstrom")

    def test_mrc_start_instead_of_origin(self):
        start = [round(o / s) for o, s in zip(ORIGIN, SPACING)]
        write_mrc(self.folder / "start.mrc", self.data.astype("f4"), 2, origin=(0, 0, 0), start=start)
        info = self.report("info", "start.mrc")["image"]
        for a in range(3):
            self.assertAlmostEqual(info["origin"][a], start[a] * SPACING[a])

    def test_ics(self):
        for name, kind, more in (("two.ics", "u1", {}), ("one.ics", "u2", {"version": "1.0"}), ("big.ics", "i2", {"big": True}),
                                 ("real.ics", "f4", {}), ("packed.ics", "u1", {"compression": "gzip"})):
            with self.subTest(name):
                write_ics(self.folder / name, self.data.astype(kind), **more)
                self.check(name, unit="um")

    def test_dicom_series(self):
        folder = write_dicom_series(self.folder / "series", self.data)
        self.check(folder, unit="mm")
        self.check(sorted(folder.iterdir())[3], unit="mm")

    def test_vdb_grid(self):
        grid = pyopenvdb.FloatGrid()
        grid.copyFromArray(self.data.transpose(2, 1, 0).astype(np.float32), tolerance=-1)
        matrix = np.diag([*SPACING, 1.0])
        matrix[3, :3] = ORIGIN  # translation in the last row: OpenVDB multiplies row vectors by the matrix
        grid.transform = pyopenvdb.createLinearTransform(matrix.tolist())
        grid.name = "density"
        other = pyopenvdb.BoolGrid()
        other.name = "flags"
        pyopenvdb.write(str(self.folder / "grids.vdb"), [other, grid])
        self.check("grids.vdb:density")
        self.assertIn("density", self.run_covol("segment", "grids.vdb:nothing", "--points", self.world_marks, "-o", "x.vdb",
                                                code=3).stderr)

    def test_imagej_tiff(self):
        for name, more in [("plain.tif", {}), ("lzw.tif", {"compression": "lzw"}), ("one.tif", {"contiguous": True, "truncate": True})]:
            with self.subTest(name):
                if name == "lzw.tif":
                    try:
                        tifffile.imwrite(str(self.folder / "try.tif"), self.data[:2], compression="lzw")
                    except Exception:  # LZW requires imagecodecs, which Debian does not package
                        continue
                tifffile.imwrite(str(self.folder / name), self.data, imagej=True,
                                 resolution=(1 / SPACING[0], 1 / SPACING[1]),
                                 metadata={"axes": "ZYX", "spacing": SPACING[2], "unit": "um"}, **more)
                self.check(name, origin=False, unit="um")
        with tifffile.TiffFile(str(self.folder / "one.tif")) as one:
            self.assertEqual(len(list(one.pages.pages)), 1)  # one page, as in ImageJ stacks above 4 GB

    def test_imagej_origin(self):
        text = ("ImageJ=1.53t\nimages=%d\nslices=%d\nunit=um\nspacing=%r\nxorigin=%r\nyorigin=%r\nzorigin=%r\n"
                % (SIZE[2], SIZE[2], SPACING[2], *(-o / s for o, s in zip(ORIGIN, SPACING))))
        with tifffile.TiffWriter(str(self.folder / "origin.tif")) as tiff:
            for k in range(SIZE[2]):
                tiff.write(self.data[k], contiguous=False, metadata=None, description=text if k == 0 else None,
                           resolution=(1 / SPACING[0], 1 / SPACING[1]))
        self.check("origin.tif", unit="um")
        # A mask that covol writes as TIFF has the origin of the image, as the NRRD file has.
        self.run_covol("mask", self.reference, "--like", "ball.nrrd", "-o", "m.tif")
        self.run_covol("mask", self.reference, "--like", "ball.nrrd", "-o", "m.nrrd")
        self.assertEqual(self.report("compare", "m.tif", "m.nrrd")["compare"]["dice"], 1)

    def test_hyperstack(self):
        stack = np.zeros((3, SIZE[2], 2, SIZE[1], SIZE[0]), np.uint8)  # axes t, z, c, y, x
        stack[1, :, 1] = self.data
        tifffile.imwrite(str(self.folder / "hyper.tif"), stack, imagej=True, resolution=(1 / SPACING[0], 1 / SPACING[1]),
                         metadata={"axes": "TZCYX", "spacing": SPACING[2], "unit": "um"})
        info = self.check("hyper.tif", "--channel", 1, "--frame", 1, origin=False, unit="um")
        self.assertEqual((info["channels"], info["frames"], info["axis_order"]), (2, 3, "XYCZT"))
        error = self.run_covol("segment", "hyper.tif", "--points", self.world_marks, "-o", "x.vdb", code=3).stderr
        self.assertIn("expected one channel, got 2; choose 0 to 1 with --channel", error)

    def test_ome_tiff(self):
        path = self.folder / "own.ome.tif"
        tifffile.imwrite(str(path), self.data, bigtiff=True, tile=(16, 16), compression="zlib", metadata={
            "axes": "ZYX", "PhysicalSizeX": SPACING[0], "PhysicalSizeXUnit": "\u00b5m", "PhysicalSizeY": SPACING[1],
            "PhysicalSizeYUnit": "\u00b5m", "PhysicalSizeZ": SPACING[2] * 1000, "PhysicalSizeZUnit": "nm"})
        self.check(path, origin=False, unit="um")

    def test_ome_tiff_channels(self):
        stack = np.stack([self.data, 0 * self.data])  # axes c, z, y, x, which OME calls DimensionOrder XYZCT
        path = self.folder / "two.ome.tif"
        tifffile.imwrite(str(path), stack, metadata={
            "axes": "CZYX", "Channel": {"Name": ["membrane", "nuclei"]}, "PhysicalSizeX": SPACING[0],
            "PhysicalSizeY": SPACING[1], "PhysicalSizeZ": SPACING[2]})
        info = self.check(path, "--channel", 0, origin=False, unit="um")
        self.assertEqual(info["channel_names"], ["membrane", "nuclei"])
        error = self.run_covol("segment", path, "--points", self.world_marks, "-o", "x.vdb", code=3).stderr
        self.assertIn("choose 0 (membrane), 1 (nuclei) with --channel", error)

    def test_ome_tiff_in_several_files(self):
        """Slices are distributed over two files, in reverse order in each; each file names all."""
        names = ["part0.ome.tif", "part1.ome.tif"]
        places = {k: (names[k % 2], (SIZE[2] - 1 - k) // 2) for k in range(SIZE[2])}
        xml = ome_xml([places[k] for k in range(SIZE[2])])
        for name in names:
            slices = sorted((ifd, k) for k, (where, ifd) in places.items() if where == name)
            with tifffile.TiffWriter(str(self.folder / name)) as tiff:
                for ifd, k in slices:
                    tiff.write(self.data[k], contiguous=False, metadata=None, description=xml if ifd == 0 else None)
        for name in names:
            self.check(name, origin=False, unit="um")
        (self.folder / names[1]).unlink()
        error = self.run_covol("segment", names[0], "--points", self.shifted_marks, "-o", "x.vdb", code=4).stderr
        self.assertIn(names[1], error)


class Options(Case):
    def test_roi_gives_the_surface_of_the_whole(self):
        """With any box, voxels are those of the whole domain, and automatic choices do not depend on it; the mask keeps the image's lattice."""
        image = self.write_nrrd()
        box = ",".join(str(CENTRE[a] + side * (RADII[a] + 2.3 + 0.1 * a)) for side in (-1, 1) for a in range(3))
        results = {}
        for name, more in (("whole", ()), ("part", ("--roi", box, "--mask", "part.nrrd"))):
            surface = self.surface(image, *more, "--json", f"{name}.json").rename(self.folder / f"{name}.vdb")
            results[name] = surface, json.loads((self.folder / f"{name}.json").read_text())
        (whole, of_whole), (part, of_part) = results["whole"], results["part"]
        self.assertEqual(of_whole["grid"]["domain"]["origin"], of_part["grid"]["domain"]["origin"])
        self.assertNotEqual(of_whole["grid"]["domain"]["max"], of_part["grid"]["domain"]["max"])
        chosen = 0
        for what in ("delta", "tau", "sigma", "edge_k", "attraction_range"):
            pair = of_part["resolved"][what], of_whole["resolved"][what]
            if pair != (None, None):  # None: neither job needed this option, so that no value was chosen
                self.assertAlmostEqual(pair[0] / pair[1], 1, 3, what)
                chosen += 1
        self.assertGreater(chosen, 2)
        compared = self.report("compare", whole, part)["compare"]
        self.assertGreater(compared["dice"], 0.9999)
        self.assertLess(compared["hausdorff"], 0.05 * SPACING[0])
        self.assertEqual(self.report("info", "part.nrrd")["image"]["size"], list(SIZE))

    def test_roi_crops_elsewhere(self):
        image = self.write_nrrd()
        info = self.report("info", image)["image"]
        self.run_covol("convert", image, "whole.vdb")
        self.run_covol("convert", image, "part.vdb", "--roi", "14,-14,10,18,-11,14")
        size = {name: self.report("info", name)["grids"][0] for name in ("whole.vdb", "part.vdb")}
        self.assertLess(size["part.vdb"]["active_voxels"], size["whole.vdb"]["active_voxels"] / 4)
        part = self.report("info", image, "--roi", "15.5,-13,11.9,16.5,-12,12.1")["image"]
        self.assertGreater(part["range"][0], 100)  # minimum value in the box, which lies within the bright ellipsoid
        self.assertEqual(info["range"][0], 30)
        error = self.run_covol("info", image, "--roi", "0,0,0,1,1,1", code=3).stderr
        self.assertIn("outside the image", error)

    def test_missing_spacing_is_loud_everywhere(self):
        tifffile.imwrite(str(self.folder / "bare.tif"), self.data)
        tifffile.imwrite(str(self.folder / "labels.tif"), (self.data > 100).astype(np.uint8),
                         metadata={"axes": "ZYX", "spacing": SPACING[2], "unit": "um"})
        self.run_covol("segment", "bare.tif", "--init", "sphere:12,12,7,4", "--theta", 0, "-o", "s.vdb", "--max-steps", 1)
        for args in (["info", "bare.tif"], ["mask", "s.vdb", "--like", "bare.tif", "-o", "m.nrrd"],
                     ["check", "bare.tif"], ["convert", "bare.tif", "b.vdb"],
                     ["segment", "bare.tif", "--init", "sphere:12,12,7,4", "--theta", 0, "-o", "s.vdb", "--max-steps", 1]):
            with self.subTest(args[0]):
                errors = self.run_covol(*args, "--quiet").stderr
                self.assertIn("states no spacing along x, y, z", errors)
                self.assertIn("--spacing sx,sy,sz", errors)
                self.assertEqual(errors.count("states no spacing"), 1, errors)
                self.assertNotIn("states no spacing", self.run_covol(*args, "--spacing", "1,1,2").stderr)
        errors = self.run_covol("compare", "labels.tif", "m.nrrd", "--quiet").stderr
        self.assertIn("labels.tif: the file states no spacing along x, y:", errors)

    def test_several_series_are_listed(self):
        folder = write_dicom_series(self.folder / "two", self.data, "1.2.3.4.6", "bone")
        write_dicom_series(folder, self.data[:5], "1.2.3.4.7", "scout")
        error = self.run_covol("info", folder, code=3).stderr
        for part in ("got 2", "14 slices of CT bone", "5 slices of CT scout"):
            self.assertIn(part, error)
        self.assertEqual(self.report("info", folder / "1.2.3.4.7-000.dcm")["image"]["size"][2], 5)

    def test_a_missing_slice_is_an_error(self):
        folder = write_dicom_series(self.folder / "gap", self.data)
        next(p for p in folder.iterdir() if pydicom.dcmread(str(p)).ImagePositionPatient[2] == ORIGIN[2] + 6 * SPACING[2]).unlink()
        self.assertIn("a slice is missing", self.run_covol("info", folder, code=3).stderr)

    def test_a_displaced_slice_is_an_error(self):
        folder = write_dicom_series(self.folder / "displaced", self.data)
        for path in folder.iterdir():
            slice_ = pydicom.dcmread(str(path))
            if slice_.ImagePositionPatient[2] == ORIGIN[2] + 6 * SPACING[2]:
                slice_.ImagePositionPatient[2] += 0.3 * SPACING[2]
                slice_.save_as(str(path))
        error = self.run_covol("info", folder, code=3).stderr
        self.assertIn("resample the image to equal distances", error)
        self.assertNotIn("missing", error)

    def test_a_missing_module_is_an_error(self):
        """libcovol alone, without the folder of modules next to it."""
        loaded = subprocess.run(["ldd", COVOL], capture_output=True, text=True, check=True).stdout
        library = re.search(r"(libcovol\.so\S*) => (\S+)", loaded)
        if not library:
            self.skipTest("a static covol has no modules")
        alone = self.folder / "alone"
        alone.mkdir()
        shutil.copy(library.group(2), alone / library.group(1))
        series = write_dicom_series(self.folder / "packed", self.data)
        for path in series.iterdir():
            slice_ = pydicom.dcmread(path)
            slice_.compress(pydicom.uid.RLELossless)
            slice_.save_as(path)
        self.run_covol("info", series)
        (self.folder / "any.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
        images = ((self.write_nrrd(), "itk.so", "NRRD and MetaImage"), (self.folder / "any.h5", "hdf5.so", "HDF5"),
                  (series, "gdcm.so", "compressed DICOM"))

        def expect(message):
            for image, module, formats in images:
                with self.subTest(module):
                    done = subprocess.run([COVOL, "info", image], capture_output=True, text=True, timeout=300,
                                          env={**os.environ, "LD_LIBRARY_PATH": str(alone)})
                    self.assertEqual(done.returncode, 4, done.stdout + done.stderr)
                    self.assertRegex(done.stderr, message.format(module=module, formats=formats))
                    self.assertIn("install covol again", done.stderr)

        expect("alone/covol-[0-9.]+/covol-reader: covol's reader, the process that decodes files, could not be started")
        # The folder `alone` now has the reader program, but none of its modules.
        (folder,) = pathlib.Path(library.group(2)).resolve().parent.glob("covol-*")
        (alone / folder.name).mkdir()
        shutil.copy(folder / "covol-reader", alone / folder.name)
        expect("alone/covol-[0-9.]+/{module}: covol's module for {formats} could not be loaded")

    def test_a_huge_image_takes_little_memory(self):
        """A sparse file of 2048^3 bytes with a small ball in it; read as a whole and with --roi."""
        n, centre, radius = 2048, 1000, 12
        header = (f"NRRD0005\ntype: uint8\ndimension: 3\nsizes: {n} {n} {n}\nspacings: 1 1 1\nendian: little\n"
                  "encoding: raw\n\n").encode()
        path = self.folder / "huge.nrrd"
        with open(path, "wb") as file:
            file.write(header)
            for k in range(centre - 20, centre + 20):
                for j in range(centre - 20, centre + 20):
                    i = np.arange(centre - 20, centre + 20)
                    r = np.sqrt((i - centre) ** 2 + (j - centre) ** 2 + (k - centre) ** 2)
                    file.seek(len(header) + (k * n + j) * n + centre - 20)
                    file.write((100 * np.clip(radius - r + 0.5, 0, 1)).astype(np.uint8).tobytes())
            file.truncate(len(header) + n ** 3)
        init = ["--init", f"sphere:{centre},{centre},{centre},{radius + 2}", "--theta", "0", "--max-steps", "20"]
        box = ",".join(str(centre + s * 30) for s in (-1, -1, -1, 1, 1, 1))
        reports = {}
        for name, more in (("whole", []), ("roi", ["--roi", box])):
            with self.subTest(name):
                reports[name] = self.report("segment", path, "-o", "huge.vdb", *init, *more)
                self.assertLess(reports[name]["peak_rss_bytes"], 1 << 30)
        volume = reports["roi"]["surface"]["volume"]
        self.assertAlmostEqual(volume / (4 / 3 * math.pi * radius ** 3), 1, delta=0.1)


if __name__ == "__main__":
    unittest.main()
