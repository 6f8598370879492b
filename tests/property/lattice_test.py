"""Any affine map from voxels to the world is a lattice: read from every format that can represent it, and written back.

    COVOL=build/bin/covol PYTHONPATH=build/python python3 -m pytest tests/property/lattice_test.py
    COVOL_LATTICES=1000 ...            # this many lattices instead of 30
    COVOL_LATTICES=1000:250:500 ...    # lattices 250 to 499 of these

Each lattice depends only on its number: spacings, rotation, order of axes, mirrors, shear, position, unit. Formats that store no
shear, or no directions, get the nearest lattice that they can store. Files are written and read without covol by lattice_files.py.
Every lattice is read from every format. Formats that store the same lattices take turns at writing it back.
"""
import collections
import os
import pathlib
import shutil
import subprocess
import tempfile

import pytest

pytest.importorskip("nibabel", reason="see tests/install_packages.sh")
import numpy as np  # noqa: E402

import covol  # noqa: E402
import lattice_files as files  # noqa: E402
from lattice_body import SIZE, VOXELS_OF_BODY, image, indices, level, rotation, write_body  # noqa: E402
from lattice_files import Lattice  # noqa: E402

PROGRAM = os.environ.get("COVOL", "build/bin/covol")
COUNT, FIRST, LAST = [*map(int, os.environ.get("COVOL_LATTICES", "30").split(":")), 0, 0][:3]

# As docs/formats.md states for origins and sheared lattices: the maximum coordinate of the origin in voxels, and the
# minimum volume of a voxel with edges of length 1.
MAX_VOXELS, MIN_VOLUME = 2.0 ** 32, 0.05


def draw(number):
    rng = np.random.default_rng([46, number])
    spacing = 10 ** rng.uniform(-2, 3) * rng.uniform(1, 5, 3)
    steps = np.eye(3)
    if rng.random() < 0.5:  # shear, which rarely is so strong that it must be refused
        steps += np.triu(rng.normal(0, 0.7, (3, 3)), 1)
        steps /= np.linalg.norm(steps, axis=0)
    steps = steps[:, rng.permutation(3)] * rng.choice([-1, 1], 3)
    if rng.random() < 0.75:
        steps = rotation(rng) @ steps
    way = rng.normal(size=3)
    origin = way / np.linalg.norm(way) * 10 ** rng.uniform(-1, 7)
    return Lattice(steps * spacing, origin, str(rng.choice(["um", "mm", "m", "nm", "cm"])))


# By name: end of the file's name, writer and reader without covol, the lattices that it can store, and its units.
Format = collections.namedtuple("Format", "ending write read hold units")
ANY, UPRIGHT, SPACING = (lambda g: g), Lattice.upright, (lambda g: g.upright(origin=False))
FORMATS = {
    "NIfTI, sform": Format(".nii.gz", files.write_nifti, files.read_nifti, ANY, ("um", "mm", "m")),
    "NIfTI, qform": Format(".nii", lambda *a: files.write_nifti(*a, form="q"), files.read_nifti, Lattice.rotated, ("um", "mm", "m")),
    "NRRD": Format(".nrrd", files.write_nrrd, files.read_nrrd, ANY, ("nm", "um", "mm", "cm", "m")),
    "NRRD in RAS": Format(".nrrd", lambda *a: files.write_nrrd(*a, "right-anterior-superior"), files.read_nrrd, ANY, ("mm",)),
    "NRRD in LAS": Format(".nrrd", lambda *a: files.write_nrrd(*a, "left-anterior-superior"), files.read_nrrd, ANY, ("um",)),
    "MetaImage": Format(".mha", files.write_metaimage, files.read_metaimage, ANY, ("",)),
    "DICOM series": Format("", files.write_dicom_series, files.read_dicom_series, Lattice.tilted, ("mm",)),
    "DICOM frames": Format(".dcm", files.write_dicom_frames, files.read_dicom_frames, Lattice.tilted, ("mm",)),
    "ImageJ": Format(".tif", files.write_imagej, files.read_imagej, UPRIGHT, ("nm", "um", "mm", "cm", "m")),
    "OME-TIFF": Format(".ome.tif", files.write_ome_tiff, files.read_ome_tiff, SPACING, ("nm", "um", "mm", "cm", "m")),
    "OME-Zarr": Format(".zarr", files.write_ome_zarr, files.read_ome_zarr, UPRIGHT, ("nm", "um", "mm", "cm", "m")),
    "HDF5": Format(".h5", files.write_hdf5, files.read_hdf5, SPACING, ("nm", "um", "mm", "cm", "m")),
    "Imaris": Format(".ims", files.write_imaris, files.read_imaris, UPRIGHT, ("nm", "um", "mm", "m")),
    "MRC": Format(".mrc", files.write_mrc, files.read_mrc, UPRIGHT, ("angstrom",)),
    "ICS": Format(".ics", files.write_ics, files.read_ics, UPRIGHT, ("nm", "um", "mm", "m")),
    "OpenVDB": Format(".vdb", files.write_vdb, files.read_vdb, ANY, ("",)),
}
# For each format in which masks are written, its reader and the lattices that it stores.
MASKS = {
    ".nrrd": (files.read_nrrd, ANY), ".mha": (files.read_metaimage, ANY), ".nii.gz": (files.read_nifti, ANY),
    ".tif": (files.read_imagej, UPRIGHT), ".zarr": (files.read_ome_zarr, UPRIGHT), ".ome.tif": (files.read_ome_tiff, SPACING),
}


def stores_exactly(lattice, hold):
    """Whether a format that stores `hold` of a lattice stores all of it."""
    other = hold(lattice)
    return np.allclose(other.steps, lattice.steps, rtol=0, atol=1e-9 * lattice.spacing.max()) and \
        np.allclose(other.origin, lattice.origin)


