"""Images on any lattice, written and read without covol: the formats' own libraries, else byte by byte.

Each writer takes a path, voxels [z, y, x] of bytes, and a Lattice of the kind in its name; each reader returns the voxels and the
lattice.
"""
import dataclasses
import re
import struct
import xml.etree.ElementTree
import zlib

import h5py
import nibabel
import numpy as np
import pydicom
import pydicom.uid
import pyopenvdb
import tifffile
import zarr
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.sequence import Sequence

LPS = np.diag([-1.0, -1.0, 1.0])
PER_MM = {"nm": 1e6, "um": 1e3, "mm": 1.0, "cm": 0.1, "m": 1e-3, "angstrom": 1e7}


@dataclasses.dataclass
class Lattice:
    """Voxel (i, j, k) has the position origin + steps @ (i, j, k), LPS, in `unit` ("" if unknown)."""
    steps: np.ndarray
    origin: np.ndarray
    unit: str = ""

    def world(self, index):
        return np.asarray(index, float) @ self.steps.T + self.origin

    def index(self, world):
        return (np.asarray(world, float) - self.origin) @ np.linalg.inv(self.steps).T

    @property
    def spacing(self):
        return np.linalg.norm(self.steps, axis=0)

    def upright(self, origin=True):
        """The same spacing along the world's axes, for formats that store no directions."""
        return Lattice(np.diag(self.spacing), self.origin if origin else np.zeros(3), self.unit)

    def rotated(self):
        """The nearest orthogonal axes with the same spacing."""
        u, _, v = np.linalg.svd(self.steps / self.spacing)
        return Lattice(u @ v * self.spacing, self.origin, self.unit)

    def tilted(self):
        """Axes of a stack of slices: i and j are orthogonal, k is unchanged."""
        i, j, k = (self.steps / self.spacing).T
        j = j - i * (i @ j)
        return Lattice(np.stack([i, j / np.linalg.norm(j), k], 1) * self.spacing, self.origin, self.unit)


def ras(lattice):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = LPS @ lattice.steps, LPS @ lattice.origin
    return matrix


# ------------------------------------------------------------------------------------------------ NIfTI

def write_nifti(path, data, lattice, form="s"):
    image = nibabel.Nifti1Image(data.transpose(2, 1, 0), None)
    image.header.set_zooms(lattice.spacing)
    image.header.set_xyzt_units({"um": "micron", "m": "meter"}.get(lattice.unit, lattice.unit))
    image.set_sform(ras(lattice) if form == "s" else np.eye(4), code=1 if form == "s" else 0)
    if form == "q":
        image.set_qform(ras(lattice), code=1)
    nibabel.save(image, str(path))


def read_nifti(path):
    image = nibabel.load(str(path))
    unit = {"micron": "um", "meter": "m", "unknown": ""}.get(*[image.header.get_xyzt_units()[0]] * 2)
    matrix = image.affine
    return np.asarray(image.dataobj).transpose(2, 1, 0), Lattice(LPS @ matrix[:3, :3], LPS @ matrix[:3, 3], unit)


# ------------------------------------------------------------------------------------------------ NRRD, MetaImage

SPACES = {"left-posterior-superior": (1, 1, 1), "right-anterior-superior": (-1, -1, 1), "left-anterior-superior": (1, -1, 1)}


def vector(numbers, form="({})", between=","):
    return form.format(between.join(repr(float(v)) for v in numbers))


def write_nrrd(path, data, lattice, space="left-posterior-superior"):
    turn = np.diag(SPACES[space])
    head = ["NRRD0005", "type: uint8", "dimension: 3", f"space: {space}", "sizes: %d %d %d" % data.shape[::-1],
            "space directions: " + " ".join(vector(step) for step in (turn @ lattice.steps).T),
            "space origin: " + vector(turn @ lattice.origin), "space units:" + f' "{lattice.unit}"' * 3, "encoding: raw", "", ""]
    path.write_bytes("\n".join(head).encode() + data.tobytes())


