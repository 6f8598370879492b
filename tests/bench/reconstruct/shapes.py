"""Truth meshes with thin parts, branches, handles: closed, in one piece, of known genus.

Shapes are zero sets of signed functions f (negative inside; lengths in the shape's own unit, its longest side about 2), meshed by
marching cubes; the vertices are then moved onto f = 0. Tubes around closed curves are meshed along the curve.
"""
import pathlib

import numpy as np
from skimage.measure import marching_cubes

import ply

# Cells along the edge of a block. f is evaluated at every node only in blocks that its zero level may cross.
BLOCK = 8


# ---- signed functions: f(p), p an array (..., 3) ---------------------------------------------------------------------

def ellipsoid(p, center, axes):
    """Signed distance to an ellipsoid, to first order near its surface."""
    q = (p - np.asarray(center, p.dtype)) / np.asarray(axes, p.dtype)
    length = np.sqrt((q * q).sum(-1)) + 1e-9
    gradient = np.sqrt(((q / np.asarray(axes, p.dtype)) ** 2).sum(-1)) + 1e-9
    return length * (length - 1) / gradient


def cone(p, a, b, radius_a, radius_b):
    """A tapering capsule from a to b."""
    a, b = np.asarray(a, p.dtype), np.asarray(b, p.dtype)
    t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    away = p - a - t[..., None] * (b - a)
    return np.sqrt((away * away).sum(-1)) - (radius_a + t * p.dtype.type(radius_b - radius_a))


def path(p, knots, radii):
    """Tapering capsules along a polyline; they meet in a ball at each knot."""
    pieces = zip(knots, knots[1:], radii, radii[1:])
    return np.minimum.reduce([cone(p, *piece) for piece in pieces])


def bent(start, pull, end, count=12):
    """Knots of a quadratic Bezier curve."""
    t = np.linspace(0, 1, count + 1)[:, None]
    return (1 - t) ** 2 * np.array(start) + 2 * t * (1 - t) * np.array(pull) + t ** 2 * np.array(end)


def union(a, b, blend):
    """The minimum of both; the seam is rounded where they differ by less than `blend`."""
    h = np.maximum(blend - np.abs(a - b), 0) / blend
    return np.minimum(a, b) - h * h * (blend / 4)


def without(a, b, blend):
    return -union(-a, b, blend)


def sphere(p):
    return ellipsoid(p, (0, 0, 0), (1, 1, 1))


def head(p):
    f = union(ellipsoid(p, (0, 0, 0), (0.42, 0.5, 0.46)), ellipsoid(p, (0, 0.42, -0.18), (0.24, 0.3, 0.2)), 0.15)
    for side in (-1, 1):
        horn = bent((side * 0.22, -0.05, 0.36), (side * 0.85, -0.25, 0.7), (side * 0.5, 0.1, 1.35), 16)
        f = union(f, path(p, horn, np.linspace(0.105, 0.014, len(horn))), 0.06)
        ear = bent((side * 0.36, -0.1, 0.1), (side * 0.6, -0.1, 0.2), (side * 0.85, -0.2, 0.05), 6)
        # An ear is a tube in coordinates that are stretched 2.2 times along y, so that it is flat in world coordinates.
        flat = (p - np.array([0, -0.13, 0], p.dtype)) * np.array([1, 2.2, 1], p.dtype)
        f = union(f, path(flat, ear - [0, -0.13, 0], np.array([0.05, 0.09, 0.12, 0.12, 0.1, 0.07, 0.03])) / 2.2, 0.04)
    return f


