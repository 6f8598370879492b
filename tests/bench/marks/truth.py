"""Structures with their truth, and scores.

Positions are voxels of the image, x y z, voxel centres at whole numbers; arrays are z y x. Reported lengths are in voxels of the
image's smallest spacing.
"""
import dataclasses
import functools
import math
import os
import pathlib
import zlib

import nibabel
import numpy as np
import tifffile
from scipy import ndimage
from scipy.spatial import cKDTree
from skimage import measure

# ---- structures ----------------------------------------------------------------------------------------------------

@dataclasses.dataclass(eq=False)
class Structure:
    name: str
    image: pathlib.Path
    truth: np.ndarray           # bool [z, y, x]: the inside
    spacing: np.ndarray         # distance of neighbouring voxels along x, y, z, in world units
    options: tuple = ()         # options of covol that the image needs, such as --spacing
    contour_axis: int = 2       # the axis across the slices in which a person draws contours: 0 x, 1 y, 2 z
    large: bool = False         # fewer draws of marks are measured

    @property
    def h(self):
        return float(self.spacing.min())

    @property
    def sizes(self):
        return np.array(self.truth.shape[::-1])

    @functools.cached_property
    def intensities(self):
        return read_array(self.image).astype(np.float32)

    @functools.cached_property
    def surface(self):
        """Vertices and triangles of the truth's 0.5-surface; closed on the image's end faces, half a voxel out."""
        return half_surface(self.truth)

    @functools.cached_property
    def surface_tree(self):
        return cKDTree(self.surface[0] * self.spacing)

    def outlines(self, axis, k):
        """Closed lines around the truth in slice k of an axis, an array of positions each; without parts on end faces."""
        image = np.take(self.truth, k, 2 - axis).astype(np.float32)
        across = [a for a in (2, 1, 0) if a != axis]  # axes along the slice's first and second index
        lines = []
        for line in measure.find_contours(np.pad(image, 1), 0.5):
            positions = np.full((len(line), 3), float(k))
            positions[:, across] = line - 1
            lines.append(positions)
        return lines

    def slices(self, axis):
        """The first and the last slice of an axis that the truth meets."""
        met = np.flatnonzero(self.truth.any(axis=tuple(a for a in range(3) if a != 2 - axis)))
        return met[0], met[-1]


def read_array(path):
    """z y x"""
    if path.name.endswith((".nii", ".nii.gz")):
        return np.asarray(nibabel.load(path).dataobj).transpose(2, 1, 0)
    if path.suffix == ".nrrd":
        return read_nrrd(path)
    return tifffile.imread(path)


def read_nrrd(path):
    """z y x, of a little-endian file with an attached header and gzip encoding."""
    head, _, packed = path.read_bytes().partition(b"\n\n")
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    types = {"uint8": "u1", "unsigned char": "u1", "uint16": "<u2", "int16": "<i2", "short": "<i2", "float": "<f4"}
    sizes = [int(n) for n in fields["sizes"].split()]
    return np.frombuffer(zlib.decompress(packed, 31), types[fields["type"]]).reshape(sizes[::-1])


def tiff_spacing(path):
    with tifffile.TiffFile(path) as file:
        count, length = file.pages[0].tags["XResolution"].value
        return np.array([length / count, length / count, file.imagej_metadata["spacing"]])


def half_surface(mask):
    """Vertices (positions) and triangles of the 0.5-surface."""
    box = ndimage.find_objects(mask)[0]
    vertices, triangles, _, _ = measure.marching_cubes(np.pad(mask[box].astype(np.float32), 1), 0.5)
    return vertices[:, ::-1] - 1 + [s.start for s in box[::-1]], triangles


def structures(data):
    """The structures with a known truth, small ones first."""
    images = pathlib.Path(data) / "images"
    nuclei, _ = ndimage.label(read_array(images / "mouse_embryo_8cell_gt_nuclei.tif") > 0)
    for label in (2, 3, 6):  # the three largest nuclei
        yield Structure(f"embryo nucleus {label}", images / "mouse_embryo_8cell.tif", nuclei == label, np.array([0.8, 0.8, 1.75]),
                        ("--spacing", "0.8,0.8,1.75"))
    image = images / "ovule_nuclei_1135.tif"
    yield Structure("ovule nucleus 27", image, read_array(images / "ovule_nuclei_1135_gt_labels.tif") == 27, tiff_spacing(image))
    medical = [("spinal cord", "mri_spinalcord_t2", "mri_spinalcord_t2_gt", 1, False),
               ("spleen", "ct_spleen", "ct_spleen_gt", 2, False),
               ("brain", "mri_t1_colin27", "mri_t1_colin27_brain", 2, True)]
    for name, image, truth, axis, large in medical:
        file = nibabel.load(images / f"{image}.nii.gz")
        yield Structure(name, images / f"{image}.nii.gz", read_array(images / f"{truth}.nii.gz") > 0,
                        np.array(file.header.get_zooms()[:3], float), (), axis, large)


