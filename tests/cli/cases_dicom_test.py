"""DICOM files that state the positions of their planes in unusual places.

    COVOL=build/bin/covol python3 -m unittest tests/cli/cases_dicom_test.py
"""
import unittest

from cases_case import SIZE, Case, body

try:
    import numpy as np
    import pydicom
    import pydicom.uid
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.sequence import Sequence
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

CT, ENHANCED_CT, ENHANCED_MR = ("1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.2.1",
                                "1.2.840.10008.5.1.4.1.1.4.1")
ULTRASOUND, ENHANCED_VOLUME = "1.2.840.10008.5.1.4.1.1.3.1", "1.2.840.10008.5.1.4.1.1.6.2"
NUCLEAR, DOSE = "1.2.840.10008.5.1.4.1.1.20", "1.2.840.10008.5.1.4.1.1.481.2"


def item(**elements):
    made = Dataset()
    for name, value in elements.items():
        setattr(made, name, value)
    return made


def dicom(path, data, kind=CT, implicit=False, **elements):
    """One file that has all planes of `data` as its frames."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = kind, "1.2.3"
    meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian if implicit else pydicom.uid.ExplicitVRLittleEndian
    ds = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
    ds.is_little_endian, ds.is_implicit_VR = True, implicit
    ds.SOPClassUID, ds.SOPInstanceUID, ds.StudyInstanceUID, ds.SeriesInstanceUID = kind, "1.2.3", "1.2", "1.2.9"
    ds.Modality, ds.PatientName = "CT", "phantom"
    if data.ndim == 3:
        ds.NumberOfFrames = len(data)
    ds.Rows, ds.Columns = data.shape[-2:]
    ds.SamplesPerPixel, ds.PhotometricInterpretation, ds.PixelRepresentation = 1, "MONOCHROME2", 0
    ds.BitsAllocated = ds.BitsStored = 16
    ds.HighBit = 15
    ds.PixelData = data.astype("<u2").tobytes()
    for name, value in elements.items():
        setattr(ds, name, value)
    ds.save_as(str(path), write_like_original=False)
    return ds


def frame(k, spacing=1.0, **content):
    """The functional groups of a plane."""
    groups = item(PlanePositionSequence=Sequence([item(ImagePositionPatient=[3, -4, 5 + spacing * k])]))
    groups.FrameContentSequence = Sequence([item(**content)])
    return groups


def shared(**more):
    return Sequence([item(
        PixelMeasuresSequence=Sequence([item(PixelSpacing=[1, 1], SliceThickness=0.25, **more)]),
        PlaneOrientationSequence=Sequence([item(ImageOrientationPatient=[1, 0, 0, 0, 1, 0])]))])


@unittest.skipIf(MISSING, MISSING)
class Frames(Case):
    """Several frames in one file."""

    def setUp(self):
        super().setUp()
        self.data = body()
        self.path = self.folder / "frames.dcm"

    def enhanced(self, order, frames=None, data=None, kind=ENHANCED_CT, **more):
        frames = frames or [frame(k) for k in order]
        data = self.data[list(order)] if data is None else data
        return dicom(self.path, data, kind, SharedFunctionalGroupsSequence=shared(),
                     PerFrameFunctionalGroupsSequence=Sequence(frames), **more)

    def test_spacing_between_slices(self):
        for kind, more, spacing in (
                (CT, {"SpacingBetweenSlices": 1.5, "SliceThickness": 3, "ImagePositionPatient": [1, 2, 3],
                      "ImageOrientationPatient": [1, 0, 0, 0, 1, 0]}, 1.5),
                (ULTRASOUND, {"SpacingBetweenSlices": 0.75}, 0.75),
                (CT, {"SliceThickness": 2.5}, 2.5)):
            with self.subTest(kind=kind, spacing=spacing):
                dicom(self.path, self.data, kind, PixelSpacing=[0.5, 0.25], **more)
                image = self.info("frames.dcm")
                self.assertEqual(image["spacing"], [0.25, 0.5, spacing])
                self.assertEqual(image["spacing_known"], [True] * 3)
                used = "SliceThickness" if spacing == 2.5 else "SpacingBetweenSlices"
                self.assertTrue(any(name.startswith(used) for name in image["fields"]), image["fields"])

    def test_a_negative_spacing_turns_the_order(self):
        dicom(self.path, self.data, NUCLEAR, PixelSpacing=[1, 1], SpacingBetweenSlices=-1.0,
              DetectorInformationSequence=Sequence([item(ImagePositionPatient=[3, -4, 14],
                                                         ImageOrientationPatient=[1, 0, 0, 0, 1, 0])]))
        image = self.info("frames.dcm")
        self.assertEqual((image["spacing"], image["origin"]), ([1, 1, 1], [3, -4, 5]))
        np.testing.assert_array_equal(self.voxels("frames.dcm"), self.data[::-1])

    def test_nothing_known_is_loud(self):
        dicom(self.path, self.data, PixelSpacing=[1, 1])
        done = self.run_covol("info", "frames.dcm")
        self.assertIn("states no spacing along z", done.stderr)
        self.assertEqual(self.info("frames.dcm")["spacing_known"], [True, True, False])
        self.assertNotIn("states no spacing", self.run_covol("info", "frames.dcm", "--spacing", "1,1,2").stderr)

    def test_the_order_of_frames_is_that_of_their_positions(self):
        n = len(self.data)
        for name, order in (("ascending", range(n)), ("descending", range(n - 1, -1, -1)),
                            ("interleaved", [*range(0, n, 2), *range(1, n, 2)]),
                            ("any", np.random.default_rng(3).permutation(n))):
            for implicit in (False, True):
                with self.subTest(name, implicit=implicit):
                    self.enhanced(order, implicit=implicit)
                    image = self.info("frames.dcm")
                    self.assertEqual((image["spacing"], image["origin"]), ([1, 1, 1], [3, -4, 5]))
                    np.testing.assert_array_equal(self.voxels("frames.dcm"), self.data)

    def test_compressed_frames(self):
        order = [*range(0, 10, 2), *range(1, 10, 2)]
        ds = self.enhanced(order)
        ds.compress(pydicom.uid.RLELossless)
        ds.save_as(str(self.path), write_like_original=False)
        np.testing.assert_array_equal(self.voxels("frames.dcm"), self.data)

    def test_a_missing_frame_is_named(self):
        frames = [frame(k + (k >= 5)) for k in range(len(self.data))]
        self.enhanced(range(len(self.data)), frames)
        message = self.refused("info", "frames.dcm")
        self.assertIn("got a distance of 2 between frames.dcm, frame 5, and frames.dcm, frame 6, instead of 1", message)

    def test_each_frame_by_its_own_slope(self):
        frames = [frame(k) for k in range(len(self.data))]
        stored = np.empty(self.data.shape, np.uint16)
        for k, groups in enumerate(frames):
            slope, intercept = 0.5 + 0.25 * (k % 3), -8.0 * (k % 2)
            groups.PixelValueTransformationSequence = Sequence(
                [item(RescaleSlope=slope, RescaleIntercept=intercept, RescaleType="US")])
            stored[k] = np.round((self.data[k] - intercept) / slope)
        right = np.stack([plane * (0.5 + 0.25 * (k % 3)) - 8.0 * (k % 2) for k, plane in enumerate(stored)])
        for packed in (False, True):
            with self.subTest(packed=packed):
                ds = self.enhanced(range(len(frames)), frames, stored)
                if packed:
                    ds.compress(pydicom.uid.RLELossless)
                    ds.save_as(str(self.path), write_like_original=False)
                np.testing.assert_allclose(self.voxels("frames.dcm"), right, atol=1e-3)

    def test_times_echoes_and_stacks_are_frames(self):
        half, second = self.data, self.data // 2
        for name, content in (("time", [{"TemporalPositionIndex": t} for t in (1, 2)]),
                              ("echo", [{}, {}]), ("stack", [{"StackID": "A"}, {"StackID": "B"}]), ("no.", [{}, {}])):
            with self.subTest(name):
                frames, data = [], []
                for k in range(len(self.data)):
                    for t in (0, 1):
                        groups = frame(k, **content[t])
                        if name == "echo":
                            groups.MREchoSequence = Sequence([item(EffectiveEchoTime=2.5 + 2 * t)])
                        frames.append(groups)
                        data.append((half, second)[t][k])
                self.enhanced([], frames, np.stack(data), kind=ENHANCED_MR)
                image = self.info("frames.dcm")
                self.assertEqual((image["frames"], image["size"], image["spacing"]), (2, list(SIZE), [1, 1, 1]))
                self.assertIn(name, image["fields"]["frame 1"])
                self.assertIn("expected one frame, got 2", self.refused("convert", "frames.dcm", "v.vdb"))
                np.testing.assert_array_equal(self.voxels("frames.dcm", "--frame", 1), second)
                np.testing.assert_array_equal(self.voxels("frames.dcm", "--frame", 0), half)

    def test_stacks_of_two_orientations(self):
        frames = [frame(k, StackID="1") for k in range(10)] + [frame(2 * k, StackID="2") for k in range(10)]
        for n, groups in enumerate(frames):
            cosines = [1, 0, 0, 0, 1, 0] if n < 10 else [0, 1, 0, 1, 0, 0]
            groups.PlaneOrientationSequence = Sequence([item(ImageOrientationPatient=cosines)])
        self.enhanced([], frames, np.concatenate([self.data, self.data]))
        self.assertEqual(self.info("frames.dcm", "--frame", 0)["spacing"], [1, 1, 1])
        second = self.info("frames.dcm", "--frame", 1)
        self.assertEqual((second["spacing"][2], second["frames"]), (2, 2))
        self.assertEqual(second["direction"], [[0, 1, 0], [1, 0, 0], [0, 0, -1]])

    def test_times_of_one_plane_are_no_volume(self):
        self.enhanced([], [frame(0, TemporalPositionIndex=k + 1) for k in range(10)], self.data)
        self.assertIn("time points of one plane", self.refused("info", "frames.dcm"))

    def test_volumes_of_ultrasound_and_dose(self):
        frames = [item(PlanePositionVolumeSequence=Sequence([item(ImagePositionVolume=[3.0, -4.0, 5 + 0.5 * k])]))
                  for k in range(10)][::-1]
        groups = Sequence([item(
            PixelMeasuresSequence=Sequence([item(PixelSpacing=[1, 1])]),
            PlaneOrientationVolumeSequence=Sequence([item(ImageOrientationVolume=[1.0, 0, 0, 0, 1.0, 0])]))])
        dicom(self.path, self.data[::-1], ENHANCED_VOLUME, SharedFunctionalGroupsSequence=groups,
              PerFrameFunctionalGroupsSequence=Sequence(frames))
        image = self.info("frames.dcm")
        self.assertEqual((image["spacing"], image["origin"]), ([1, 1, 0.5], [3, -4, 5]))
        dicom(self.path, self.data, DOSE, PixelSpacing=[1, 1], ImagePositionPatient=[3, -4, 5],
              ImageOrientationPatient=[1, 0, 0, 0, 1, 0], GridFrameOffsetVector=[2.5 * k for k in range(10)])
        self.assertEqual(self.info("frames.dcm")["spacing"], [1, 1, 2.5])

    def test_regions_of_ultrasound(self):
        region = item(RegionSpatialFormat=1, PhysicalUnitsXDirection=3, PhysicalUnitsYDirection=3,
                      PhysicalDeltaX=0.05, PhysicalDeltaY=0.025)
        dicom(self.path, self.data, ULTRASOUND, SpacingBetweenSlices=1.5,
              SequenceOfUltrasoundRegions=Sequence([region]))
        self.assertEqual(self.info("frames.dcm")["spacing"], [0.5, 0.25, 1.5])


@unittest.skipIf(MISSING, MISSING)
class Slices(Case):
    """A file for each plane."""

    def series(self, **more):
        self.data = body()
        folder = self.folder / "series"
        folder.mkdir(exist_ok=True)
        for k, plane in enumerate(self.data):
            elements = {"PixelSpacing": [1, 1], "ImagePositionPatient": [3, -4, 5 + k],
                        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0], "InstanceNumber": 100 - k}
            elements.update({name: value(k) if callable(value) else value for name, value in more.items()})
            dicom(folder / f"{k * 7 % 10}.dcm", plane, **{n: v for n, v in elements.items() if v is not None})
        return folder

    def cut(self, folder, bytes_before):
        """Without the preamble, and the meta group."""
        for path in folder.iterdir():
            whole = path.read_bytes()
            path.write_bytes(whole[132 if bytes_before == "preamble" else whole.index(b"\x08\x00\x16\x00"):])

    def test_without_preamble(self):
        for name, implicit in (("preamble", False), ("meta", False), ("meta", True)):
            with self.subTest(name, implicit=implicit):
                folder = self.series(implicit=implicit)
                self.cut(folder, name)
                image = self.info("series")
                self.assertEqual((image["spacing"], image["origin"]), ([1, 1, 1], [3, -4, 5]))
                np.testing.assert_array_equal(self.voxels("series"), self.data)
                np.testing.assert_array_equal(self.voxels("series/7.dcm"), self.data)
                (folder / "7.dcm").rename(folder / "7")
                np.testing.assert_array_equal(self.voxels("series/7"), self.data)
                (folder / "7").unlink()

    def test_texts_are_no_images(self):
        folder = self.folder / "series"
        folder.mkdir()
        (folder / "notes").write_text("\x08 is no group\n" * 40)
        (folder / "zeros").write_bytes(bytes(4000))
        self.assertIn("neither a usable DICOM image", self.refused("info", "series"))

    def test_a_tilted_gantry(self):
        self.series(ImagePositionPatient=lambda k: [3, -4 + 0.25 * k, 5 + k])
        image = self.info("series")
        self.assertAlmostEqual(image["spacing"][2], (1 + 0.25 ** 2) ** 0.5)
        np.testing.assert_allclose(np.asarray(image["direction"])[:, 2] * image["spacing"][2], (0, 0.25, 1), atol=1e-9)
        self.assertIn("differ from 90 degrees by up to 14", self.run_covol("info", "series").stdout)
        self.series(ImagePositionPatient=lambda k: [3 + (k == 4), -4, 5 + k])
        self.assertIn("1 mm away from it", self.refused("info", "series"))

    def test_without_positions_by_number(self):
        self.series(ImagePositionPatient=None, SpacingBetweenSlices=2.0, InstanceNumber=lambda k: k + 1)
        image = self.info("series")
        self.assertEqual(image["spacing"], [1, 1, 2])
        self.assertIn("InstanceNumber (0020,0013)", image["fields"].values())
        self.series(ImagePositionPatient=None, InstanceNumber=lambda k: k + 1)
        self.assertEqual(self.info("series")["spacing_known"], [True, True, False])

    def test_times_in_one_folder(self):
        folder = self.series(TemporalPositionIdentifier=1)
        for path in list(folder.iterdir()):
            ds = pydicom.dcmread(str(path))
            ds.TemporalPositionIdentifier = 2
            ds.PixelData = (ds.pixel_array // 2).astype("<u2").tobytes()
            ds.save_as(str(folder / f"b{path.name}"))
        self.assertEqual(self.info("series")["frames"], 2)
        np.testing.assert_array_equal(self.voxels("series", "--frame", 1), self.data // 2)
        np.testing.assert_array_equal(self.voxels("series", "--frame", 0), self.data)


if __name__ == "__main__":
    unittest.main()
