"""Arrays with any strides and number type give the same image, and are copied only if necessary."""
import numpy as np
import pytest

import covol


def segment(array, like):
    """Some steps of a flow that depends on the image's edges."""
    return covol.segment(array, spacing=like.spacing, origin=like.origin, voxel_size="2vx", init="sphere:0,0,0,0.75",
                         coarse_levels=0, max_steps=4, delta="0.5vx").mask


@pytest.fixture(scope="module")
def expected(sphere):
    """The voxels of the sphere, 0 to 127, which every number type represents."""
    mask = segment(sphere[0].array // 2, sphere[0])
    # The test is only meaningful if the image changes the result.
    assert not np.array_equal(mask, segment(np.roll(sphere[0].array, 3, 0), sphere[0]))
    return mask


def strided(array, kind):
    """The same values with other strides and byte orders."""
    if kind == "fortran":
        return np.asfortranarray(array)
    if kind == "negative":
        return array[::-1, ::-1, ::-1].copy()[::-1, ::-1, ::-1]
    if kind == "every second":
        wide = np.zeros([2 * n for n in array.shape], array.dtype)
        wide[::2, ::2, ::2] = array
        return wide[::2, ::2, ::2]
    if kind == "transposed":
        return array.transpose(2, 0, 1).copy().transpose(1, 2, 0)
    if kind == "a field of records":
        records = np.zeros(array.shape, [("other", "u1"), ("value", array.dtype)])
        records["value"] = array
        return records["value"]
    raise ValueError(kind)


@pytest.mark.parametrize("kind", ["fortran", "negative", "every second", "transposed", "a field of records"])
@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_strides(sphere, expected, kind, dtype):
    array = strided((sphere[0].array // 2).astype(dtype), kind)
    assert np.array_equal(segment(array, sphere[0]), expected)


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int16", "uint32", "int32", "int64", "uint64", "float16", "float64",
                                   ">i2", ">f4"])
def test_number_types(sphere, expected, dtype):
    assert np.array_equal(segment((sphere[0].array // 2).astype(dtype), sphere[0]), expected)


def test_bools(sphere):
    image, _, labels = sphere
    assert np.array_equal(segment(labels > 0, image), segment(labels, image))


@pytest.mark.parametrize("kind", [None, "fortran", "negative", "every second"])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "float64"])
def test_no_copy_where_none_is_needed(kind, dtype):
    array = np.arange(2 * 3 * 4).reshape(2, 3, 4).astype(dtype)
    if kind:
        array = strided(array, kind)
    seen = covol.Image(array).array
    assert seen.strides == array.strides and seen.dtype == array.dtype
    assert seen.__array_interface__["data"][0] == array.__array_interface__["data"][0]
    assert np.array_equal(seen, array)
    array[1, 2, 3] = 99
    assert seen[1, 2, 3] == 99
    with pytest.raises(ValueError):
        seen[0, 0, 0] = 1


def test_an_image_keeps_its_array():
    image = covol.Image(np.full((3, 4, 5), 7, np.uint16))
    view = image.array
    del image
    assert view.shape == (3, 4, 5) and np.all(view == 7)


def test_large_integers_become_doubles():
    array = np.zeros((2, 2, 2), np.int64)
    array[1, 0, 1] = 2**40
    assert covol.Image(array).array[1, 0, 1] == 2.0**40
    assert covol.Image(array // 2**20).dtype == np.int32


@pytest.mark.parametrize("array, word", [
    (np.zeros((4, 4)), "three axes"), (np.zeros((0, 4, 4)), "voxels"), (np.zeros((1, 4, 4)), "two voxels"),
    (np.zeros((2, 2, 2), complex), "complex128"),
    (np.array([[["a"]]]), "image"), (np.full((2, 2, 2), np.nan), "NaN"), ("no such file.tif", "no such file"),
])
def test_what_is_no_image(array, word):
    with pytest.raises(covol.Error, match=word):
        covol.segment(array, [[0, 0, 0]])


def test_results_are_arrays(solved, sphere):
    image, mask = sphere[0], solved.mask
    assert mask.dtype == np.uint8 and mask.shape == image.shape and set(np.unique(mask)) == {0, 1}
    assert mask.flags.writeable and not solved.mesh.vertices.flags.writeable
    mesh = solved.mesh
    assert mesh.vertices.dtype == np.float32 and mesh.vertices.shape[1] == 3
    assert mesh.faces.dtype == np.uint32 and mesh.faces.max() == len(mesh.vertices) - 1
    again = covol.Mesh(mesh.vertices, mesh.faces)
    assert again.measure() == mesh.measure() and again.measure()["closed"]
    normals = mesh.normals
    outward = ((mesh.vertices - mesh.vertices.mean(0)) * normals).sum(1)
    assert outward.min() > 0  # the mesh is a sphere, so that its normals point away from the centre

