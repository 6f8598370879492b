"""Converts arguments of the public functions to types of the extension module."""
import collections.abc
import logging
import os

import numpy as np

from . import _covol
from ._errors import Error

_log = logging.getLogger("covol")


def call(progress=None, threads=0, memory_limit=0):
    """Settings for running a function; automatic choices and warnings are sent to the logger "covol"."""
    if progress is not None and not callable(progress):
        raise Error("progress: expected a function of (stage, fraction)", "invalid_options", "progress")
    return _covol.Call(progress, lambda warns, line: _log.log(logging.WARNING if warns else logging.INFO, line),
                       threads, memory_limit)


def is_path(value):
    return isinstance(value, (str, os.PathLike))


def image(value, spacing=None, origin=None, direction=None, affine=None, name="image"):
    """An Image from an array, a file, an Image or an image of nibabel."""
    if affine is not None:
        if spacing is not None or origin is not None or direction is not None:
            raise Error("affine: expected without spacing, origin and direction", "invalid_options", "affine")
        spacing, origin, direction = from_affine(affine)
    given = {"spacing": spacing, "origin": origin, "direction": direction}
    if is_path(value):
        if origin is not None or direction is not None:
            name = "origin, direction" if affine is None else "affine"
            raise Error(f"{name}: expected for an array, got a file, which has its own", "invalid_options", name.split(",")[0])
        return read_image(value, spacing=spacing)
    if isinstance(value, _covol.Image):
        if all(v is None for v in given.values()):
            return value
        own = {"spacing": value.spacing, "origin": value.origin, "direction": value.direction}
        given = {key: own[key] if v is None else v for key, v in given.items()}
        return _covol.Image(value.array, unit=value.unit, **given)
    if hasattr(value, "affine") and hasattr(value, "dataobj"):  # an image of nibabel: indexed x, y, z, and in RAS
        if all(v is None for v in given.values()):
            given = dict(zip(given, from_affine(value.affine)))
        unit = value.header.get_xyzt_units()[0] if hasattr(value.header, "get_xyzt_units") else ""
        return _covol.Image(np.asanyarray(value.dataobj).T, unit={"micron": "um", "unknown": ""}.get(unit, unit), **given)
    return _covol.Image(value, **given)


def from_affine(affine):
    """Spacing, origin and direction (LPS) of an affine matrix that maps voxels (i, j, k) to RAS, as in nibabel.

    Raises Error if it is not a 4 x 4 matrix, or an axis has zero length.
    """
    matrix = np.asarray(affine, float)
    if matrix.shape != (4, 4):
        raise Error(f"affine: expected shape (4, 4), got {matrix.shape}", "invalid_options", "affine")
    matrix = np.diag([-1.0, -1.0, 1.0, 1.0]) @ matrix
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.all(np.isfinite(matrix)) or np.any(spacing == 0):
        raise Error("affine: expected finite numbers and no axis of length 0", "invalid_input", "affine")
    return spacing, matrix[:3, 3], matrix[:3, :3] / spacing


def to_affine(img):
    """The affine matrix of an Image: voxels (i, j, k) to RAS, as in nibabel."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.asarray(img.direction) * np.asarray(img.spacing)
    matrix[:3, 3] = img.origin
    return np.diag([-1.0, -1.0, 1.0, 1.0]) @ matrix


def read_image(path, *, spacing=None, channel=None, frame=None, roi=None, correct_level_shift=False, progress=None,
               threads=0, memory_limit=0):
    return _covol.read_image(os.fspath(path), spacing, channel, frame, roi, correct_level_shift,
                             call(progress, threads, memory_limit))


def read_points(path, *, points_space=None, points_order=None, points_scale=1.0, points_channels=1):
    return _covol.read_points(os.fspath(path), points_space, points_order, points_scale, points_channels)


def read_study(folder):
    return _covol.read_study(os.fspath(folder))


def read_study_options(folder):
    return _covol.read_study_options(os.fspath(folder))


def points(name, value, reading, lines=False, normals=None):
    """A list of Points from None, a file, Points, several of these, positions or, with `lines`, closed lines of positions."""
    if value is None:
        return []
    if isinstance(value, _covol.Points):
        return [value]
    if is_path(value):
        return [read_points(value, **reading)]
    if isinstance(value, (list, tuple)) and value and all(isinstance(v, _covol.Points) or is_path(v) for v in value):
        return [cloud for v in value for cloud in points(name, v, reading)]  # several files of the same structure
    keywords = (reading["points_space"], reading["points_order"], reading["points_scale"])
    if lines:
        if not isinstance(value, collections.abc.Iterable):
            raise Error(f"{name}: expected a list of lines", "invalid_input", name)
        return [_covol.Points(name, None, list(value), *keywords, True, None)]
    return [_covol.Points(name, value, None, *keywords, True, normals)]


def marks(given, reading, like):
    """The inputs of one structure for segment() except the image, from a dict of its keywords, or from its points."""
    given = given if isinstance(given, collections.abc.Mapping) else {"points": given}
    known = ("points", "contours", "inside", "outside", "guess", "init", "exterior_seed", "painted", "normals")
    for key in given:
        if key not in known:
            raise Error(f"marks: expected one of {', '.join(known[:-1])}, got {key!r}", "invalid_options", "marks")
    values = {key: given.get(key) for key in known}
    normals = values.pop("normals")
    return {"points": points("points", values["points"], reading, normals=normals),
            "contours": points("contours", values["contours"], reading, lines=True),
            "inside": points("inside", values["inside"], reading), "outside": points("outside", values["outside"], reading),
            "guess": like(values["guess"]), "init": like(values["init"]), "exterior_seed": values["exterior_seed"],
            "painted": like(values["painted"])}


def shape(value, **geometry):
    """A start or a guess: a text or a file's path, a LevelSet, a mask."""
    if value is None or isinstance(value, (_covol.LevelSet, _covol.Image, str)):
        return value
    if isinstance(value, _covol.Result):
        return value.surface
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return image(value, **geometry)