def read_nrrd(path):
    head, pixels = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    if fields["encoding"] == "gzip":
        pixels = zlib.decompress(pixels, 47)
    numbers = lambda text: np.array([float(v) for v in re.findall(r"[-+.\deE]+", text)])  # noqa: E731
    turn = np.diag(SPACES[fields["space"]])
    units = re.findall(r'"([^"]*)"', fields.get("space units", ""))
    assert len(set(units)) <= 1, units
    sizes = [int(n) for n in fields["sizes"].split()]
    return (np.frombuffer(pixels, fields["type"].replace("unsigned char", "u1")).reshape(sizes[::-1]),
            Lattice(turn @ numbers(fields["space directions"]).reshape(3, 3).T, turn @ numbers(fields["space origin"]),
                    units[0] if units else ""))


def write_metaimage(path, data, lattice):
    directions = (lattice.steps / lattice.spacing).T.ravel()
    path.write_bytes(("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
                      f"TransformMatrix = {vector(directions, '{}', ' ')}\nOffset = {vector(lattice.origin, '{}', ' ')}\n"
                      f"ElementSpacing = {vector(lattice.spacing, '{}', ' ')}\nDimSize = %d %d %d\nElementType = MET_UCHAR\n"
                      "ElementDataFile = LOCAL\n" % data.shape[::-1]).encode() + data.tobytes())


def read_metaimage(path):
    head, pixels = path.read_bytes().split(b"ElementDataFile = LOCAL\n", 1)
    fields = dict(line.split(" = ", 1) for line in head.decode().splitlines())
    if fields.get("CompressedData") == "True":
        pixels = zlib.decompress(pixels)
    numbers = lambda key: np.array([float(v) for v in fields[key].split()])  # noqa: E731
    sizes = [int(n) for n in fields["DimSize"].split()]
    return (np.frombuffer(pixels, "u1").reshape(sizes[::-1]),
            Lattice(numbers("TransformMatrix").reshape(3, 3).T * numbers("ElementSpacing"), numbers("Offset")))


# ------------------------------------------------------------------------------------------------ DICOM

def decimals(numbers):
    """DS: at most 16 characters."""
    return [next(text for text in (f"{v:.{n}g}" for n in range(17, 3, -1)) if len(text) <= 16) for v in numbers]


def dicom_dataset(path, kind, name, shape):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = kind, name
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    data = FileDataset(str(path), {}, file_meta=meta, preamble=bytes(128))
    data.is_little_endian, data.is_implicit_VR = True, False
    data.SOPClassUID, data.SOPInstanceUID, data.StudyInstanceUID, data.SeriesInstanceUID = kind, name, "1.2", "1.2.9"
    data.Modality, data.PatientName = "CT", "phantom"
    data.Rows, data.Columns = shape
    data.SamplesPerPixel, data.PhotometricInterpretation, data.PixelRepresentation = 1, "MONOCHROME2", 0
    data.BitsAllocated = data.BitsStored = 8
    data.HighBit = 7
    return data


def orientation(lattice):
    return decimals((lattice.steps / lattice.spacing).T[:2].ravel())


def write_dicom_series(path, data, lattice):
    path.mkdir()
    for k, plane in enumerate(data):
        file = path / f"{k * 7 % len(data):02d}.dcm"
        slice_ = dicom_dataset(file, "1.2.840.10008.5.1.4.1.1.2", f"1.2.3.{k + 1}", plane.shape)
        slice_.ImageOrientationPatient = orientation(lattice)
        slice_.ImagePositionPatient = decimals(lattice.world((0, 0, k)))
        slice_.PixelSpacing = decimals(lattice.spacing[1::-1])
        slice_.PixelData = plane.tobytes()
        slice_.save_as(str(file), write_like_original=False)


