"""Results for clinical programs: DICOM segmentations and RT structure sets, checked with pydicom; structure sets as marks.

    COVOL=build/bin/covol python3 -m unittest tests/cli/dicom_results_test.py
"""
import os
import struct
import subprocess
import unittest

from cases_case import Case
from cases_dicom_test import CT, dicom, item
from covol_case import COVOL

try:
    import nibabel
    import numpy as np
    import pydicom
    from pydicom.sequence import Sequence
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

# 725 pixels per slice: in 1-bit segmentations, slices begin within a byte.
SIZE, SPACING = (29, 25, 14), (0.5, 0.8, 1.5)
LEFT, RIGHT, HALF = (8, 12, 6.2), (20, 13, 7), (4.6, 6.3, 4.1)  # centres and half axes of two ellipsoids, in voxels
SEG, RTSTRUCT = "1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.481.3"
ENHANCED_CT = "1.2.840.10008.5.1.4.1.1.2.1"
EPOCH = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}


def turned(tilt=0.0):
    """The lattice as a matrix: rotated, and with sheared slices, as with a tilted gantry."""
    a, b = np.radians(20), np.radians(-35)
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    z = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    axes = x @ z
    affine = np.eye(4)
    affine[:3, :3] = axes * SPACING
    affine[:3, 2] += tilt * axes[:, 1]
    affine[:3, 3] = (-40.25, 12.5, 101.75)
    return affine


def inside(at):
    z, y, x = np.meshgrid(*(np.arange(n) for n in SIZE[::-1]), indexing="ij")
    return sum(((c - m) / h) ** 2 for c, m, h in zip((x, y, z), at, HALF)) < 1


def on_body(at, affine, count=220):
    n = np.arange(count) + 0.5
    z, turn = 1 - 2 * n / count, np.pi * (3 - np.sqrt(5)) * n
    r = np.sqrt(1 - z * z)
    voxels = np.stack([r * np.cos(turn), r * np.sin(turn), z], 1) * HALF + at
    return voxels @ affine[:3, :3].T + affine[:3, 3]


def series(folder, affine, **more):
    """Slices whose file names and instance numbers are not in spatial order."""
    folder.mkdir()
    data = np.where(inside(LEFT) | inside(RIGHT), 900, 100).astype(np.uint16)
    axes = affine[:3, :3] / np.linalg.norm(affine[:3, :3], axis=0)
    for k in range(SIZE[2]):
        place = affine[:3, 3] + k * affine[:3, 2]
        ds = dicom(folder / f"{(k * 5) % SIZE[2]:02d}.dcm", data[k], SOPInstanceUID=f"1.2.9.{k + 1}", FrameOfReferenceUID="1.2.77",
                   InstanceNumber=str((k * 3) % SIZE[2]), PixelSpacing=[SPACING[1], SPACING[0]], SliceThickness="1.5",
                   ImagePositionPatient=[f"{c:.8g}" for c in place],
                   ImageOrientationPatient=[f"{c:.10g}" for c in (*axes[:, 0], *axes[:, 1])],
                   SpecificCharacterSet="ISO_IR 100", PatientName="Müller^Jörg", PatientID="P 17", PatientSex="M",
                   PatientBirthDate="19700203", StudyDate="20200102", StudyTime="101112", AccessionNumber="A9", StudyID="S4",
                   ReferringPhysicianName="", StudyDescription="Schädel", PositionReferenceIndicator="SN", **more)
        ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPInstanceUID
        ds.save_as(str(folder / f"{(k * 5) % SIZE[2]:02d}.dcm"), write_like_original=False)


def places(ds):
    """The files of a folder by the UID of their instance."""
    return {one.SOPInstanceUID: one for one in ds}


