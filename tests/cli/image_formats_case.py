"""Common to the tests of image formats: one image of an ellipsoid, which is written in each format, and marks on it.

Files are made by each format's own library (tifffile, nibabel, pydicom, pyopenvdb), else byte by byte.
"""
import gzip
import math
import struct
import unittest

import covol_case

try:
    import nibabel
    import numpy as np
    import pydicom
    import pydicom.uid
    import pyopenvdb
    import tifffile
    MISSING = ""
except ImportError as error:
    nibabel = np = pydicom = pyopenvdb = tifffile = None
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

SIZE = (30, 26, 14)           # voxels along x, y, z
SPACING = (0.5, 0.625, 1.25)  # exact in single precision and in DICOM's decimals
ORIGIN = (10.0, -20.0, 5.5)
CENTRE = (16.0, -12.5, 12.0)  # of the ellipsoid; not the image's centre, so that flipped or swapped axes are noticed
RADII = (3.5, 4.5, 3.0)


def voxels():
    """The image as an array [z, y, x] of bytes: a bright ellipsoid, its edge blurred over about a voxel."""
    z, y, x = np.meshgrid(*(np.arange(n) for n in SIZE[::-1]), indexing="ij")
    world = [ORIGIN[a] + SPACING[a] * i for a, i in enumerate((x, y, z))]
    r = np.sqrt(sum(((world[a] - CENTRE[a]) / RADII[a]) ** 2 for a in range(3)))
    return np.clip(30 + 200 * np.clip((1 - r) * 4 + 0.5, 0, 1), 0, 255).astype(np.uint8)


def marks(count, shift=(0, 0, 0)):
    """A Fibonacci lattice on the ellipsoid."""
    golden = math.pi * (3 - math.sqrt(5))
    lines = []
    for n in range(count):
        z = 1 - (2 * n + 1) / count
        r = math.sqrt(1 - z * z)
        unit = (r * math.cos(golden * n), r * math.sin(golden * n), z)
        lines.append(" ".join(f"{CENTRE[a] + RADII[a] * unit[a] - shift[a]:.6f}" for a in range(3)))
    return "\n".join(lines) + "\n"


def nrrd_header(**more):
    lines = ["NRRD0005", "type: uint8", "dimension: 3", "space: left-posterior-superior", "sizes: %d %d %d" % SIZE,
             "space directions: (%r,0,0) (0,%r,0) (0,0,%r)" % SPACING, "space origin: (%r,%r,%r)" % ORIGIN,
             "endian: little", "encoding: " + more.pop("encoding", "raw"), 'space units: "um" "um" "um"']
    return "\n".join(lines + [f"{key.replace('_', ' ')}: {value}" for key, value in more.items()]) + "\n"


def write_mrc(path, data, mode, big=False, **words):
    """MRC2014, field by field."""
    order = ">" if big else "<"
    header = bytearray(1024)
    def put(at, kind, *values):
        struct.pack_into(order + kind, header, at, *values)
    put(0, "4i", *SIZE, mode)
    put(28, "3i", *SIZE)
    put(40, "6f", *(n * s for n, s in zip(SIZE, SPACING)), 90, 90, 90)
    put(64, "3i", 1, 2, 3)
    put(76, "3f", float(data.min()), float(data.max()), float(data.mean()))
    put(196, "3f", *words.get("origin", ORIGIN))
    put(16, "3i", *words.get("start", (0, 0, 0)))
    header[208:212] = b"MAP "
    header[212:216] = b"\x11\x11\0\0" if big else b"\x44\x44\0\0"
    path.write_bytes(bytes(header) + data.astype(data.dtype.newbyteorder(order)).tobytes())


def write_ics(path, data, version="2.0", big=False, compression="uncompressed"):
    """As libics writes it; the voxels of version 1.0 are in the .ids file beside it."""
    size = data.dtype.itemsize
    order = range(size, 0, -1) if big else range(1, size + 1)
    lines = [["ics_version", version], ["filename", path.stem], ["layout", "parameters", 4], ["layout", "order", "bits", "x", "y", "z"],
             ["layout", "sizes", 8 * size, *SIZE], ["layout", "coordinates", "video"], ["layout", "significant_bits", 8 * size],
             ["representation", "format", "real" if data.dtype.kind == "f" else "integer"],
             ["representation", "sign", "unsigned" if data.dtype.kind == "u" else "signed"],
             ["representation", "compression", compression], ["representation", "byte_order", *order],
             ["parameter", "origin", 0, *ORIGIN], ["parameter", "scale", 1, *SPACING], ["parameter", "units", "bits", *["micrometers"] * 3],
             ["history", "software", "a test"]]
    text = "\t\n" + "".join("\t".join(map(str, words)) + "\n" for words in lines)
    voxels = data.astype(data.dtype.newbyteorder(">" if big else "<")).tobytes()
    voxels = gzip.compress(voxels) if compression == "gzip" else voxels
    if version == "1.0":
        path.with_suffix(".ids").write_bytes(voxels)
        path.write_text(text)
    else:
        path.write_bytes((text + "end\n").encode() + voxels)