def creature(p):
    f = path(p, np.array([(-0.55, 0, 0.62), (0, 0, 0.6), (0.45, 0, 0.66)]), (0.2, 0.23, 0.19))
    f = union(f, path(p, np.array([(0.45, 0, 0.7), (0.72, 0, 1.0)]), (0.12, 0.08)), 0.1)
    f = union(f, path(p, np.array([(0.72, 0, 1.02), (0.98, 0, 0.94)]), (0.13, 0.07)), 0.06)
    for side in (-1, 1):
        f = union(f, path(p, np.array([(0.7, side * 0.08, 1.1), (0.66, side * 0.14, 1.26)]), (0.04, 0.015)), 0.03)
        for hip, knee, foot in ((-0.5, -0.56, -0.54), (0.4, 0.45, 0.42)):
            leg = np.array([(hip, side * 0.14, 0.5), (knee, side * 0.17, 0.22), (foot, side * 0.18, -0.1)])
            f = union(f, path(p, leg, (0.045, 0.026, 0.024)), 0.06)
            f = union(f, path(p, np.array([(foot, side * 0.18, -0.11), (foot + 0.11, side * 0.19, -0.125)]), (0.035, 0.028)), 0.02)
    tail = bent((-0.7, 0, 0.7), (-1.05, 0.0, 0.95), (-1.0, 0.25, 0.35), 14)
    return union(f, path(p, tail, np.linspace(0.03, 0.013, len(tail))), 0.04)


def branches():
    """[(knots, radii)] of a tree: each branch bends a little and forks in two, planes of the forks alternating."""
    random = np.random.default_rng(4)
    found = []

    def grow(start, direction, across, length, radius, level):
        middle = start + direction * length / 2
        end = start + direction * length + 0.08 * length * random.normal(size=3)
        found.append((bent(start, middle + 0.1 * length * across, end, 5), np.linspace(radius, max(0.028, 0.8 * radius), 6)))
        if level == 0:
            return
        out = np.cross(direction, across)
        for side, fraction in ((-1, 0.86), (1, 0.74)):
            turned = direction * 0.72 + side * across * 0.7
            turned /= np.linalg.norm(turned)
            grow(end, turned, np.cross(turned, out) * 0.3 + out, length * fraction, max(0.03, 0.74 * radius), level - 1)

    def unit(v):
        return np.array(v, float) / np.linalg.norm(v)

    grow(np.zeros(3), unit((0, 0, 1)), unit((1, 0.2, 0)), 0.62, 0.085, 4)
    return found


def tubes(p):
    f = None
    for knots, radii in branches():
        tube = path(p, knots, radii)
        f = tube if f is None else union(f, tube, 0.02)
    return f


def skull(p):
    """A vault with an inner wall; eyes, nose and the hole at its base open it (genus 3), two cheek arches add handles (2)."""
    outer = union(ellipsoid(p, (0, -0.12, 0.1), (0.68, 0.85, 0.7)), ellipsoid(p, (0, 0.5, -0.35), (0.42, 0.42, 0.42)), 0.2)
    f = np.maximum(outer, -(outer + 0.085))
    for side in (-1, 1):
        f = without(f, cone(p, (side * 0.27, 0.4, -0.12), (side * 0.34, 1.1, -0.08), 0.13, 0.19), 0.03)
        arch = bent((side * 0.36, 0.6, -0.42), (side * 1.1, 0.5, -0.45), (side * 0.56, -0.05, -0.2), 10)
        f = union(f, path(p, arch, np.full(len(arch), 0.042)), 0.05)
    f = without(f, cone(p, (0, 0.6, -0.42), (0, 1.1, -0.45), 0.07, 0.1), 0.03)
    return without(f, cone(p, (0, -0.25, -0.3), (0, -0.25, -0.9), 0.17, 0.19), 0.03)


# ---- meshes ----------------------------------------------------------------------------------------------------------