@unittest.skipIf(MISSING, MISSING)
class DicomCase(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.affine = turned()
        cls.scan = cls.inputs / "scan"
        series(cls.scan, cls.affine)
        cls.slices = places(pydicom.dcmread(str(p)) for p in cls.scan.iterdir())
        for name, at in (("left", LEFT), ("right", RIGHT)):
            np.savetxt(cls.inputs / f"{name}.xyz", on_body(at, cls.affine))

    def two(self, *more):
        return ("segment", self.scan, "--points", f"Größe 1={self.inputs / 'left.xyz'}", f"right={self.inputs / 'right.xyz'}",
                "-o", "s.vdb", *more)

    def faults(self, ds, kind, filled, there=()):
        """Attributes that must be present: with a value (type 1), and possibly empty (type 2). PS3.3."""
        found = []
        for name in ("SOPClassUID", "SOPInstanceUID", "StudyInstanceUID", "SeriesInstanceUID", "Modality", "FrameOfReferenceUID",
                     *filled):
            if not str(getattr(ds, name, "")):
                found.append(f"{name} is not there, or empty")
        for name in ("PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyDate", "StudyTime", "StudyID",
                     "AccessionNumber", "ReferringPhysicianName", "SeriesNumber", "Manufacturer", *there):
            if name not in ds:
                found.append(f"{name} is not there")
        if ds.SOPClassUID != kind or ds.file_meta.MediaStorageSOPClassUID != kind:
            found.append(f"class {ds.SOPClassUID}")
        if ds.file_meta.MediaStorageSOPInstanceUID != ds.SOPInstanceUID:
            found.append("the meta group has another instance")
        for element in ds.iterall():
            if element.VR == "UI" and element.value:
                if len(str(element.value)) > 64 or not pydicom.uid.UID(str(element.value)).is_valid:
                    found.append(f"{element.keyword}: {element.value} is no UID")
            if element.VR in ("DS", "IS", "CS", "SH"):
                for value in element.value if element.VM > 1 else [element.value]:
                    if len(str(getattr(value, "original_string", value))) > (12 if element.VR == "IS" else 16):
                        found.append(f"{element.keyword}: {value} is too long")
        return found

    def check_seg(self, ds):
        """The requirements of highdicom's Segmentation class and of PS3.3 A.51."""
        faults = self.faults(ds, SEG, (
            "ImageType", "InstanceNumber", "ContentDate", "ContentTime", "ContentLabel", "SegmentationType", "SegmentSequence",
            "ManufacturerModelName", "DeviceSerialNumber", "SoftwareVersions", "LossyImageCompression", "SamplesPerPixel",
            "PhotometricInterpretation", "Rows", "Columns", "BitsAllocated", "BitsStored", "NumberOfFrames",
            "SharedFunctionalGroupsSequence", "PerFrameFunctionalGroupsSequence", "DimensionOrganizationSequence",
            "DimensionIndexSequence"), ("ContentDescription", "ContentCreatorName", "PositionReferenceIndicator"))
        self.assertEqual(faults, [])
        self.assertEqual((list(ds.ImageType), ds.SegmentationType, ds.SegmentsOverlap, ds.PhotometricInterpretation),
                         (["DERIVED", "PRIMARY"], "BINARY", "NO", "MONOCHROME2"))
        self.assertEqual((ds.BitsAllocated, ds.BitsStored, ds.HighBit, ds.PixelRepresentation, ds.SamplesPerPixel), (1, 1, 0, 0, 1))
        bits = ds.Rows * ds.Columns * ds.NumberOfFrames
        self.assertEqual(len(ds.PixelData), (bits + 15) // 16 * 2)
        self.assertEqual(len(ds.PerFrameFunctionalGroupsSequence), ds.NumberOfFrames)
        self.assertEqual([s.SegmentNumber for s in ds.SegmentSequence], list(range(1, len(ds.SegmentSequence) + 1)))
        for segment in ds.SegmentSequence:
            self.assertEqual((segment.SegmentAlgorithmType, len(segment.RecommendedDisplayCIELabValue)), ("SEMIAUTOMATIC", 3))
            self.assertTrue(segment.SegmentAlgorithmName)
            for codes in (segment.SegmentedPropertyCategoryCodeSequence, segment.SegmentedPropertyTypeCodeSequence):
                self.assertTrue(codes[0].CodeValue and codes[0].CodingSchemeDesignator and codes[0].CodeMeaning)
        organization = ds.DimensionOrganizationSequence[0].DimensionOrganizationUID
        self.assertEqual([(d.DimensionIndexPointer, d.FunctionalGroupPointer, d.DimensionOrganizationUID)
                          for d in ds.DimensionIndexSequence],
                         [(0x0062000B, 0x0062000A, organization), (0x00200032, 0x00209113, organization)])
        indices = [tuple(f.FrameContentSequence[0].DimensionIndexValues) for f in ds.PerFrameFunctionalGroupsSequence]
        self.assertEqual(len(set(indices)), len(indices))
        self.assertEqual({p for _, p in indices}, set(range(1, max(p for _, p in indices) + 1)))
        for (segment, _), frame in zip(indices, ds.PerFrameFunctionalGroupsSequence):
            self.assertEqual(frame.SegmentIdentificationSequence[0].ReferencedSegmentNumber, segment)

    def labels_of(self, ds, affine):
        """[z, y, x] on the lattice, with each frame at its stated position."""
        labels = np.zeros(SIZE[::-1], int)
        shared = ds.SharedFunctionalGroupsSequence[0]
        np.testing.assert_allclose(shared.PixelMeasuresSequence[0].PixelSpacing, [SPACING[1], SPACING[0]])
        cosines = np.array(shared.PlaneOrientationSequence[0].ImageOrientationPatient, float).reshape(2, 3)
        np.testing.assert_allclose(cosines.T * SPACING[:2], affine[:3, :2], atol=1e-7)
        frames = ds.pixel_array.reshape(-1, ds.Rows, ds.Columns)
        for pixels, groups in zip(frames, ds.PerFrameFunctionalGroupsSequence):
            place = np.array(groups.PlanePositionSequence[0].ImagePositionPatient, float)
            index = np.linalg.solve(affine[:3, :3], place - affine[:3, 3])
            np.testing.assert_allclose(index, [0, 0, np.round(index[2])], atol=1e-5)
            where = labels[int(np.round(index[2]))]
            self.assertFalse(where[pixels > 0].any())
            self.assertTrue(pixels.any())
            where[pixels > 0] = groups.SegmentIdentificationSequence[0].ReferencedSegmentNumber
        return labels


class Segmentations(DicomCase):
    def test_two_structures_of_a_series(self):
        self.run_covol(*self.two("--mask", "m.dcm"))
        self.run_covol(*self.two("--mask", "m.nii.gz"))
        ds = pydicom.dcmread(str(self.out / "m.dcm"))
        self.check_seg(ds)
        self.assertEqual([s.SegmentLabel for s in ds.SegmentSequence], ["Größe 1", "right"])
        wanted = np.asarray(nibabel.load(self.out / "m.nii.gz").dataobj).T
        labels = self.labels_of(ds, self.affine)
        np.testing.assert_array_equal(labels, wanted)
        for number, at in ((1, LEFT), (2, RIGHT)):
            truth = inside(at)
            self.assertGreater(2 * (truth & (labels == number)).sum() / (truth.sum() + (labels == number).sum()), 0.93)
        self.assertEqual((ds.StudyInstanceUID, ds.FrameOfReferenceUID, ds.PatientID, ds.AccessionNumber, ds.PatientBirthDate),
                         ("1.2", "1.2.77", "P 17", "A9", "19700203"))
        self.assertEqual((str(ds.PatientName), ds.StudyDescription), ("Müller^Jörg", "Schädel"))
        self.assertNotIn(ds.SeriesInstanceUID, ("1.2.9",))

        listed = {r.ReferencedSOPInstanceUID for r in ds.ReferencedSeriesSequence[0].ReferencedInstanceSequence}
        self.assertEqual(ds.ReferencedSeriesSequence[0].SeriesInstanceUID, "1.2.9")
        used = set()
        for groups in ds.PerFrameFunctionalGroupsSequence:
            source, = groups.DerivationImageSequence[0].SourceImageSequence
            used.add(source.ReferencedSOPInstanceUID)
            self.assertEqual(source.ReferencedSOPClassUID, CT)
            self.assertEqual(source.PurposeOfReferenceCodeSequence[0].CodeValue, "121322")
            np.testing.assert_allclose(np.array(self.slices[source.ReferencedSOPInstanceUID].ImagePositionPatient, float),
                                       np.array(groups.PlanePositionSequence[0].ImagePositionPatient, float), atol=1e-5)
        self.assertEqual(used, listed)

    def test_the_same_bits_on_any_number_of_threads_at_the_same_time(self):
        for name, threads in (("one.dcm", 1), ("two.dcm", 2)):
            subprocess.run([COVOL, *map(str, self.two("--mask", name, "--threads", threads, "--quiet"))], env=EPOCH, cwd=self.out,
                           check=True)
        self.assertEqual((self.out / "one.dcm").read_bytes(), (self.out / "two.dcm").read_bytes())
        self.assertEqual(pydicom.dcmread(str(self.out / "one.dcm")).ContentDate, "20231114")

    def test_frames_of_one_file(self):
        """Each segment's frame refers to a frame of the enhanced image."""
        data = np.where(inside(LEFT), 900, 100).astype(np.uint16)
        frames = [item(PlanePositionSequence=Sequence([item(ImagePositionPatient=[0, 0, 1.5 * k])]),
                       FrameContentSequence=Sequence([item()])) for k in range(SIZE[2])]
        shared = item(PixelMeasuresSequence=Sequence([item(PixelSpacing=[0.8, 0.5], SliceThickness=1.5)]),
                      PlaneOrientationSequence=Sequence([item(ImageOrientationPatient=[1, 0, 0, 0, 1, 0])]))
        dicom(self.out / "e.dcm", data, ENHANCED_CT, FrameOfReferenceUID="1.2.78", SharedFunctionalGroupsSequence=Sequence([shared]),
              PerFrameFunctionalGroupsSequence=Sequence(frames))
        affine = np.diag((*SPACING, 1.0))
        np.savetxt(self.out / "m.xyz", on_body(LEFT, affine))
        self.run_covol("segment", "e.dcm", "--points", "m.xyz", "-o", "s.vdb", "--mask", "m.dcm")
        ds = pydicom.dcmread(str(self.out / "m.dcm"))
        self.check_seg(ds)
        self.labels_of(ds, affine)
        for groups in ds.PerFrameFunctionalGroupsSequence:
            source, = groups.DerivationImageSequence[0].SourceImageSequence
            k = round(float(groups.PlanePositionSequence[0].ImagePositionPatient[2]) / 1.5)
            self.assertEqual((source.ReferencedSOPInstanceUID, source.ReferencedFrameNumber), ("1.2.3", k + 1))
        self.assertEqual(len(ds.ReferencedSeriesSequence[0].ReferencedInstanceSequence), 1)

    def test_a_tilted_gantry(self):
        affine = turned(tilt=0.4)
        series(self.out / "tilted", affine)
        np.savetxt(self.out / "m.xyz", on_body(LEFT, affine))
        self.run_covol("segment", "tilted", "--points", "m.xyz", "-o", "s.vdb", "--mask", "m.dcm")
        ds = pydicom.dcmread(str(self.out / "m.dcm"))
        self.check_seg(ds)
        self.labels_of(ds, affine)
        self.assertAlmostEqual(float(ds.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].SpacingBetweenSlices), 1.5,
                               places=5)

    def test_an_image_that_is_no_dicom(self):
        """In mm, whatever the image's unit; with a study and a frame of reference of its own."""
        data = np.where(inside(LEFT), 200, 20).astype(np.uint8)
        header = ("NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 29 25 14\nspace directions: (500,0,0) "
                  "(0,800,0) (0,0,1500)\nencoding: raw\nspace origin: (100,200,300)\n")
        affine = np.diag((*SPACING, 1.0))
        affine[:3, 3] = (0.1, 0.2, 0.3)
        np.savetxt(self.out / "m.xyz", on_body(LEFT, affine) * 1000)
        (self.out / "i.nrrd").write_bytes(header.encode() + b'space units: "um" "um" "um"\n\n' + data.tobytes())
        self.run_covol("segment", "i.nrrd", "--points", "m.xyz", "-o", "s.vdb", "--mask", "m.dcm", "--rtstruct", "r.dcm")
        ds = pydicom.dcmread(str(self.out / "m.dcm"))
        self.check_seg(ds)
        self.labels_of(ds, affine)
        self.assertNotIn("ReferencedSeriesSequence", ds)
        contours = pydicom.dcmread(str(self.out / "r.dcm"))
        self.assertEqual((contours.FrameOfReferenceUID, contours.StudyInstanceUID), (ds.FrameOfReferenceUID, ds.StudyInstanceUID))
        (self.out / "u.nrrd").write_bytes(header.encode() + b"\n" + data.tobytes())
        output = self.run_covol("mask", "s.vdb", "--like", "u.nrrd", "-o", "u.dcm").stderr
        self.assertIn("interpreted as mm", output)

    def test_what_lies_beside_a_series_is_no_slice_of_it(self):
        series(self.out / "scan", self.affine)
        np.savetxt(self.out / "m.xyz", on_body(LEFT, self.affine))
        self.run_covol("segment", "scan", "--points", "m.xyz", "-o", "s.vdb", "--mask", "scan/seg.dcm", "--rtstruct", "scan/rt.dcm")
        again = self.run_covol("info", "scan")
        self.assertNotIn("warning", again.stderr)
        self.assertEqual(self.info("scan")["size"], list(SIZE))

    def test_segments_are_numbered_from_1(self):
        """Another value of the inside cannot be stored, and is refused."""
        job = ("segment", self.scan, "--points", self.inputs / "left.xyz", "-o", "s.vdb")
        for more in (("--mask", "m.dcm"), ("--mask", "M.DCM")):
            error = self.refused(*job, *more, "--mask-label", 7)
            self.assertIn("--mask-label: expected 1 for " + more[-1], error)
            self.assertEqual(os.listdir(self.out), [])
        self.run_covol(*job, "--mask", "m.dcm", "--mask-label", 1)
        error = self.refused("mask", "s.vdb", "--like", self.scan, "-o", "n.dcm", "--label", 7)
        self.assertIn("--label: expected 1 for n.dcm", error)
        self.assertFalse((self.out / "n.dcm").exists())
        self.run_covol("mask", "s.vdb", "--like", self.scan, "-o", "n.dcm")
        for name in "m.dcm", "n.dcm":
            self.assertEqual([s.SegmentNumber for s in pydicom.dcmread(str(self.out / name)).SegmentSequence], [1])

    def test_what_is_no_segmentation_is_refused(self):
        self.assertIn("only label images", self.refused("convert", self.scan, "grey.dcm"))
        self.run_covol(*self.two("--mask", "m.dcm"))
        self.assertIn("a segmentation (SEG)", self.refused("info", "m.dcm"))
        leaning = ("NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 4 4\nspace directions: (1,0,0) "
                   "(0.3,1,0) (0,0,1)\nencoding: raw\n\n")
        (self.out / "l.nrrd").write_bytes(leaning.encode() + bytes(64))
        self.assertIn("perpendicular", self.refused("mask", "s.vdb", "--like", "l.nrrd", "-o", "l.dcm"))


def loops(contour):
    """Points of a contour, and twice its signed area in the axes of its plane."""
    return np.array(contour.ContourData, float).reshape(-1, 3)


def area(points, axes):
    x, y = (points @ axes).T
    return abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


class StructureSets(DicomCase):
    def contours(self, ds, number=1):
        return next(r.ContourSequence for r in ds.ROIContourSequence if r.ReferencedROINumber == number)

    def check_structures(self, ds):
        """PS3.3 A.19 and C.8.8.5 to C.8.8.8."""
        faults = self.faults(ds, RTSTRUCT, ("StructureSetLabel", "ReferencedFrameOfReferenceSequence", "StructureSetROISequence",
                                            "ROIContourSequence", "RTROIObservationsSequence", "ApprovalStatus"),
                             ("StructureSetDate", "StructureSetTime", "OperatorsName"))
        self.assertEqual(faults, [])
        numbers = [r.ROINumber for r in ds.StructureSetROISequence]
        self.assertEqual(numbers, [r.ReferencedROINumber for r in ds.ROIContourSequence])
        self.assertEqual(numbers, [r.ReferencedROINumber for r in ds.RTROIObservationsSequence])
        for roi in ds.StructureSetROISequence:
            self.assertEqual(roi.ReferencedFrameOfReferenceUID, ds.FrameOfReferenceUID)
        for roi in ds.ROIContourSequence:
            self.assertEqual(len(roi.ROIDisplayColor), 3)
            for contour in roi.ContourSequence:
                self.assertEqual(contour.ContourGeometricType, "CLOSED_PLANAR")
                self.assertEqual(contour.NumberOfContourPoints * 3, len(contour.ContourData))

    def test_two_structures_of_a_series(self):
        report = self.report(*self.two("--rtstruct", "r.dcm"))
        ds = pydicom.dcmread(str(self.out / "r.dcm"))
        self.check_structures(ds)
        self.assertEqual([r.ROIName for r in ds.StructureSetROISequence], ["Größe 1", "right"])
        self.assertEqual((ds.StudyInstanceUID, ds.FrameOfReferenceUID, str(ds.PatientName)), ("1.2", "1.2.77", "Müller^Jörg"))
        frame, = ds.ReferencedFrameOfReferenceSequence
        listed = frame.RTReferencedStudySequence[0].RTReferencedSeriesSequence[0]
        self.assertEqual(listed.SeriesInstanceUID, "1.2.9")
        self.assertEqual({r.ReferencedSOPInstanceUID for r in listed.ContourImageSequence}, set(self.slices))
        axes = self.affine[:3, :2] / SPACING[:2]
        for number, at in ((1, LEFT), (2, RIGHT)):
            volume = 0
            for contour in self.contours(ds, number):
                points = loops(contour)
                voxels = (points - self.affine[:3, 3]) @ np.linalg.inv(self.affine[:3, :3]).T
                k = round(voxels[0, 2])
                np.testing.assert_allclose(voxels[:, 2], k, atol=1e-5)
                source = self.slices[contour.ContourImageSequence[0].ReferencedSOPInstanceUID]
                np.testing.assert_allclose(np.array(source.ImagePositionPatient, float), self.affine[:3, 3] + k * self.affine[:3, 2],
                                           atol=1e-5)
                # Mean distance of the contour from the ellipsoid, in pixels: the relative radius times 5, about a half
                # axis.
                radius = np.sqrt((((voxels - at) / HALF) ** 2).sum(1))
                self.assertLess(np.mean(np.abs(radius - 1)) * 5, 0.4)
                volume += area(points, axes) * 1.5
            self.assertAlmostEqual(volume / report["structures"][number - 1]["surface"]["volume"], 1, delta=0.04)

    def shell(self):
        """A ball with a cavity, and another ball within the cavity: [z, y, x] at 1 mm."""
        z, y, x = np.meshgrid(*(np.arange(41) - 20.0,) * 3, indexing="ij")
        r = np.sqrt(x * x + y * y + z * z)
        return (np.clip(np.minimum(16 - r, np.maximum(r - 10, 4 - r)), -1, 1) * 100 + 100).astype(np.uint8)

    def shell_contours(self):
        header = ("NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 41 41 41\nspace directions: (1,0,0) "
                  '(0,1,0) (0,0,1)\nencoding: raw\nspace origin: (0,0,0)\nspace units: "mm" "mm" "mm"\n\n')
        (self.out / "shell.nrrd").write_bytes(header.encode() + self.shell().tobytes())
        mask = (self.shell() > 100).astype(np.uint8)
        (self.out / "mask.nrrd").write_bytes(header.encode() + mask.tobytes())
        self.run_covol("segment", "shell.nrrd", "--guess", "mask.nrrd", "-o", "s.vdb", "--rtstruct", "r.dcm")
        return pydicom.dcmread(str(self.out / "r.dcm"))

    def test_holes_are_keyholes(self):
        ds = self.shell_contours()
        self.check_structures(ds)
        middle = [loops(c) for c in self.contours(ds) if abs(float(c.ContourData[2]) - 20) < 1e-6]
        # Contours on the middle slice: of the shell with its cavity, and of the ball in the cavity.
        self.assertEqual(len(middle), 2)
        areas = sorted(area(points, np.eye(3)[:, :2]) for points in middle)
        slice_ = self.shell()[20] > 100
        ball = np.hypot(*(np.argwhere(slice_) - 20).T) < 7
        np.testing.assert_allclose(areas, [ball.sum(), (~ball).sum()], rtol=0.05)
        ring = max(middle, key=len)
        steps = {tuple(np.round((a + b) / 2, 9)) for a, b in zip(ring, np.roll(ring, -1, 0))}
        # The outline passes one edge twice: the cut that joins the outer border and the hole.
        self.assertEqual(len(ring) - len(steps), 1)

    def test_what_is_written_is_read(self):
        self.shell_contours()
        report = self.report("segment", "shell.nrrd", "--contours", "r.dcm", "-o", "again.vdb")
        structure, = report["structures"]
        self.assertEqual(structure["name"], "surface")
        self.assertIn("DICOM RT structure set", structure["input"]["contours"]["rules"][0])
        self.assertAlmostEqual(structure["surface"]["volume"] / (4 / 3 * np.pi * (16 ** 3 - 10 ** 3 + 4 ** 3)), 1, delta=0.03)
        self.assertEqual(structure["surface"]["components"], 3)

    def foreign(self, implicit=False, kind="CLOSED_PLANAR", counts=True, **changes):
        """As another program writes it: two ROIs in sagittal planes of the scan."""
        rois, contoured = [], []
        for number, (name, at) in enumerate((("Niere rechts", RIGHT), ("left", LEFT)), 4):
            contours = []
            for i in range(int(at[0]) - 4, int(at[0]) + 5):
                fraction = 1 - ((i - at[0]) / HALF[0]) ** 2
                turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
                voxels = np.stack([np.full(60, float(i)), at[1] + HALF[1] * fraction ** 0.5 * np.cos(turn),
                                   at[2] + HALF[2] * fraction ** 0.5 * np.sin(turn)], 1)
                points = voxels @ self.affine[:3, :3].T + self.affine[:3, 3]
                one = item(ContourGeometricType=kind, ContourData=[f"{c:.6f}" for c in points.ravel()])
                if counts:
                    one.NumberOfContourPoints = 60
                contours.append(one)
            rois.append(item(ROINumber=number, ReferencedFrameOfReferenceUID="1.2.77", ROIName=name, ROIGenerationAlgorithm=""))
            contoured.append(item(ReferencedROINumber=number, ContourSequence=Sequence(contours)))
        meta = pydicom.dataset.FileMetaDataset()
        meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = RTSTRUCT, "1.2.5"
        meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian if implicit else pydicom.uid.ExplicitVRLittleEndian
        path = self.out / "foreign.dcm"
        ds = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
        ds.is_little_endian, ds.is_implicit_VR = True, implicit
        ds.SOPClassUID, ds.SOPInstanceUID, ds.Modality, ds.PatientName = RTSTRUCT, "1.2.5", "RTSTRUCT", "phantom"
        ds.StructureSetROISequence, ds.ROIContourSequence = Sequence(rois), Sequence(contoured)
        for name, value in changes.items():
            setattr(ds, name, value)
        ds.save_as(str(path), write_like_original=False)
        return path

    def test_structures_of_other_programs(self):
        """ROI names become structures, in planes of any direction; implicit and explicit VR."""
        for implicit, kind, counts in ((False, "CLOSED_PLANAR", True), (True, "CLOSEDPLANAR_XOR", False)):
            self.foreign(implicit, kind, counts)
            report = self.report("segment", self.scan, "--contours", "foreign.dcm", "-o", "s.vdb", "--mask", "m.nii.gz")
            self.assertEqual([s["name"] for s in report["structures"]], ["Niere rechts", "left"])
            labels = np.asarray(nibabel.load(self.out / "m.nii.gz").dataobj).T
            for number, at in ((1, RIGHT), (2, LEFT)):
                truth, found = inside(at), labels == number
                self.assertGreater(2 * (truth & found).sum() / (truth.sum() + found.sum()), 0.9)

    def test_a_name_for_a_file_with_several(self):
        self.foreign()
        output = self.refused("segment", self.scan, "--contours", "organ=foreign.dcm", "-o", "s.vdb")
        self.assertIn("'Niere rechts', 'left'", output)
        self.assertIn("--structure-column roi", output)
        self.assertIn("expected a table with a column 'cell'",
                      self.refused("segment", self.scan, "--contours", "foreign.dcm", "--structure-column", "cell", "-o", "s.vdb"))

    def test_points_of_several_structures_are_no_points_of_one(self):
        self.foreign()
        self.assertIn("expected contours of one structure", self.refused("convert", "foreign.dcm", "p.csv"))

    def test_damaged_files(self):
        """A clear error and never a crash, wherever the file is truncated and whatever lengths it claims."""
        path = self.foreign()
        whole = path.read_bytes()
        for end in (*range(100, 1400, 37), len(whole) // 2, len(whole) - 1):
            path.write_bytes(whole[:end])
            self.assertIn("foreign.dcm", self.refused("segment", self.scan, "--contours", "foreign.dcm", "-o", "s.vdb"), end)
        at = whole.index(b"\x06\x30\x39\x00SQ")
        for length in (0x7FFFFFFF, 0xFFFFFFFE, 0xFFFFFFFF, 1, 9):
            path.write_bytes(whole[:at + 8] + struct.pack("<I", length) + whole[at + 12:])
            self.assertIn("foreign.dcm", self.refused("segment", self.scan, "--contours", "foreign.dcm", "-o", "s.vdb"))
        deep = whole[:at] + b"\x06\x30\x39\x00SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff" * 5000
        path.write_bytes(deep)
        self.assertIn("sequences are nested", self.refused("segment", self.scan, "--contours", "foreign.dcm", "-o", "s.vdb"))

    def test_wrong_contents(self):
        one = lambda **more: Sequence([item(ReferencedROINumber=4, ContourSequence=Sequence([item(**more)]))])  # noqa: E731
        for contours, expected_text in ((one(ContourGeometricType="CLOSED_PLANAR", ContourData=["1", "2"]), "three numbers"),
                               (one(ContourGeometricType="CLOSED_PLANAR", ContourData=["1"] * 9, NumberOfContourPoints=2), "'2' points"),
                               (one(ContourGeometricType="BLOB", ContourData=["1"] * 9), "'BLOB'"),
                               (Sequence([]), "at least one point")):
            self.foreign(ROIContourSequence=contours)
            self.assertIn(expected_text, self.refused("segment", self.scan, "--contours", "left=foreign.dcm", "-o", "s.vdb"))
        slice_ = next(self.scan.iterdir())
        self.assertIn("got a DICOM file of modality 'CT'", self.refused("segment", self.scan, "--contours", slice_, "-o", "s.vdb"))


if __name__ == "__main__":
    unittest.main()