def write_dicom_series(folder, data, series="1.2.3.4.5", description="ball"):
    """One file for each slice; the order of the names is not that of the slices."""
    folder.mkdir(exist_ok=True)
    for k in range(data.shape[0]):
        meta = pydicom.dataset.FileMetaDataset()
        meta.MediaStorageSOPClassUID = pydicom.uid.CTImageStorage
        meta.MediaStorageSOPInstanceUID = f"{series}.{k + 1}"
        meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        path = folder / f"{series}-{(k * 3) % data.shape[0]:03d}.dcm"
        ds = pydicom.dataset.FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
        ds.is_little_endian, ds.is_implicit_VR = True, False
        ds.SOPClassUID, ds.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        ds.StudyInstanceUID, ds.SeriesInstanceUID = "1.2.3", series
        ds.Modality, ds.SeriesDescription, ds.PatientName = "CT", description, "phantom"
        ds.InstanceNumber = data.shape[0] - k
        ds.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
        ds.ImagePositionPatient = [ORIGIN[0], ORIGIN[1], ORIGIN[2] + SPACING[2] * k]
        ds.PixelSpacing = [SPACING[1], SPACING[0]]  # DICOM: distance of rows (y), then of columns (x)
        ds.SliceThickness = 0.7                     # the spacing of slices is not this, but 1.25, from their positions
        ds.Rows, ds.Columns = data.shape[1:]
        ds.SamplesPerPixel, ds.PhotometricInterpretation, ds.PixelRepresentation = 1, "MONOCHROME2", 0
        ds.BitsAllocated = ds.BitsStored = 16
        ds.HighBit = 15
        ds.PixelData = data[k].astype("<u2").tobytes()
        ds.save_as(str(path), write_like_original=False)
    return folder


def ome_xml(files=None, order="XYZCT", channels=1, pages=None):
    tiff_data = "<TiffData/>" if files is None else "".join(
        f'<TiffData IFD="{ifd}" FirstZ="{z}" PlaneCount="1"><UUID FileName="{name}">urn:uuid:{name}</UUID></TiffData>'
        for z, (name, ifd) in enumerate(files))
    sizes = "".join(f' Size{a}="{n}"' for a, n in zip("XYZ", SIZE))
    physical = (f' PhysicalSizeX="{SPACING[0]}" PhysicalSizeY="{SPACING[1]}" PhysicalSizeZ="{SPACING[2] * 1000}"'
                ' PhysicalSizeZUnit="nm"')
    names = "".join(f'<Channel ID="Channel:0:{c}" Name="c{c}" SamplesPerPixel="1"/>' for c in range(channels))
    return ('<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">'
            f'<Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="{order}" Type="uint8"{sizes} SizeC="{channels}"'
            f' SizeT="1"{physical}>{names}{tiff_data}</Pixels></Image></OME>')


@unittest.skipIf(MISSING, MISSING)
class Case(covol_case.Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = cls.inputs
        cls.data = voxels()
        cls.world_marks, cls.shifted_marks = cls.folder / "marks.xyz", cls.folder / "shifted.xyz"
        cls.world_marks.write_text(marks(600))
        cls.shifted_marks.write_text(marks(600, ORIGIN))

    def run_covol(self, *args, **keywords):
        return super().run_covol(*args, cwd=self.folder, **keywords)

    def write_nrrd(self, name="ball.nrrd", data=None):
        path = self.folder / name
        path.write_bytes(nrrd_header().encode() + b"\n" + (self.data if data is None else data).tobytes())
        return path

    def surface(self, image, *options, points=None):
        out = self.folder / "surface.vdb"
        self.run_covol("segment", image, "--points", points or self.world_marks, "--init", "tag", "-o", out, "--quiet", *options)
        return out
