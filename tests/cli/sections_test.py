"""Contours in planes of any direction, with and without an image.

    COVOL=build/bin/covol python3 -m unittest tests/cli/sections_test.py
"""
import csv
import itertools
import json
import math
import unittest

import numpy as np

from covol_case import Case
from tilted_test import rotation

RADII, CENTRE = np.array([6.0, 4.5, 3.5]), np.array([3.0, -2.0, 1.0])
VOLUME = 4 / 3 * math.pi * RADII.prod()
AXES = rotation((1, 2, 3), 0.7)  # columns: directions of the ellipsoid's axes


def section(normal, offset, count=48, radii=RADII, axes=AXES):
    """The ellipsoid's outline in the plane normal . (x - CENTRE) = offset; empty if they do not meet."""
    n = axes.T @ normal * radii  # normal of the plane after the map that makes the ellipsoid a unit ball
    reach = np.linalg.norm(n)
    if abs(offset) >= 0.98 * reach:
        return None
    n /= reach
    middle, r = n * offset / reach, math.sqrt(1 - (offset / reach) ** 2)
    u = np.cross(n, np.eye(3)[np.argmin(abs(n))])
    u /= np.linalg.norm(u)
    v = np.cross(n, u)
    turns = 2 * math.pi * np.arange(count) / count
    ball = middle + r * (np.outer(np.cos(turns), u) + np.outer(np.sin(turns), v))
    return CENTRE + (ball * radii) @ axes.T


def family(normal, count, radii=RADII):
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    reach = np.linalg.norm(AXES.T @ normal * radii)
    return [(normal, offset, section(normal, offset, radii=radii)) for offset in reach * (2 * (np.arange(count) + 0.5) / count - 1)]


def write_csl(path, planes, labels=2):
    """@param planes  (normal, offset from CENTRE, loops by label)"""
    with open(path, "w") as file:
        file.write(f"CSLC\n{len(planes)} {labels}\n\n")
        for n, (normal, offset, loops) in enumerate(planes, 1):
            lines = [line for _, line in loops]
            file.write(f"{n} {sum(map(len, lines))} {len(lines)} {' '.join(map(repr, map(float, normal)))} {-offset - normal @ CENTRE!r}\n\n")
            for line in lines:
                np.savetxt(file, line, "%.9g")
            begin = 0
            for label, line in loops:
                file.write(" ".join(map(str, [len(line), label, *range(begin, begin + len(line))])) + "\n")
                begin += len(line)
    return path