def mesh_of(f, low, high, resolution=400):
    """Vertices and triangles of f = 0 in a box that the shape does not touch. @pre |grad f| < 1.6

        @param resolution  cells along the longest side
    """
    low = np.array(low, float)
    cell = (high - low).max() / resolution
    blocks = np.ceil((high - low) / (cell * BLOCK)).astype(int)
    corners = np.stack(np.meshgrid(*map(np.arange, blocks), indexing="ij"), -1).reshape(-1, 3) * BLOCK
    middle = f((low + (corners + (BLOCK - 1) / 2) * cell).astype(np.float32))
    near = np.abs(middle) < 1.6 * BLOCK * cell
    values = np.repeat(np.repeat(np.repeat(middle.reshape(blocks), BLOCK, 0), BLOCK, 1), BLOCK, 2)
    inside = np.stack(np.meshgrid(*[np.arange(BLOCK)] * 3, indexing="ij"), -1).reshape(-1, 3)
    for some in np.array_split(corners[near], max(1, near.sum() // 500)):  # in batches, to save memory
        at = some[:, None] + inside
        values[tuple(np.moveaxis(at, -1, 0))] = f((low + at * cell).astype(np.float32))
    vertices, triangles, _, _ = marching_cubes(values, 0, spacing=(cell,) * 3, gradient_direction="descent", allow_degenerate=False)
    vertices = vertices.astype(float) + low
    for _ in range(2):
        vertices -= _step_to_zero(f, vertices, cell)
    return vertices, triangles


def _step_to_zero(f, vertices, cell):
    """A Newton step along the gradient, of at most a quarter of a cell so that no triangle is inverted."""
    h = 0.02 * cell
    gradient = np.stack([f(vertices + h * e) - f(vertices - h * e) for e in np.eye(3)], -1) / (2 * h)
    step = (f(vertices) / np.maximum((gradient ** 2).sum(-1), 0.04))[:, None] * gradient
    length = np.linalg.norm(step, axis=1, keepdims=True)
    return step * np.minimum(1, 0.25 * cell / np.maximum(length, 1e-12))


def tube_about(curve, radius, along, around):
    """A tube around a closed curve, given by positions at t in [0, 2 pi). @pre the curvature is positive everywhere"""
    t = np.arange(along) * (2 * np.pi / along)
    h = 1e-4
    before, here, after = curve(t - h), curve(t), curve(t + h)
    tangent = after - before
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bend = after - 2 * here + before
    bend -= (bend * tangent).sum(1, keepdims=True) * tangent
    bend /= np.linalg.norm(bend, axis=1, keepdims=True)
    other = np.cross(tangent, bend)
    angle = (np.arange(around) * (2 * np.pi / around))[None, :, None]
    vertices = here[:, None] + radius * (np.cos(angle) * bend[:, None] + np.sin(angle) * other[:, None])
    i, j = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    a, b = i * around + j, (i + 1) % along * around + j
    c, d = (i + 1) % along * around + (j + 1) % around, i * around + (j + 1) % around
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, c, b), (a, d, c))])
    return vertices.reshape(-1, 3), triangles


def circle(t):
    return np.stack([0.7 * np.cos(t), 0.7 * np.sin(t), 0 * t], 1)


def trefoil(t):
    return np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -1.2 * np.sin(3 * t)], 1) / 3


def tree_box():
    knots = np.concatenate([knots for knots, _ in branches()])
    return knots.min(0) - 0.1, knots.max(0) + 0.1


OWN = {  # name: function that makes its mesh
    "sphere": lambda: mesh_of(sphere, (-1.05,) * 3, (1.05,) * 3, 160),
    "torus": lambda: tube_about(circle, 0.3, 900, 400),
    "knot": lambda: tube_about(trefoil, 0.16, 2000, 120),
    "head": lambda: mesh_of(head, (-1, -0.65, -0.6), (1, 0.8, 1.45)),
    "creature": lambda: mesh_of(creature, (-1.1, -0.3, -0.2), (1.1, 0.35, 1.3)),
    "tubes": lambda: mesh_of(tubes, *tree_box()),
    "skull": lambda: mesh_of(skull, (-0.95, -1.05, -0.95), (0.95, 1.05, 0.9), 280),
}


def truth(name, folder):
    """Path of the mesh in `folder`; it is made unless it exists and is newer than this file."""
    target = pathlib.Path(folder) / f"{name}.ply"
    if not target.exists() or target.stat().st_mtime < pathlib.Path(__file__).stat().st_mtime:
        target.parent.mkdir(parents=True, exist_ok=True)
        ply.write(target, *OWN[name]())
    return target
