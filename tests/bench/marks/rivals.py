"""Established methods that use the image, the marks, or both, with the same marks as covol.

Random walker, watershed and grow-from-seeds need regions inside and outside, not marks on the border. A person who knows the
border at the marks would paint such regions on both sides of it; here they are made from the variational surface through the
marks: positions deeper than w below it are inside, positions higher than w above it outside. w is the mean distance from that
surface to the nearest mark, since its error may be that large; at least 1.5 voxels, and at most half of the body's greatest depth,
so that some inside is left. The image is smoothed by a Gaussian of one voxel and clipped to its range in the gap (1 % to 99 %).
"""
import dataclasses

import numpy as np
from scipy import interpolate, ndimage, sparse
from scipy.sparse import csgraph
from scipy.spatial import ConvexHull, cKDTree
from skimage.draw import polygon2mask
from skimage.segmentation import random_walker, watershed

from variational import Surface

# If the bounding box of the gap between inner and outer seeds has more voxels, the methods of FROM_SEEDS use every
# second voxel along each axis.
MANY_VOXELS = 1_500_000


# ---- solids from functions ---------------------------------------------------------------------------------------

def where_negative(function, structure, margin):
    """Mask of the voxels where a function of world positions is < 0, in the box of the marks and `margin` (world) around it.

    It is evaluated on a coarse lattice first, and at every voxel only in cells near a change of sign."""
    low, high = margin
    low = np.maximum(np.floor(low / structure.spacing), 0).astype(int)
    high = np.minimum(np.ceil(high / structure.spacing), structure.sizes - 1).astype(int) + 1
    stride = np.maximum(1, np.round(4 * structure.h / structure.spacing)).astype(int)
    if np.prod(high - low) < 100_000:
        stride[:] = 1
    # The lattice ends at or beyond the last voxel, so that every voxel lies in a cell.
    lattice = [np.arange(a, b + s, s) for a, b, s in zip(low, high, stride)]
    coarse = _evaluate(function, structure, lattice)
    if (stride == 1).all():
        inside = coarse[:-1, :-1, :-1]
    else:
        same = ndimage.minimum_filter(coarse.astype(np.uint8), 3) == ndimage.maximum_filter(coarse.astype(np.uint8), 3)
        grow = lambda a: a.repeat(stride[2], 0).repeat(stride[1], 1).repeat(stride[0], 2)
        inside, open_cells = grow(coarse), grow(~same | ~_all_corners(same))
        at = np.argwhere(open_cells)
        inside[tuple(at.T)] = function((at[:, ::-1] + low) * structure.spacing) < 0
    mask = np.zeros(structure.truth.shape, bool)
    n = (high - low)[::-1]
    mask[low[2]:high[2], low[1]:high[1], low[0]:high[0]] = inside[:n[0], :n[1], :n[2]]
    return mask


def _evaluate(function, structure, lattice):
    z, y, x = np.meshgrid(*[structure.spacing[a] * lattice[a] for a in (2, 1, 0)], indexing="ij")
    return (function(np.stack([x.ravel(), y.ravel(), z.ravel()], 1)) < 0).reshape(x.shape)


def _all_corners(lattice):
    """The voxels of the cell that begins at a lattice point."""
    return ndimage.minimum_filter(lattice.astype(np.uint8), 2, origin=-1).astype(bool)


def _box(structure, marks):
    """Bounding box of the marks, extended by a third of its size, world units."""
    world = marks * structure.spacing
    around = (world.max(0) - world.min(0)).max() / 3
    return world.min(0) - around, world.max(0) + around


def variational(structure, marks):
    return where_negative(Surface(marks * structure.spacing), structure, _box(structure, marks))


def convex_hull(structure, marks):
    planes = ConvexHull(marks * structure.spacing).equations

    def height(positions):
        value = np.full(len(positions), -np.inf)
        for *normal, offset in planes:
            np.maximum(value, positions @ np.array(normal) + offset, out=value)
        return value

    return where_negative(height, structure, _box(structure, marks))


# ---- seeds, and what grows from them -----------------------------------------------------------------------------

@dataclasses.dataclass
class Seeds:
    image: np.ndarray   # intensities within `box`, smoothed and scaled to 0 to 1
    labels: np.ndarray  # 1: inside, 2: outside, 0: the gap between them, in which the method decides
    spacing: np.ndarray
    mask: np.ndarray    # the voxels of the whole image with label 1, including those beyond the box
    box: tuple
    step: int           # `image` and `labels` contain every step-th voxel of the box along each axis

    def solid(self, inside):
        """A mask of the whole image from one with the shape of `labels`."""
        mask = self.mask.copy()
        part = mask[self.box]
        for axis in range(3):
            inside = inside.repeat(self.step, axis)
        part[:] = inside[tuple(slice(n) for n in part.shape)]
        return mask