# (Name, image, file with labels, labels of the structure; empty: all labels). If these voxels form several parts, only
# the largest part is the structure.
MORE = (("hippocampus", "hippocampus_001.nii.gz", "hippocampus_001_gt.nii.gz", ()),
        ("hippocampus, anterior", "hippocampus_001.nii.gz", "hippocampus_001_gt.nii.gz", (1,)),
        ("hippocampus, posterior", "hippocampus_001.nii.gz", "hippocampus_001_gt.nii.gz", (2,)),
        ("left atrium", "la_8M99.nii.gz", "la_8M99_gt.nii.gz", ()),
        ("ventricle", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (43,)),
        ("ventricle, left", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (4,)),
        ("caudate", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (11,)),
        ("caudate, right", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (50,)),
        ("putamen", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (12,)),
        ("hippocampus 2", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (17,)),
        ("brain stem", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (16,)),
        ("thalamus", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (10,)),
        ("corpus callosum", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (251, 252, 253, 254, 255)),
        ("cerebellum", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (7, 8)),
        ("cerebellar white matter", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (7,)),
        ("cortex", "mri_freesurfer.nii.gz", "mri_freesurfer_gt.nii.gz", (42,)),
        ("iliac arteries", "vmtk_aorta.nrrd", "vmtk_aorta_levelset_mask.nrrd", ()),
        ("kidney, cut", "ts_example_ct_sm.nii.gz", "ts_example_seg.nii.gz", (2,)),
        ("liver", "ts_example_ct_sm.nii.gz", "ts_example_seg.nii.gz", (5,)),
        ("vertebra", "ts_example_ct_sm.nii.gz", "ts_example_seg.nii.gz", (31,)),
        ("colon", "ts_example_ct_sm.nii.gz", "ts_example_seg.nii.gz", (20,)),
        ("aorta", "ts_example_ct_sm.nii.gz", "ts_example_seg.nii.gz", (52,)),
        ("mouse nucleus 156", "mouse_nuclei_75.tif", "mouse_nuclei_75_labels.tif", (156,)),
        ("mouse nucleus 395", "mouse_nuclei_75.tif", "mouse_nuclei_75_labels.tif", (395,)),
        ("worm nucleus 59", "stardist_img3d.tif", "stardist_mask3d.tif", (59,)),
        ("worm nucleus 81", "stardist_img3d.tif", "stardist_mask3d.tif", (81,)))


def more_structures(data):
    """Further structures: thin, curved and branched ones, and nuclei that touch."""
    images = pathlib.Path(data) / "images"
    for name, image, truth_file, labels in MORE:
        values = read_array(images / truth_file)
        parts, _ = ndimage.label(np.isin(values, labels) if labels else values > 0, np.ones((3, 3, 3)))
        body = parts == 1 + np.argmax(np.bincount(parts.ravel())[1:])
        yield Structure(name, images / image, body, spacing_of(images / image), large=body.sum() > 200_000)


def by_name():
    """All structures in the folder COVOL_DATA, which must be set."""
    data = os.environ.get("COVOL_DATA")
    if not data:
        raise SystemExit("skipped: COVOL_DATA is not set; it names the folder with the images and their truth")
    return {structure.name: structure for structure in [*structures(data), *more_structures(data)]}


def spacing_of(path):
    """x y z; 1 if the file has none."""
    if path.name.endswith(".nii.gz"):
        return np.array(nibabel.load(path).header.get_zooms()[:3], float)
    if path.suffix == ".nrrd":
        head = path.read_bytes().partition(b"\n\n")[0].decode()
        vectors = head.split("space directions: ")[1].splitlines()[0].split()
        return np.array([np.linalg.norm([float(x) for x in v.strip("()").split(",")]) for v in vectors])
    try:
        return tiff_spacing(path)
    except (KeyError, TypeError):
        return np.ones(3)


# ---- outlines ------------------------------------------------------------------------------------------------------

def off_end_faces(structure, positions):
    return ((positions > 0) & (positions < structure.sizes - 1)).all(1)


class Lines:
    """The outlines of a slice, parametrised by their length in the world."""

    def __init__(self, structure, lines):
        starts, ends, lengths = [], [], []
        for line in lines:
            keep = off_end_faces(structure, line[:-1]) & off_end_faces(structure, line[1:])
            starts.append(line[:-1][keep])
            ends.append(line[1:][keep])
            lengths.append(np.linalg.norm((ends[-1] - starts[-1]) * structure.spacing, axis=1))
        self.starts, self.ends, self.lengths = (np.concatenate(x) if x else np.empty((0, 3)) for x in (starts, ends, lengths))
        self.total = float(self.lengths.sum())

    def at(self, way):
        """Positions at these lengths from the beginning, modulo the total length."""
        ends = np.cumsum(self.lengths)
        way = np.asarray(way, float) % self.total
        n = np.minimum(np.searchsorted(ends, way), len(ends) - 1)
        fraction = 1 - (ends[n] - way) / self.lengths[n]
        return self.starts[n] + fraction[:, None] * (self.ends[n] - self.starts[n])

    def even(self, count, first=0.0):
        """`count` positions at equal distances; `first`: offset of the first one, in [0,1) of the distance."""
        return self.at((np.arange(count) + first) / count * self.total)


# ---- scores --------------------------------------------------------------------------------------------------------

def dice(one, other):
    return float(2 * np.count_nonzero(one & other) / (np.count_nonzero(one) + np.count_nonzero(other)))


def score(structure, mask):
    """Dice, and the larger of the two directed 95 % distances between the surfaces; 0 and no distance if the mask is empty."""
    if mask is None or not mask.any():
        return {"dice": 0.0, "p95": math.inf}
    vertices = half_surface(mask)[0] * structure.spacing
    there = structure.surface_tree.query(some(vertices))[0]
    back = cKDTree(vertices).query(some(structure.surface_tree.data))[0]
    return {"dice": dice(mask, structure.truth), "p95": max(float(np.percentile(d, 95)) for d in (there, back)) / structure.h}


def some(positions, enough=20_000):
    """Every n-th point, as many as a percentile needs."""
    return positions[::max(1, len(positions) // enough)]
