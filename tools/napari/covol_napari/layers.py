"""Converts napari's layers to inputs of covol, and results to layers.

This module does not need napari: a layer is any object with `data` and the attributes of its transform, and results are napari's
layer-data tuples. napari's world is z, y, x; covol's is x, y, z; otherwise they are the same.
"""
import numpy as np

import covol

ELLIPSE_POINTS = 48


def transform_of(layer):
    """4 x 4 matrix from the last three axes of a layer's data (z, y, x) to napari's world.

    Composes the layer's scale, shear, rotation and translation in this order, then its affine, as napari does.
    """
    scale = _last(getattr(layer, "scale", None), 1.0)
    matrix = np.eye(4)
    matrix[:3, :3] = _square(getattr(layer, "rotate", None)) @ _shear(getattr(layer, "shear", None)) @ np.diag(scale)
    matrix[:3, 3] = _last(getattr(layer, "translate", None), 0.0)
    affine = getattr(layer, "affine", None)
    if affine is not None:
        full = np.asarray(getattr(affine, "affine_matrix", affine), float)
        if full.shape[0] < 4:
            raise covol.Error(f"covol: expected a layer of three axes, got {full.shape[0] - 1}", "invalid_input", "affine")
        last = np.eye(4)
        last[:3, :3], last[:3, 3] = full[-4:-1, -4:-1], full[-4:-1, -1]
        matrix = last @ matrix
    return matrix


def _last(values, missing):
    """The values of the last three axes."""
    if values is None:
        return np.full(3, missing)
    values = np.asarray(values, float)
    return np.concatenate([np.full(max(0, 3 - len(values)), missing), values[-3:]])


def _square(matrix):
    whole = np.eye(3)
    if matrix is not None:
        given = np.asarray(matrix, float)[-3:, -3:]
        whole[3 - len(given):, 3 - len(given):] = given
    return whole


def _shear(shear):
    """The shear matrix, given as a matrix, or as the values above the diagonal in row-major order."""
    if shear is None:
        return np.eye(3)
    given = np.asarray(shear, float)
    if given.ndim == 1:
        n = int(round((1 + np.sqrt(1 + 8 * len(given))) / 2))
        given, values = np.eye(n), given
        given[np.triu_indices(n, 1)] = values
    return _square(given)


def geometry_of(layer):
    """spacing, origin and direction of an image layer, as for covol.segment()."""
    matrix = transform_of(layer)
    turned = matrix[:3, :3][::-1, ::-1]
    spacing = np.linalg.norm(turned, axis=0)
    return {"spacing": spacing, "origin": matrix[:3, 3][::-1], "direction": turned / spacing}


def voxels_of(layer, step=()):
    """(nz, ny, nx) voxels of an image or labels layer; of layers with more axes, those at the viewer's `step`."""
    data = layer.data
    if getattr(layer, "multiscale", False):
        data = data[0]
    if getattr(layer, "rgb", False) or data.ndim < 3:
        raise covol.Error(f"covol: expected an image of three axes and one channel, got shape {tuple(data.shape)}",
                          "invalid_input", "image")
    for axis in range(data.ndim - 3):
        data = data[int(step[axis]) if axis < len(step) else 0]
    return np.asarray(data)


def world_of(layer, positions, step=()):
    """(n, 3), x, y, z in the world, of positions in a layer's data; if there are more axes, those at the viewer's `step`."""
    positions = np.asarray(positions, float)
    if positions.ndim != 2 or positions.shape[1] < 3:
        raise covol.Error(f"covol: expected marks with three coordinates, got shape {positions.shape}", "invalid_input",
                          "points")
    for axis, index in enumerate(step[: positions.shape[1] - 3]):
        positions = positions[np.round(positions[:, axis]) == index]
    matrix = transform_of(layer)
    return (positions[:, -3:] @ matrix[:3, :3].T + matrix[:3, 3])[:, ::-1]