class Sections(Case):
    def csl(self, name, planes):
        return write_csl(self.inputs / name, [(n, o, [(1, line)]) for n, o, line in planes if line is not None])

    def surface(self, *words, **keywords):
        return self.report("reconstruct", *words, "-o", "s.vdb", "--mesh", "s.ply", **keywords)

    def assert_ellipsoid(self, report, delta):
        surface = report["surface"]
        self.assertEqual((surface["components"], surface["genus"], surface["closed"]), (1, 0, True))
        self.assertAlmostEqual(surface["volume"] / VOLUME, 1, delta=delta)

    def test_parallel_planes_of_any_direction(self):
        for normal in ((0, 0, 1), (1, 2, -2), (-3, 1, 0.5)):
            with self.subTest(normal):
                report = self.surface("--contours", self.csl("p.csl", family(normal, 9)), "--voxel-size", 0.3)
                self.assert_ellipsoid(report, 0.03)
                self.assertEqual(report["input"]["contours"]["slices"], 9)

    def test_planes_of_several_directions(self):
        rng = np.random.default_rng(2)
        normals = rng.normal(size=(9, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        anywhere = [(n, o, section(n, o)) for n, o in zip(normals, rng.uniform(-2, 2, 9))]
        x, y, z = rotation((1, 1, 0.3), 0.5)
        for name, planes in (("two families", family(z, 5) + family(y, 5)), ("three", family(x, 3) + family(y, 3) + family(z, 3)),
                             ("random", anywhere)):
            with self.subTest(name):
                report = self.surface("--contours", self.csl("n.csl", planes), "--voxel-size", 0.3)
                self.assert_ellipsoid(report, 0.03)

    def test_a_shell_keeps_its_hole(self):
        planes = [(n, o, [(1, line)] + ([] if inner is None else [(1, inner)]))
                  for (n, o, line), inner in ((plane, section(plane[0], plane[1], radii=RADII * 0.5)) for plane in
                                              family((0, 0, 1), 7) + family((1, 0, 0.2), 7)) if line is not None]
        report = self.surface("--contours", write_csl(self.inputs / "shell.csl", planes), "--voxel-size", 0.3)
        self.assertAlmostEqual(report["surface"]["volume"] / (VOLUME * 7 / 8), 1, delta=0.05)
        self.assertEqual(report["surface"]["components"], 2)

    def test_many_thin_bodies(self):
        """Each of the outlines has few marks on it: the surface of minimum bending energy through them runs away."""
        rng, radii, bodies = np.random.default_rng(5), np.array([3.2, 0.9, 0.9]), []
        for place in itertools.product((-7.0, 0, 7.0), (-3.0, 0, 3.0), (-1.5, 1.5)):
            bodies.append((np.array(place), rotation((0.3, 1, 0.2), 0.2) @ rotation(rng.normal(size=3), 0.2)))
        planes = []
        for normal in np.eye(3)[:2]:
            for offset in np.linspace(-9.4, 9.4, 13) if normal[0] else np.linspace(-3.9, 3.9, 9):
                lines = [(1, section(normal, offset - normal @ place, radii=radii, axes=axes) + place) for place, axes in bodies
                         if section(normal, offset - normal @ place, radii=radii, axes=axes) is not None]
                planes.append((normal, offset, lines))
        report = self.surface("--contours", write_csl(self.inputs / "many.csl", planes), "--contour-curve", "lines", "--voxel-size", 0.15)
        surface = report["surface"]
        self.assertEqual((surface["components"], surface["genus"]), (len(bodies), 0))
        self.assertAlmostEqual(surface["volume"] / (len(bodies) * 4 / 3 * math.pi * radii.prod()), 1, delta=0.15)

    def test_slicers_closed_curves(self):
        curves = [{"type": "ClosedCurve", "coordinateSystem": "LPS", "name": f"c{n}", "controlPoints": [{"position": list(p)} for p in line[::3]]}
                  for n, (_, _, line) in enumerate(family((1, 1, 0), 7) + family((0, 0, 1), 5)) if line is not None]
        (self.inputs / "curves.mrk.json").write_text(json.dumps({"markups": curves}))
        self.assert_ellipsoid(self.surface("--contours", self.inputs / "curves.mrk.json", "--voxel-size", 0.3), 0.03)

    def test_labels_are_structures(self):
        other = np.array([16.0, 0, 0])
        planes = [(n, o, [(1, line)]) for n, o, line in family((1, 2, -2), 7)]
        planes += [(n, o + n @ other, [(2, line + other)]) for n, o, line in family((1, 2, -2), 7)]
        path = write_csl(self.inputs / "two.csl", planes, 3)
        self.refuse("reconstruct", "--contours", path, "-o", "s.vdb", code=3, expected_text="label")
        image = self.inputs / "grey.nrrd"
        image.write_text("NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 44 28 24\nspace directions: (0.75,0,0) (0,0.75,0) (0,0,0.75)\n"
                         "space origin: (-6,-12,-8)\nencoding: ascii\n\n" + "7 " * (44 * 28 * 24) + "\n")
        report = self.report("segment", image, "--contours", path, "--structure-column", "label", "--rho", 0, "-o", "s.vdb")
        self.assertEqual([s["name"] for s in report["structures"]], ["label 1", "label 2"])
        for one in report["structures"]:
            self.assertAlmostEqual(one["surface"]["volume"] / VOLUME, 1, delta=0.05)

    def test_what_is_no_plane_is_reported(self):
        line = section(np.array([0.6, 0, 0.8]), 0.5).copy()
        line[::2] += 0.4
        path = self.inputs / "crooked.csv"
        with open(path, "w", newline="") as file:
            csv.writer(file).writerows([["contour", "x", "y", "z"], *([1, *p] for p in line)])
        self.refuse("reconstruct", "--contours", path, "-o", "s.vdb", code=3, expected_text="plane")

    def test_damaged_files_are_reported(self):
        good = self.csl("good.csl", family((0, 0, 1), 3)).read_text()
        for name, text, expected_text in (("a.csl", good[:len(good) // 2], "expected"), ("b.csl", good.replace("CSLC", "CSL"), "CSLC"),
                                 ("c.csl", "CSLC\n1 2\n1 1000000000000 1 0 0 1 0\n0 0 0\n", "whole number"),
                                 ("d.csl", "CSLC\n1 2\n1 3 1 0 0 1 0\n0 0 0\n1 0 0\n0 1 0\n3 1 0 1 7\n", "got '7'"),
                                 ("e.csl", "CSLC\n1 2\n1 3 1 0 0 1 0\n0 0 nan\n", "nan")):
            with self.subTest(name):
                (self.inputs / name).write_text(text)
                self.refuse("reconstruct", "--contours", self.inputs / name, "-o", "s.vdb", code=3, expected_text=expected_text)


if __name__ == "__main__":
    unittest.main()
