"""Positions of voxels and points, according to SimpleITK and nibabel, against files that nibabel and the program write."""
import subprocess

import nibabel
import numpy as np
import pytest

import covol
from conftest import dice

SPACING, ORIGIN = (0.5, 0.75, 1.25), (10.0, -20.0, 30.0)


def rotation():
    """A rotation about x, y and z; its columns are orthonormal."""
    a, b, c = 0.4, -0.3, 0.7
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return x @ y @ z


def to_world(ijk, spacing, origin, direction):
    """SimpleITK's TransformContinuousIndexToPhysicalPoint: ITK's formula, independent of covol."""
    return np.asarray(origin) + (np.asarray(ijk) * spacing) @ np.asarray(direction).T


@pytest.fixture(scope="module")
def ellipsoid():
    """A body in an image of 30 x 40 x 50 voxels (z, y, x) that is rotated in the world; marks in voxels (i, j, k) and in the world."""
    direction = rotation()
    k, j, i = np.mgrid[0:30, 0:40, 0:50]
    center, radii = np.array([27.0, 18.0, 14.0]), np.array([16.0, 11.0, 8.0])
    r = np.sqrt(((i - center[0]) / radii[0])**2 + ((j - center[1]) / radii[1])**2 + ((k - center[2]) / radii[2])**2)
    labels = (r < 1).astype(np.uint8)
    image = np.clip((1 - r) * 8 * 100 + 128, 0, 255).astype(np.uint8)
    n = np.arange(60) + 0.5
    phi, theta = np.arccos(1 - 2 * n / 60), np.pi * (1 + 5**0.5) * n
    marks = center + radii * np.stack([np.cos(theta) * np.sin(phi), np.sin(theta) * np.sin(phi), np.cos(phi)], 1)
    return image, labels, marks, to_world(marks, SPACING, ORIGIN, direction), direction, center


def test_positions(ellipsoid):
    image, _, marks, world, direction, _ = ellipsoid
    img = covol.Image(image, spacing=SPACING, origin=ORIGIN, direction=direction)
    assert np.allclose(img.index_to_world(marks[:, ::-1]), world, atol=1e-12)
    assert np.allclose(img.world_to_index(world), marks[:, ::-1], atol=1e-12)
    assert img.shape == (30, 40, 50) and img.spacing == SPACING and img.origin == ORIGIN
    # Nine numbers, as GetDirection() of SimpleITK returns.
    flat = covol.Image(image, spacing=SPACING, origin=ORIGIN, direction=tuple(direction.ravel()))
    assert np.array_equal(flat.direction, direction)


def test_a_turned_image(ellipsoid):
    image, labels, _, world, direction, center = ellipsoid
    result = covol.segment(image, world, spacing=SPACING, origin=ORIGIN, direction=direction)
    assert dice(result.mask, labels) > 0.97
    middle = result.mesh.vertices.mean(0)
    assert np.linalg.norm(middle - to_world(center, SPACING, ORIGIN, direction)) < 0.3
    volume = 4 / 3 * np.pi * 16 * 11 * 8 * np.prod(SPACING)
    assert result.report["surface"]["volume"] == pytest.approx(volume, rel=0.03)


def test_points_in_voxels(ellipsoid):
    image, _, marks, world, direction, _ = ellipsoid
    where = {"spacing": SPACING, "origin": ORIGIN, "direction": direction, "voxel_size": 1.0}
    expected = covol.segment(image, world, **where).mask
    for given, space, order in [(marks, "index", "xyz"), (marks[:, ::-1], "index", "zyx"), (marks + 1, "index1", "xyz"),
                                (marks * SPACING, "local", "xyz"), (world * (-1, -1, 1), "ras", "xyz")]:
        mask = covol.segment(image, given, points_space=space, points_order=order, **where).mask
        assert (mask != expected).mean() < 1e-4, (space, order)  # equal up to the rounding of positions


def test_nibabel(tmp_path, ellipsoid, program):
    image, labels, marks, _, direction, _ = ellipsoid
    affine = np.eye(4)  # nibabel's affine maps voxels (i, j, k) to RAS
    affine[:3, :3], affine[:3, 3] = np.diag([-1, -1, 1]) @ direction * SPACING, np.array(ORIGIN) * (-1, -1, 1)
    nifti = nibabel.Nifti1Image(image.T, affine)
    nibabel.save(nifti, tmp_path / "image.nii.gz")
    ras = nibabel.affines.apply_affine(affine, marks)
    masks = [covol.segment(img, ras, points_space="ras", voxel_size=1.0, **more).mask for img, more in [
        (nifti, {}), (image, {"affine": affine}), (tmp_path / "image.nii.gz", {}), (nibabel.load(tmp_path / "image.nii.gz"), {})]]
    assert dice(masks[0], labels) > 0.97
    for mask in masks[1:]:
        assert (mask != masks[0]).mean() < 5e-4  # NIfTI stores the affine in single precision
    read = covol.read_image(tmp_path / "image.nii.gz")
    assert np.array_equal(read.array, image) and np.allclose(read.affine, affine, atol=1e-5)
    covol.save_mask(tmp_path / "mask.nii.gz", masks[0], read)
    again = nibabel.load(tmp_path / "mask.nii.gz")
    assert np.array_equal(np.asanyarray(again.dataobj).T, masks[0]) and np.allclose(again.affine, affine, atol=1e-5)
    done = subprocess.run([program, "info", tmp_path / "mask.nii.gz"], capture_output=True, text=True, check=True)
    assert "50 x 40 x 30" in done.stdout + done.stderr


def test_affine_and_back(ellipsoid):
    image, *_, direction, _ = ellipsoid
    img = covol.Image(image, spacing=SPACING, origin=ORIGIN, direction=direction)
    spacing, origin, turned = covol.from_affine(img.affine)
    assert np.allclose(spacing, SPACING) and np.allclose(origin, ORIGIN) and np.allclose(turned, direction)
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])  # axes that form a left-handed system, which NIfTI allows
    assert covol.segment(image, affine=mirrored, init="sphere:27,-18,14,6").mask[14, 18, 27] == 1


@pytest.mark.parametrize("wrong, field", [
    ({"spacing": (1, 1)}, "spacing"), ({"spacing": (1, 0, 1)}, "spacing"), ({"spacing": "a"}, "spacing"),
    ({"origin": (0, 0, np.nan)}, "origin"), ({"direction": np.ones((3, 3))}, "direction"), ({"direction": np.eye(2)}, "direction"),
    ({"affine": np.eye(3)}, "affine"), ({"affine": np.eye(4), "spacing": (1, 1, 1)}, "affine"),
    ({"affine": np.diag([1.0, 0, 1, 1])}, "affine"),
])
def test_bad_geometry(ellipsoid, wrong, field):
    with pytest.raises(covol.Error) as error:
        covol.segment(ellipsoid[0], ellipsoid[2], **wrong)
    assert error.value.field == field