def lines_of(layer, step=()):
    """The contents of a shapes layer: (closed outlines, other marks), both x, y, z in the world."""
    closed, marks = [], []
    kinds = layer.shape_type
    for n, corners in enumerate(layer.data):
        kind = kinds if isinstance(kinds, str) else kinds[n]
        if kind == "ellipse":  # napari stores an ellipse as the corners of its bounding box
            middle, a, b = np.mean(corners, 0), (corners[1] - corners[0]) / 2, (corners[3] - corners[0]) / 2
            t = np.linspace(0, 2 * np.pi, ELLIPSE_POINTS, endpoint=False)[:, None]
            corners = middle + np.cos(t) * a + np.sin(t) * b
        elif kind == "rectangle":  # densified, because the smooth surface through the corners alone would be rounded
            corners = np.concatenate([np.linspace(corners[c], corners[(c + 1) % 4], 12, endpoint=False) for c in range(4)])
        line = world_of(layer, corners, step)
        if len(line):
            (closed if kind in ("polygon", "rectangle", "ellipse") else marks).append(line)
    return closed, np.concatenate(marks) if marks else np.zeros((0, 3))


def segment(image, points=None, shapes=None, labels=None, labels_as="painted", suggestions=3, step=(), **options):
    """Runs covol on layers. @return layer-data tuples: Labels, Surface and, if there are any, suggested Points.

    labels_as: "painted" (some slices, or strokes), "guess" (another result that is corrected by the marks) or "init" (a start).
    """
    marks = [world_of(points, points.data, step)] if points is not None else []
    given = dict(options)
    if shapes is not None:
        outlines, more = lines_of(shapes, step)
        marks.append(more)
        if outlines:
            given["contours"] = outlines
    if labels is not None:
        given[labels_as] = covol.Image(voxels_of(labels, step), **geometry_of(labels))
    marks = np.concatenate(marks) if marks else None
    if marks is not None and len(marks):
        given.update(points=marks, points_space="world", points_order="xyz")
    result = covol.segment(voxels_of(image, step), **geometry_of(image), **given)
    name = getattr(image, "name", "image")
    return layers_of(result, transform_of(image), name, suggestions, units_of(image))


def units_of(layer):
    """Units of a layer's last three axes, in napari from 0.5.5; None in older versions."""
    units = getattr(layer, "units", None)
    return None if units is None or len(units) < 3 else tuple(units[-3:])


def layers_of(result, transform, name, suggestions=0, units=None):
    """@param transform  from the image's data to napari's world @param units  of its three axes, for the scale bar"""
    mesh = result.mesh
    about = {"metadata": {"covol": result.report}, **({} if units is None else {"units": units})}
    made = [
        (result.mask, {"name": f"{name} covol", "affine": transform, **about}, "labels"),
        # napari's world is z, y, x. Reversing the coordinates is a reflection, which would turn the triangles inside out; their corners
        # are reversed, too, so that the normals still point outwards.
        ((mesh.vertices[:, ::-1].copy(), mesh.faces[:, ::-1].astype(np.int64)), {"name": f"{name} covol surface", **about}, "surface"),
    ]
    found = result.suggest(suggestions) if suggestions > 0 else []
    if found:
        made.append((np.array([s.world[::-1] for s in found]),
                     {"name": f"{name} suggested marks", "features": {"slice": [s.slice for s in found],
                                                                      "area": [s.area for s in found]},
                      "face_color": "yellow", "size": 5 * result.surface.voxel_size, **about}, "points"))
    return made


def show(viewer, made):
    """Adds layer-data tuples to a viewer: to the layers of the last result of the same name, which keep their place, colours and
    visibility, or as new layers. Outdated suggestions are removed.
    """
    for data, meta, kind in made:
        last = _shown(viewer, meta["name"], kind)
        if last is None:
            getattr(viewer, "add_" + kind)(data, **meta)
            continue
        last.data = data
        for key in ("affine", "features", "metadata"):
            if key in meta:
                setattr(last, key, meta[key])
    if made and not any(kind == "points" for _, _, kind in made):
        gone = _shown(viewer, made[0][1]["name"].removesuffix(" covol") + " suggested marks", "points")
        if gone is not None:
            viewer.layers.remove(gone)


def _shown(viewer, name, kind):
    """The layer of that name and kind that contains a result; layers of the user are not considered."""
    for layer in viewer.layers:
        if layer.name == name and type(layer).__name__.lower() == kind and "covol" in layer.metadata:
            return layer
    return None