def write_dicom_frames(path, data, lattice):
    def item(**elements):
        made = Dataset()
        for name, value in elements.items():
            setattr(made, name, value)
        return made

    file = dicom_dataset(path, "1.2.840.10008.5.1.4.1.1.2.1", "1.2.3", data.shape[1:])
    order = np.random.default_rng(len(data)).permutation(len(data))
    file.NumberOfFrames = len(data)
    file.SharedFunctionalGroupsSequence = Sequence([item(
        PixelMeasuresSequence=Sequence([item(PixelSpacing=decimals(lattice.spacing[1::-1]), SliceThickness=0.25)]),
        PlaneOrientationSequence=Sequence([item(ImageOrientationPatient=orientation(lattice))]))])
    file.PerFrameFunctionalGroupsSequence = Sequence([
        item(PlanePositionSequence=Sequence([item(ImagePositionPatient=decimals(lattice.world((0, 0, k))))])) for k in order])
    file.PixelData = data[order].tobytes()
    file.save_as(str(path), write_like_original=False)


def dicom_lattice(directions, positions, spacing):
    directions = np.array(directions, float)
    positions = np.array(positions, float)
    steps = np.stack([directions[:3] * float(spacing[1]), directions[3:] * float(spacing[0]),
                      (positions[-1] - positions[0]) / (len(positions) - 1)], 1)
    return Lattice(steps, positions[0], "mm")


def along_normal(directions, positions):
    return np.argsort(np.array(positions, float) @ np.cross(*np.array(directions, float).reshape(2, 3)))


def read_dicom_series(path):
    slices = [pydicom.dcmread(file) for file in path.iterdir()]
    order = along_normal(slices[0].ImageOrientationPatient, [s.ImagePositionPatient for s in slices])
    slices = [slices[n] for n in order]
    return (np.stack([s.pixel_array for s in slices]),
            dicom_lattice(slices[0].ImageOrientationPatient, [s.ImagePositionPatient for s in slices], slices[0].PixelSpacing))


def read_dicom_frames(path):
    file = pydicom.dcmread(path)
    groups = file.SharedFunctionalGroupsSequence[0]
    directions = groups.PlaneOrientationSequence[0].ImageOrientationPatient
    positions = [g.PlanePositionSequence[0].ImagePositionPatient for g in file.PerFrameFunctionalGroupsSequence]
    order = along_normal(directions, positions)
    return file.pixel_array[order], dicom_lattice(directions, [positions[n] for n in order],
                                                  groups.PixelMeasuresSequence[0].PixelSpacing)


# ------------------------------------------------------------------------------------------------ TIFF

def write_imagej(path, data, lattice):
    text = ("ImageJ=1.53t\nimages=%d\nslices=%d\nunit=%s\nspacing=%r\nxorigin=%r\nyorigin=%r\nzorigin=%r\n"
            % (len(data), len(data), lattice.unit, float(lattice.spacing[2]), *(-lattice.origin / lattice.spacing).tolist()))
    with tifffile.TiffWriter(str(path)) as tiff:
        for k, plane in enumerate(data):
            tiff.write(plane, contiguous=False, metadata=None, description=text if k == 0 else None,
                       resolution=tuple(1 / lattice.spacing[:2]))


def read_imagej(path):
    with tifffile.TiffFile(str(path)) as tiff:
        stated = tiff.imagej_metadata
        x, y = (tiff.pages[0].tags[name].value for name in ("XResolution", "YResolution"))
        spacing = np.array([x[1] / x[0], y[1] / y[0], float(stated.get("spacing", 1))])
        origin = -np.array([float(stated.get(f"{a}origin", 0)) for a in "xyz"]) * spacing
        unit = {"micron": "um", "\\u00B5m": "um", "pixel": ""}.get(stated.get("unit", ""), stated.get("unit", ""))
        return tiff.asarray().reshape((-1, *tiff.pages[0].shape)), Lattice(np.diag(spacing), origin, unit)