def seeds(structure, marks, guess):
    """@param guess  mask of the variational surface through the marks. @return None if that is empty"""
    spacing = structure.spacing[::-1]
    if not guess.any() or guess.all():
        return None
    # `gap` is at most half of the maximum depth of the guess, and thus at most a quarter of its smallest extent. Voxels
    # that are farther than this from the guess have the label 2, outside, and no distances are computed for them.
    around = ndimage.find_objects(guess)[0]
    room = min((s.stop - s.start) * h for s, h in zip(around, spacing)) / 4 + 3 * structure.h
    around = tuple(slice(max(0, s.start - int(room / h) - 1), s.stop + int(room / h) + 1) for s, h in zip(around, spacing))
    depth = ndimage.distance_transform_edt(guess[around], spacing)
    height = ndimage.distance_transform_edt(~guess[around], spacing)
    border = np.argwhere(guess[around] & (depth <= 1.01 * spacing.max())) + [s.start for s in around]
    gap = cKDTree(marks * structure.spacing).query(border[:, ::-1] * structure.spacing)[0].mean()
    gap = min(max(gap, 1.5 * structure.h), 0.5 * depth.max())
    labels = np.full(guess.shape, 2, np.int8)
    labels[around] = np.where(depth > gap, 1, np.where(height > gap, 2, 0))
    box = tuple(slice(max(0, s.start - 2), s.stop + 2) for s in ndimage.find_objects(labels == 0)[0:1][0])
    step = 2 if labels[box].size > MANY_VOXELS else 1
    image = ndimage.gaussian_filter(structure.intensities[box], structure.h * step / spacing)
    low, high = np.percentile(image[labels[box] == 0], (1, 99))
    image = np.clip((image - low) / max(high - low, 1e-6), 0, 1)
    thin = (slice(None, None, step),) * 3
    return Seeds(image[thin], labels[box][thin].copy(), spacing * step, labels == 1, box, step)


def walk(given):
    """Random walker (Grady 2006) of scikit-image, with its default beta."""
    labels = given.labels.astype(np.int32)
    far = ndimage.minimum_filter(labels, 3) == ndimage.maximum_filter(labels, 3)
    # -1 excludes seeds that do not touch the gap from the linear system, which makes it smaller.
    labels[far & (labels > 0)] = -1
    won = random_walker(given.image, labels, mode="cg_j", spacing=given.spacing / given.spacing.min(), tol=1e-3)
    return given.solid((won == 1) | (given.labels == 1))


def flood(given):
    """Watershed of the gradient magnitude with the seeds as markers, scikit-image's."""
    slope = ndimage.generic_gradient_magnitude(given.image, lambda a, axis, *rest: ndimage.sobel(a, axis) / given.spacing[axis])
    return given.solid(watershed(slope, given.labels.astype(np.int32)) == 1)


def grow(given):
    """Grow from seeds: a voxel belongs to the seed from which the path to it has the smallest change of brightness (the shortest
    paths of the fast GrowCut of Zhu et al., as in 3D Slicer)."""
    number = np.arange(given.labels.size).reshape(given.labels.shape)
    rows, columns, costs = [], [], []
    for axis in range(3):
        a, b = np.moveaxis(number, axis, 0)[:-1].ravel(), np.moveaxis(number, axis, 0)[1:].ravel()
        rows.append(a)
        columns.append(b)
        costs.append(np.abs(given.image.flat[a] - given.image.flat[b]) + 1e-3 * given.spacing[axis] / given.spacing.min())
    flat = given.labels.ravel()
    rows, columns, costs = map(np.concatenate, (rows, columns, costs))
    needed = (flat[rows] == 0) | (flat[columns] == 0)
    graph = sparse.coo_matrix((costs[needed], (rows[needed], columns[needed])), (flat.size,) * 2).tocsr()
    touched = np.unique(np.r_[rows[needed], columns[needed]])
    sources = touched[flat[touched] > 0]
    _, _, source = csgraph.dijkstra(graph, directed=False, indices=sources, min_only=True, return_predecessors=True)
    won = given.labels == 1
    reached = (flat == 0) & (source >= 0)
    won.ravel()[reached] = flat[source[reached]] == 1
    return given.solid(won)


FROM_SEEDS = {"random walker": walk, "watershed": flood, "grow from seeds": grow}


# ---- contours ----------------------------------------------------------------------------------------------------

def shape_based(structure, axis, contours):
    """Shape-based interpolation (Raya and Udupa 1990): linear between the signed distances of marked slices. Beyond the first and
    the last of them the body ends in a cone of 45 degrees. Contours are splines; one within another is a hole.
    @param contours  [(slice, marks in order), ...] of draw_contours"""
    rest = [a for a in (2, 1, 0) if a != axis]
    shape = tuple(structure.sizes[rest])
    marked = {}
    for k, marks in contours:
        marked.setdefault(k, np.zeros(shape, bool))
        marked[k] ^= polygon2mask(shape, spline(marks[:, rest]))
    ks = sorted(marked)
    signed = np.stack([_signed(marked[k], structure.spacing[rest]) for k in ks])
    every = np.arange(structure.sizes[axis])
    between = interpolate.interp1d(ks, signed, axis=0, bounds_error=False, fill_value=(signed[0], signed[-1]), assume_sorted=True) \
        if len(ks) > 1 else lambda _: signed[[0] * len(every)]
    beyond = np.maximum(0, np.maximum(ks[0] - every, every - ks[-1])) * structure.spacing[axis]
    return np.moveaxis(between(every) + beyond[:, None, None] < 0, 0, 2 - axis)


def spline(marks, fine=8):
    """A closed curve through marks in order: cubic, parametrised by the square root of the chord lengths."""
    closed = np.concatenate([marks, marks[:1]])
    way = np.r_[0, np.cumsum(np.sqrt(np.linalg.norm(np.diff(closed, axis=0), axis=1)) + 1e-9)]
    return interpolate.CubicSpline(way, closed, bc_type="periodic")(np.linspace(0, way[-1], fine * len(marks), endpoint=False))


def _signed(mask, spacing):
    out, into = ndimage.distance_transform_edt(~mask, spacing), ndimage.distance_transform_edt(mask, spacing)
    return out - into + 0.5 * spacing.min() * np.where(mask, 1, -1)
