"""Common to the tests of clouds: random points on spheres, on thin and folded bodies and on ground with houses, and their reconstruction."""
import json
import math
import pathlib
import random
import shutil
import subprocess
import tempfile
import unittest

from covol_case import COVOL, write_xyz

RADIUS = 10.0


def random_sphere(count, seed):
    draw = random.Random(seed)
    points = []
    for _ in range(count):
        v = [draw.gauss(0, 1) for _ in range(3)]
        length = math.hypot(*v)
        points.append(tuple(RADIUS * x / length for x in v))
    return points


class Clouds(unittest.TestCase):
    def setUp(self):
        self.out = pathlib.Path(tempfile.mkdtemp(prefix="covol-out-"))
        self.addCleanup(shutil.rmtree, self.out)

    def reconstruct(self, points, *more):
        """@param points  the points, or a file of them"""
        path = points if isinstance(points, pathlib.Path) else self.out / "cloud.xyz"
        if path is not points:
            write_xyz(path, points)
        return subprocess.run([COVOL, "reconstruct", path, "-o", "s.vdb", "--quiet", "--json", "-", *more], cwd=self.out,
                              capture_output=True, text=True, timeout=300)

    def surface(self, points, *more):
        done = self.reconstruct(points, *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        surface = json.loads(done.stdout)["surface"]
        self.assertTrue(surface["closed"])
        return surface

    def advice(self, points, expected_text, *more):
        done = self.reconstruct(points, *more)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn(expected_text, done.stderr)
        return done.stderr


def shell_fraction(surface):
    return surface["volume"] / (4 / 3 * math.pi * RADIUS ** 3)


def random_knot(count, tube, noise, seed):
    """Points on the tube of a trefoil knot, moved by `noise`. @return points, and the tube's volume"""
    draw = random.Random(seed)
    at = lambda t: (math.sin(t) + 2 * math.sin(2 * t), math.cos(t) - 2 * math.cos(2 * t), -math.sin(3 * t))
    along = lambda t: (math.cos(t) + 4 * math.cos(2 * t), -math.sin(t) + 4 * math.sin(2 * t), -3 * math.cos(3 * t))
    points = []
    while len(points) < count:
        t = 2 * math.pi * draw.random()
        tangent = along(t)
        if 6 * draw.random() > math.hypot(*tangent):
            continue  # rejection sampling: a density proportional to the speed |tangent| <= 6 is uniform along the knot
        unit = [x / math.hypot(*tangent) for x in tangent]
        across = [draw.gauss(0, 1) for _ in range(3)]
        fraction = sum(a * b for a, b in zip(across, unit))
        across = [a - fraction * b for a, b in zip(across, unit)]
        radius = (tube + noise * draw.gauss(0, 1)) / math.hypot(*across)
        points.append(tuple(c + radius * a for c, a in zip(at(t), across)))
    places = [at(2 * math.pi * n / 3000) for n in range(3001)]
    return points, math.pi * tube ** 2 * sum(map(math.dist, places, places[1:]))


def random_bowl(count, thickness, noise, seed):
    """Points on half of a hollow ball of radius 1, including its rim, moved by `noise`. @return points, and its volume"""
    draw, inner = random.Random(seed), 1 - thickness
    areas = (2 * math.pi, 2 * math.pi * inner ** 2, math.pi * (1 - inner ** 2))
    points = []
    while len(points) < count:
        side, off = draw.choices(range(3), areas)[0], noise * draw.gauss(0, 1)
        if side < 2:
            v = [draw.gauss(0, 1) for _ in range(3)]
            radius = ((1, inner)[side] + off) / math.hypot(*v)
            points.append((radius * v[0], radius * v[1], -radius * abs(v[2])))
        else:
            radius, angle = math.sqrt(inner ** 2 + (1 - inner ** 2) * draw.random()), 2 * math.pi * draw.random()
            points.append((radius * math.cos(angle), radius * math.sin(angle), off))
    return points, 2 / 3 * math.pi * (1 - inner ** 3)


def random_folds(count, waves, depth, seed):
    """Points, uniform by area, on the unit sphere with folds along its normals."""
    draw = random.Random(seed)
    cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    def unit(v):
        length = math.hypot(*v)
        return [x / length for x in v]

    def at(v):
        height = 1 + depth * math.cos(waves * v[0]) * math.cos(waves * v[1]) * math.cos(waves * v[2])
        return [height * x for x in v]

    points = []
    while len(points) < count:
        v = unit([draw.gauss(0, 1) for _ in range(3)])
        here = at(v)
        away = lambda side: [(a - b) / 1e-4 for a, b in zip(at(unit([x + 1e-4 * y for x, y in zip(v, side)])), here)]
        side = unit(cross(v, (1, 0, 0) if abs(v[0]) < 0.7 else (0, 1, 0)))
        if 9 * draw.random() < math.hypot(*cross(away(side), away(cross(v, side)))):
            points.append(tuple(here))
    return points


def fold_normals(points, waves, depth):
    """Outward normals of random_folds()."""
    def height(p):
        length = math.hypot(*p)
        return length - 1 - depth * math.prod(math.cos(waves * x / length) for x in p)

    normals = []
    for p in points:
        here = height(p)
        slope = [height([x + 1e-6 * (a == b) for b, x in enumerate(p)]) - here for a in range(3)]
        length = math.hypot(*slope)
        normals.append(tuple(x / length for x in slope))
    return normals


def random_scan_from_the_air(count, seed):
    """Points on hills with houses, scanned from the air: roofs, and nothing of the walls. A square with edge 100."""
    draw = random.Random(seed)
    ground = lambda x, y: 3 * math.sin(x / 23) * math.cos(y / 31) + 0.02 * x
    houses = [(draw.uniform(10, 90), draw.uniform(10, 90), draw.uniform(4, 12), draw.uniform(4, 12), draw.uniform(4, 15),
               draw.uniform(0, math.pi)) for _ in range(9)]
    points = []
    for _ in range(count):
        x, y = draw.uniform(0, 100), draw.uniform(0, 100)
        z = ground(x, y)
        for a, b, length, width, height, turn in houses:
            u = (x - a) * math.cos(turn) + (y - b) * math.sin(turn)
            v = (y - b) * math.cos(turn) - (x - a) * math.sin(turn)
            if abs(u) < length and abs(v) < width:
                z = ground(a, b) + height
        points.append((x, y, z + draw.gauss(0, 0.02)))
    return points