def write_ome_tiff(path, data, lattice):
    unit = {"um": "µm", "angstrom": "Å"}.get(lattice.unit, lattice.unit)
    sizes = {f"PhysicalSize{a}": float(s) for a, s in zip("XYZ", lattice.spacing)}
    units = {f"PhysicalSize{a}Unit": unit for a in "XYZ"}
    tifffile.imwrite(str(path), data, ome=True, photometric="minisblack", metadata={"axes": "ZYX", **sizes, **units})


def read_ome_tiff(path):
    with tifffile.TiffFile(str(path)) as tiff:
        pixels = next(e for e in xml.etree.ElementTree.fromstring(tiff.ome_metadata).iter() if e.tag.endswith("}Pixels"))
        unit = pixels.get("PhysicalSizeXUnit", "µm")
        spacing = np.array([float(pixels.get(f"PhysicalSize{a}")) for a in "XYZ"])
        return tiff.asarray(), Lattice(np.diag(spacing), np.zeros(3), {"µm": "um", "Å": "angstrom"}.get(unit, unit))


# ------------------------------------------------------------------------------------------------ Zarr, HDF5, MRC, ICS, VDB

LONG = {"nm": "nanometer", "um": "micrometer", "mm": "millimeter", "cm": "centimeter", "m": "meter", "angstrom": "angstrom"}


def write_ome_zarr(path, data, lattice):
    group = zarr.open_group(str(path), "w")
    group.create_dataset("0", data=data, chunks=(5, 6, 7))
    group.attrs["multiscales"] = [{
        "version": "0.4", "axes": [{"name": a, "type": "space", "unit": LONG[lattice.unit]} for a in "zyx"],
        "datasets": [{"path": "0", "coordinateTransformations": [
            {"type": "scale", "scale": lattice.spacing[::-1].tolist()},
            {"type": "translation", "translation": lattice.origin[::-1].tolist()}]}]}]


def read_ome_zarr(path):
    group = zarr.open_group(str(path), "r")
    stated = group.attrs["multiscales"][0]
    level = stated["datasets"][0]
    spacing, origin = np.ones(3), np.zeros(3)
    for step in level["coordinateTransformations"]:
        if step["type"] == "scale":
            spacing = np.array(step["scale"][::-1])
        else:
            origin = np.array(step["translation"][::-1])
    return (np.asarray(group[level["path"]]),
            Lattice(np.diag(spacing), origin, {v: k for k, v in LONG.items()}.get(stated["axes"][0].get("unit"), "")))


def write_hdf5(path, data, lattice):
    with h5py.File(path, "w") as file:
        made = file.create_dataset("volume", data=data, chunks=(5, 6, 7), compression="gzip")
        made.attrs["spacing"], made.attrs["unit"] = lattice.spacing[::-1], lattice.unit


def read_hdf5(path):
    with h5py.File(path) as file:
        made = file["volume"]
        return made[...], Lattice(np.diag(made.attrs["spacing"][::-1]), np.zeros(3), made.attrs["unit"])


def write_imaris(path, data, lattice):
    text = lambda value: np.array([c.encode() for c in str(value)], "S1")  # noqa: E731
    with h5py.File(path, "w") as file:
        info = file.create_group("DataSetInfo/Image")
        for a, n in enumerate(data.shape[::-1]):
            low = lattice.origin[a] - lattice.spacing[a] / 2
            info.attrs[f"ExtMin{a}"], info.attrs[f"ExtMax{a}"] = text(float(low)), text(float(low + n * lattice.spacing[a]))
            info.attrs["XYZ"[a]] = text(n)
        info.attrs["Unit"] = text(lattice.unit)
        file.create_dataset("DataSet/ResolutionLevel 0/TimePoint 0/Channel 0/Data", data=data, chunks=(5, 6, 7))


def read_imaris(path):
    with h5py.File(path) as file:
        info = {key: b"".join(value).decode() for key, value in file["DataSetInfo/Image"].attrs.items()}
        low, high = (np.array([float(info[f"Ext{end}{a}"]) for a in range(3)]) for end in ("Min", "Max"))
        spacing = (high - low) / [int(info[a]) for a in "XYZ"]
        return (file["DataSet/ResolutionLevel 0/TimePoint 0/Channel 0/Data"][...],
                Lattice(np.diag(spacing), low + spacing / 2, info["Unit"]))


