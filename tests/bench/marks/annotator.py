"""Marks as a person may set them on a structure whose truth is known.

Positions are voxels of the image, x y z. Every mark is off by up to half a voxel along each axis.
"""
import zlib

import numpy as np

import truth

IMPRECISION = 0.5                                  # maximum error of a mark along each axis, in voxels
BETWEEN_MARKS = 4                                  # distance of marks along a contour, in voxels
CURVE_COUNTS = (10, 15, 20, 25, 30, 40, 50, 60, 80)  # numbers of marks at which curve.py measures Dice


def generator(*what):
    """A random generator that depends only on its purpose."""
    return np.random.default_rng([zlib.crc32(str(w).encode()) for w in what])


def imprecise(structure, exact, rng):
    """Positions moved by up to IMPRECISION along each axis, and kept within the outermost voxel centres."""
    return np.clip(exact + rng.uniform(-IMPRECISION, IMPRECISION, exact.shape), 0, structure.sizes - 1)


# ---- draws ---------------------------------------------------------------------------------------------------------

def draw_by_area(structure, count, rng):
    """Random marks, uniform by area, on the truth's surface except the image's end faces; imprecise."""
    vertices, triangles = structure.surface
    corners = vertices[triangles]
    corners = corners[truth.off_end_faces(structure, corners.reshape(-1, 3)).reshape(-1, 3).all(1)]
    world = corners * structure.spacing
    area = np.linalg.norm(np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0]), axis=1)
    chosen = corners[rng.choice(len(corners), count, p=area / area.sum())]
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return imprecise(structure, chosen[:, 0] + u * (chosen[:, 1] - chosen[:, 0]) + v * (chosen[:, 2] - chosen[:, 0]), rng)


def draw_on_outlines(structure, count, rng):
    """Marks spread evenly over the truth's outlines in three orthogonal planes through its middle; imprecise."""
    middle = [int(np.median(a)) for a in np.nonzero(structure.truth)][::-1]
    fractions = [count // 3 + (a < count % 3) for a in range(3)]
    exact = []
    for axis, fraction in zip((2, 1, 0), fractions):
        exact.append(truth.Lines(structure, structure.outlines(axis, middle[axis])).even(fraction, rng.random()))
    return imprecise(structure, np.concatenate(exact), rng)


def draw_contours(structure, axis, which, every, rng, minimum=8):
    """[(slice, marks in order), ...]: marks on closed contours of the truth, about `every` voxels apart, at least `minimum` of them
    on each; imprecise within the slice. Parts shorter than four voxels are skipped, as by a person."""
    contours = []
    for k in which:
        for line in structure.outlines(axis, k):
            length = np.linalg.norm(np.diff(line, axis=0) * structure.spacing, axis=1)
            way = np.r_[0, np.cumsum(length)]
            if way[-1] < 4 * structure.h:
                continue
            count = max(minimum, round(way[-1] / (every * structure.h)))
            turns = (np.arange(count) + rng.random()) / count * way[-1]
            exact = np.stack([np.interp(turns, way, line[:, a]) for a in range(3)], 1)
            marks = np.clip(exact + rng.uniform(-IMPRECISION, IMPRECISION, exact.shape), -0.5, structure.sizes - 0.5)
            marks[:, axis] = k
            contours.append((int(k), marks))
    return contours


# ---- marks for the scripts that measure -----------------------------------------------------------------------------

def marks_of(structure, count, draw):
    """Random by area; if there are only twenty, spread over outlines."""
    rng = generator(structure.name, count, draw)
    return (draw_on_outlines if count == 20 else draw_by_area)(structure, count, rng)


def contours_of(structure, step, draw):
    """On every step-th slice; the first slice differs between the draws."""
    rng = generator(structure.name, "contours", step, draw)
    first, last = structure.slices(structure.contour_axis)
    first += draw % step if (last - first) // step > 1 else 0
    return draw_contours(structure, structure.contour_axis, range(first, last + 1, step), BETWEEN_MARKS, rng)


def first_marks(structure, draw):
    return draw_on_outlines(structure, CURVE_COUNTS[0], generator(structure.name, "curve", draw))


def random_marks(structure, draw):
    """All marks that are ever needed; smaller numbers take the first of them."""
    first = first_marks(structure, draw)
    more = draw_by_area(structure, CURVE_COUNTS[-1] - len(first), generator(structure.name, "curve", draw, "random"))
    return np.concatenate([first, more])


class Annotator:
    """Marks the truth at covol's suggestions."""

    def __init__(self, structure, marks, rng):
        self.structure, self.marks, self.rng = structure, marks, rng
        self.elsewhere = 0  # number of marks for which covol suggested no position

    def mark(self, count, suggestions):
        """Sets `count` more marks. @param suggestions  of covol's report, the most useful first"""
        exact = []
        for n in range(count):
            place = self._near(suggestions[n % len(suggestions)], exact, again=n >= len(suggestions)) if suggestions else None
            if place is None:
                self.elsewhere += 1
                self.marks = np.concatenate([self.marks, draw_by_area(self.structure, 1, self.rng)])
            else:
                exact.append(place)
        if exact:
            self.marks = np.concatenate([self.marks, imprecise(self.structure, np.array(exact), self.rng)])

    def _near(self, suggestion, exact, again):
        """A position on the truth's outlines in the suggested slice, or in the nearest slice that has any."""
        first, last = self.structure.slices(2)
        lines = truth.Lines(self.structure, self.structure.outlines(2, int(np.clip(suggestion["slice"], first, last))))
        if lines.total == 0:
            return None
        outline = lines.even(max(8, round(lines.total / self.structure.h)))
        spacing = self.structure.spacing
        away = np.linalg.norm((outline - suggestion["index"])[:, :2] * spacing[:2], axis=1)
        if not again:
            return outline[away.argmin()]
        near = away <= np.quantile(away, 0.25)
        taken = np.concatenate([self.marks, *[e[None] for e in exact]]) * spacing
        room = np.linalg.norm(outline[:, None] * spacing - taken[None], axis=2).min(1)
        return outline[np.where(near, room, -1).argmax()]


def few_contours(structure, count, draw):
    """About `count` marks on contours in evenly spread slices, about eight on each."""
    first, last = structure.slices(structure.contour_axis)
    slices = max(2, round(count / 8))
    which = first + (last - first) * (np.arange(slices) + 0.5) / slices
    rng = generator(structure.name, "curve", draw, "contours", count)
    which = np.unique(np.round(which).astype(int))
    length = [sum(np.linalg.norm(np.diff(line, axis=0) * structure.spacing, axis=1).sum()
                  for line in structure.outlines(structure.contour_axis, k)) for k in which]
    return draw_contours(structure, structure.contour_axis, which, sum(length) / count / structure.h, rng, minimum=4)