def refusal(lattice):
    """Part of the error message for a lattice that must not be read, otherwise None."""
    if abs(np.linalg.det(lattice.steps / lattice.spacing)) < MIN_VOLUME:
        return "nearly parallel"
    if np.abs(lattice.origin).max() > MAX_VOXELS * lattice.spacing.min():
        return "farther away, neighbouring voxels cannot be distinguished"
    return None


def shift(a, b):
    """Largest distance, in voxels, between the images' corners under two lattices that should be equal."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (SIZE - 1)
    return np.abs(b.index(a.world(corners)) - corners).max()


def moments(data, lattice):
    """Volume, centroid and covariance of the bright voxels."""
    places = lattice.world(np.argwhere(data.transpose(2, 1, 0) >= 140))
    return len(places) * abs(np.linalg.det(lattice.steps)), places.mean(0), np.cov(places.T)


def same_body(found, truth):
    """Differences in voxels of the true lattice: of volume (cube root), centroid, covariance (square root)."""
    volume, centroid, covariance = moments(*found)
    true_volume, true_centroid, true_covariance = moments(*truth)
    inverse = np.linalg.inv(truth[1].steps)
    return (abs(np.cbrt(volume / true_volume) - 1) * np.cbrt((truth[0] >= 140).sum()),
            np.abs(inverse @ (centroid - true_centroid)).max(),
            np.sqrt(np.abs(inverse @ (covariance - true_covariance) @ inverse.T).max()))


class Trial:
    """One lattice in one format."""

    def __init__(self, folder, number, name):
        self.folder, self.name, self.format = folder, name, FORMATS[name]
        drawn = draw(number)
        alike = [other for other in FORMATS if FORMATS[other].hold is self.format.hold]
        self.is_written_back = alike[number % len(alike)] == name
        self.rng = np.random.default_rng([47, number, list(FORMATS).index(name)])
        drawn.unit = drawn.unit if drawn.unit in self.format.units else str(self.rng.choice(self.format.units))
        self.lattice = self.format.hold(drawn)
        self.path = folder / ("image" + self.format.ending)

    def clear(self):
        for path in self.folder.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def run(self):
        """"read", "refused", or what became of a mask on the lattice."""
        self.format.write(self.path, image(), self.lattice)
        truth, lattice = self.format.read(self.path)
        assert np.array_equal(np.sort(truth.ravel()), np.sort(image().ravel()))
        expected = refusal(lattice)
        if expected:
            with pytest.raises(covol.Error) as caught:
                covol.read_image(self.path)
            assert expected in str(caught.value), str(caught.value)
            return "refused"
        read = covol.read_image(self.path)
        found = Lattice(np.asarray(read.direction) * read.spacing, np.array(read.origin), read.unit)
        if self.format.units != ("",):
            assert found.unit == lattice.unit, (found.unit, lattice.unit)
        differences = same_body((np.asarray(read.array), found), (truth, lattice))
        # libtiff stores the resolution in single precision, and ImageJ stores the origin in voxels, so that the world
        # position of a distant origin is inexact.
        far = 1.2e-7 * np.abs(lattice.origin / lattice.spacing).max() if self.name == "ImageJ" else 0
        assert max(differences) < 0.01 + far, differences
        # The values are compared voxel by voxel, whatever the order and direction of axes.
        places = lattice.index(found.world(indices()))
        at = np.round(places).astype(int)
        assert np.abs(places - at).max() < 0.01 + far
        np.testing.assert_array_equal(np.asarray(read.array), truth[tuple(at[..., a] for a in (2, 1, 0))])
        return self.write_back(found) if self.is_written_back else "read"

    def write_back(self, lattice):
        """A mask of the body on the lattice."""
        body = self.folder / "body.vdb"
        write_body(body, self.lattice)
        endings = [ending for ending, (_, hold) in MASKS.items() if stores_exactly(lattice, hold) or self.rng.random() < 0.1]
        ending = str(self.rng.choice(endings))
        read, hold = MASKS[ending]
        mask = self.folder / ("mask" + ending)
        done = subprocess.run([PROGRAM, "mask", body, "--like", self.path, "-o", mask], capture_output=True, text=True)
        if not stores_exactly(lattice, hold):
            assert "covol: warning" in done.stderr or done.returncode == 3, done.stderr
            return "not held by " + ending
        if done.returncode == 3:
            assert ending == ".nii.gz" and "single precision" in done.stderr, done.stderr
            return "refused as " + ending
        assert done.returncode == 0, done.stderr
        data, written = read(mask)
        moved = shift(written, lattice)
        if ending == ".nii.gz" and "single precision" in done.stderr:
            assert 0.005 < moved < 0.6, moved
            return "warned of as " + ending
        assert moved < 0.01, (moved, done.stderr)
        levels = level(self.lattice.index(lattice.world(indices())))
        wrong = (data > 0) != (levels < 0)
        assert not wrong[np.abs(levels) > 0.1 * VOXELS_OF_BODY].any(), (wrong.sum(), np.abs(levels[wrong]).max())
        return "back as " + ending


@pytest.mark.parametrize("name", FORMATS)
def test_any_lattice(name):
    counts = collections.Counter()
    with tempfile.TemporaryDirectory(prefix="covol-lattice-") as folder:
        for number in range(FIRST, LAST or COUNT):
            trial = Trial(pathlib.Path(folder), number, name)
            try:
                counts[trial.run()] += 1
            except Exception as error:
                raise AssertionError(f"{name}, lattice {number}, {trial.lattice}: {error}") from error
            trial.clear()
    print(name, dict(sorted(counts.items())))
    assert sum(counts.values()) - counts["refused"] >= 0.5 * sum(counts.values())