def write_mrc(path, data, lattice):
    header = bytearray(1024)
    struct.pack_into("<4i", header, 0, *data.shape[::-1], 6)
    struct.pack_into("<3i", header, 28, *data.shape[::-1])
    struct.pack_into("<6f", header, 40, *(data.shape[::-1] * lattice.spacing), 90, 90, 90)
    struct.pack_into("<3i", header, 64, 1, 2, 3)
    struct.pack_into("<3f", header, 196, *lattice.origin)
    header[208:216] = b"MAP \x44\x44\0\0"
    path.write_bytes(bytes(header) + data.astype("<u2").tobytes())


def read_mrc(path):
    bytes_ = path.read_bytes()
    size = struct.unpack_from("<3i", bytes_, 0)
    cell, origin = struct.unpack_from("<3f", bytes_, 40), struct.unpack_from("<3f", bytes_, 196)
    return (np.frombuffer(bytes_, "<u2", offset=1024).reshape(size[::-1]),
            Lattice(np.diag(np.divide(cell, size)), np.array(origin, float), "angstrom"))


def write_ics(path, data, lattice):
    unit = {"um": "micrometers", "nm": "nanometers", "mm": "millimeters"}.get(lattice.unit, lattice.unit)
    lines = [["ics_version", "2.0"], ["filename", "image"], ["layout", "order", "bits", "x", "y", "z"],
             ["layout", "sizes", 8, *data.shape[::-1]], ["representation", "format", "integer"], ["representation", "sign", "unsigned"],
             ["representation", "compression", "uncompressed"], ["representation", "byte_order", 1],
             ["parameter", "origin", 0, *map(float, lattice.origin)], ["parameter", "scale", 1, *map(float, lattice.spacing)],
             ["parameter", "units", "bits", *[unit] * 3], ["end"]]
    path.write_bytes(("\t\n" + "".join("\t".join(map(str, words)) + "\n" for words in lines)).encode() + data.astype("u1").tobytes())


def read_ics(path):
    text, voxels = path.read_bytes().split(b"\nend\n", 1)
    lines = [line.split("\t") for line in text.decode().splitlines()[1:]]
    of = {" ".join(words[:2]): words[3:] for words in lines if len(words) > 3}
    unit = {"micrometers": "um", "nanometers": "nm", "millimeters": "mm"}.get(of["parameter units"][0], of["parameter units"][0])
    return (np.frombuffer(voxels, "u1").reshape([int(n) for n in of["layout sizes"]][::-1]),
            Lattice(np.diag([float(s) for s in of["parameter scale"]]), np.array([float(o) for o in of["parameter origin"]]), unit))


def write_vdb(path, data, lattice):
    grid = pyopenvdb.FloatGrid()
    grid.copyFromArray(data.transpose(2, 1, 0).astype(np.float32), tolerance=-1)
    matrix = np.eye(4)  # OpenVDB multiplies row vectors from the left: the rows are the steps and the origin
    matrix[:3, :3], matrix[3, :3] = lattice.steps.T, lattice.origin
    grid.transform = pyopenvdb.createLinearTransform(matrix.tolist())
    grid.name = "density"
    pyopenvdb.write(str(path), grids=[grid])


def read_vdb(path):
    grid = pyopenvdb.readAll(str(path))[0][0]
    low, high = grid.evalActiveVoxelBoundingBox()
    data = np.zeros([h - l + 1 for l, h in zip(low, high)], np.float32)
    grid.copyToArray(data, ijk=low)
    first = np.array(grid.transform.indexToWorld(low))
    steps = [np.array(grid.transform.indexToWorld([v + (a == b) for b, v in enumerate(low)])) - first for a in range(3)]
    return data.transpose(2, 1, 0), Lattice(np.stack(steps, 1), first)
