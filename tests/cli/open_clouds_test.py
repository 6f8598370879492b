"""Clouds that enclose nothing, or have holes: the results, and whether the advice in error messages works.

    COVOL=build/bin/covol python3 -m unittest tests/cli/open_clouds_test.py
"""
import json
import math
import random
import re
import subprocess
import unittest

from clouds_case import RADIUS, Clouds, random_sphere, shell_fraction
from covol_case import COVOL, write_nrrd, write_xyz


class Scenes(Clouds):
    """Scenes scanned from one side: by default the mesh ends where the points end."""

    @staticmethod
    def on_rectangle(draw, count, corner, u, v):
        for _ in range(count):
            a, b = draw.random(), draw.random()
            yield tuple(c + a * x + b * y for c, x, y in zip(corner, u, v))

    def check_open(self, points, area, components, rims):
        done = self.reconstruct(points, "--mesh", "m.obj")
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(done.stdout)
        self.assertEqual(report["holes"]["policy"], "open")
        self.assertNotIn("from every point", done.stderr)
        self.assertEqual((report["surface"]["closed"], report["surface"]["components"]), (False, components))
        self.assertEqual(len(report["holes"]["loops"]), rims)
        self.assertAlmostEqual(report["surface"]["area"] / area, 1, delta=0.05)
        self.assertLess(report["fit"]["points_to_surface"]["mean"], 0.1 * report["resolved"]["voxel_size"])
        self.assertLess(report["fit"]["marks_off"]["count"], 0.002 * len(points))

    def test_front_of_a_house(self):
        # Windows are set back by 0.3. By the winding number alone, the surface would have hundreds of pieces.
        draw = random.Random(4)
        density, depth, points, area = 120, 0.3, [], 12 * 6.0

        def add(corner, u, v, size):
            points.extend(self.on_rectangle(draw, int(density * size), corner, u, v))

        windows = [(1.2 + 3.6 * i, 1.0 + 2.6 * j) for i in range(3) for j in range(2)]
        for p in self.on_rectangle(draw, int(density * area), (0, 0, 0), (12, 0, 0), (0, 0, 6)):
            if not any(x < p[0] < x + 1.6 and z < p[2] < z + 1.4 for x, z in windows):
                points.append(p)
        for x, z in windows:
            add((x, depth, z), (1.6, 0, 0), (0, 0, 1.4), 1.6 * 1.4)
            for side in (0, 1):
                add((x + 1.6 * side, 0, z), (0, depth, 0), (0, 0, 1.4), depth * 1.4)
                add((x, 0, z + 1.4 * side), (1.6, 0, 0), (0, depth, 0), depth * 1.6)
            area += 2 * depth * (1.6 + 1.4)
        self.check_open(points, area, 1, 1)

    def test_ground_roofs_and_crowns(self):
        # Ground, and above it two houses' roofs and two tree crowns without walls or trunks, each open below.
        draw = random.Random(5)
        points = [(x, y, math.sin(0.2 * x)) for x, y in ((draw.uniform(0, 40), draw.uniform(0, 40)) for _ in range(12000))]
        for x in (6, 24):
            for side in (-1, 1):
                points += self.on_rectangle(draw, 450, (x, 20 + 4 * side, 8), (12, 0, 0), (0, -4 * side, 2.5))
        for x, y in ((10, 34), (30, 6)):
            for _ in range(430):
                v = [draw.gauss(0, 1) for _ in range(3)]
                r = math.sqrt(sum(c * c for c in v))
                points.append((x + 3 * v[0] / r, y + 3 * v[1] / r, 6 + 3 * abs(v[2]) / r))
        ground = 40 * sum(math.hypot(1, 0.2 * math.cos(0.2 * (n + 0.5) / 100)) / 100 for n in range(4000))
        area = ground + 4 * 12 * math.hypot(4, 2.5) + 2 * 2 * math.pi * 9
        self.check_open(points, area, 5, 5)
        # Triangles face upwards, as scanned from the air: no roof or crown forms a closed body with the ground.
        lines = [line.split() for line in (self.out / "m.obj").read_text().splitlines()]
        places = [tuple(map(float, words[1:4])) for words in lines if words[:1] == ["v"]]
        triangles = [[places[int(corner.split("/")[0]) - 1] for corner in words[1:]] for words in lines if words[:1] == ["f"]]
        up = sum((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0 for a, b, c in triangles)
        self.assertGreater(up, 0.98 * len(triangles))

    def test_a_leaf(self):
        draw = random.Random(6)
        points = [(x, y, 0.3 * x * x) for x, y in ((draw.uniform(-1, 1), draw.uniform(-1, 1)) for _ in range(4000))]
        area = 2 * sum(math.hypot(1, 0.6 * (n + 0.5) / 1000) / 1000 for n in range(-1000, 1000))
        self.check_open(points, area, 1, 1)
        closed = json.loads(self.reconstruct(points, "--mesh", "m.ply", "--holes", "close").stdout)
        self.assertTrue(closed["surface"]["closed"])


class Holes(Clouds):
    """Treatment of the surface where there are no points."""

    def bowl(self, *more, mesh=("--mesh", "m.ply")):
        half = [p for p in random_sphere(16000, 11) if p[2] < 0]
        done = self.reconstruct(half, *mesh, *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def level_set(self):
        done = subprocess.run([COVOL, "mesh", "s.vdb", "-o", "again.ply", "--quiet", "--json", "-"], cwd=self.out, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)["surface"]

    def test_fraction_without_a_mesh(self):
        """If no output needs the relaxed mesh, the plain surface is measured layer by layer."""
        whole, plain = self.bowl(), self.bowl(mesh=())
        self.assertEqual(list(plain["mesh"]), ["triangles"])
        self.assertAlmostEqual(plain["holes"]["surface_without_points"], whole["holes"]["surface_without_points"], delta=0.005)
        self.assertEqual(plain["holes"]["distance"], whole["holes"]["distance"])
        for name in ("volume", "area"):
            self.assertAlmostEqual(plain["surface"][name] / whole["surface"][name], 1, delta=0.003)
        self.assertEqual(plain["warnings"], whole["warnings"])

    def test_close(self):
        report = self.bowl()
        self.assertEqual((report["holes"]["policy"], report["holes"]["loops"]), ("close", []))
        self.assertGreater(report["holes"]["surface_without_points"], 0.2)
        self.assertTrue(report["surface"]["closed"])
        self.assertIn(b"property float distance_to_points\n", (self.out / "m.ply").read_bytes()[:8000])

    def test_open(self):
        report = self.bowl("--holes", "open")
        holes, surface = report["holes"], report["surface"]
        self.assertEqual(len(holes["loops"]), 1)
        self.assertAlmostEqual(holes["loops"][0]["length"] / (2 * math.pi * RADIUS), 1, delta=0.12)
        self.assertAlmostEqual(surface["area"] / (2 * math.pi * RADIUS ** 2), 1, delta=0.04)
        self.assertEqual((surface["closed"], surface["manifold"], surface["components"]), (False, True, 1))
        self.assertIn("the level set stays closed", report["automatic"]["holes"])
        self.assertTrue(self.level_set()["closed"])
        self.assertIn(b"covol_holes", (self.out / "s.vdb").read_bytes())

    def test_flat(self):
        report = self.bowl("--holes", "flat")
        for surface in (report["surface"], self.level_set()):
            self.assertEqual((surface["closed"], surface["components"], surface["genus"]), (True, 1, 0))
            self.assertAlmostEqual(surface["area"] / (3 * math.pi * RADIUS ** 2), 1, delta=0.02)
            self.assertAlmostEqual(shell_fraction(surface), 0.5, delta=0.01)
        self.assertEqual(len(report["holes"]["loops"]), 1)

    def test_the_distance_is_the_users(self):
        report = self.bowl("--holes", "open", "--hole-distance", str(3 * RADIUS))
        self.assertEqual(report["holes"]["loops"], [])
        self.assertEqual(report["holes"]["distance"], 3 * RADIUS)
        self.assertTrue(report["surface"]["closed"])

    def test_what_is_wrong_is_reported(self):
        points = random_sphere(100, 1)
        for more, expected_text in ((["--holes", "half"], "--holes"), (["--hole-distance", "0"], "--hole-distance: expected > 0")):
            done = self.reconstruct(points, *more)
            self.assertIn(done.returncode, (2, 3))
            self.assertIn(expected_text, done.stderr)
            self.assertFalse((self.out / "s.vdb").exists())


class Open(Clouds):
    def check_layer(self, points, expected_text, *more):
        advice = re.search(r"(--max-steps 0) (--tag-distance [0-9.e-]+) (--voxel-size [0-9.e-]+)", self.advice(points, expected_text, *more))
        surface = self.surface(points, *more, *" ".join(advice.groups()).split())
        self.assertEqual((surface["components"], surface["genus"]), (1, 0))

    def test_plane(self):
        draw = random.Random(1)
        self.check_layer([(draw.uniform(0, 10), draw.uniform(0, 10), 0.0) for _ in range(2000)], "lie in a plane")

    def test_line(self):
        self.check_layer([(0.02 * n, 0.0, 0.0) for n in range(500)], "lie on a line")

    def test_what_holds_no_surface_is_refused_at_once(self):
        # Points on a line or in a plane are refused before tagging and the flow, in which the surface would vanish only
        # after half a minute.
        draw = random.Random(2)
        line = [(0.002 * n, 0.001 * n, 0.0) for n in range(6000)]
        plane = [(draw.uniform(0, 10), draw.uniform(0, 10), 3.0) for _ in range(6000)]
        for points, expected_text in ((line[:2], "on a line"), (line, "on a line"), (plane[:3], "in a plane"), (plane, "in a plane")):
            for more in (), ("--model", "paper"):
                self.assertNotIn("vanished after", self.advice(points, expected_text, *more))  # no step was made

    def test_points_on_a_curve(self):
        # On a curve, closer points contain no more information about a surface: voxels must not become as fine as they.
        turns = [2 * math.pi * n / 1500 for n in range(1500)]
        report = json.loads(self.reconstruct([(3 * math.sin(t) + 6 * math.sin(2 * t), 3 * math.cos(t) - 6 * math.cos(2 * t),
                                               -3 * math.sin(3 * t)) for t in turns], "--mesh", "s.ply").stdout)
        self.assertLess(report["mesh"]["triangles"], 1000000)

    def test_half_a_sphere(self):
        half = [p for p in random_sphere(400, 1) if p[2] > 0]
        self.check_layer(half, "enclose nothing", "--model", "paper")
        done = self.reconstruct(half)  # closed by the guess, with a warning for the half without points
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("farther than", done.stderr)
        self.assertAlmostEqual(json.loads(done.stdout)["surface"]["volume"] / (4 / 3 * math.pi * RADIUS ** 3), 1, delta=0.2)

    def test_points_that_fill_space(self):
        draw = random.Random(1)
        self.advice([tuple(draw.gauss(0, 1) for _ in range(3)) for _ in range(500)], "enclose nothing", "--model", "paper")

    def test_structure_cut_off_by_both_ends_of_the_image(self):
        # A bright tube along z that the first and the last slice cut off, with marks on rings around it.
        n, radius, slices = 40, 8, 20
        tube = bytes(200 if math.hypot(i - 19.5, j - 19.5) < radius else 20
                     for _ in range(slices) for j in range(n) for i in range(n))
        write_nrrd(self.out / "tube.nrrd", (n, n, slices), tube, spacing=1, origin=(0, 0, 0))
        ring = [(19.5 + radius * math.cos(a / 4), 19.5 + radius * math.sin(a / 4)) for a in range(25)]
        rings = [(x, y, float(z)) for z in range(0, slices, 2) for x, y in ring] + [(x, y, slices - 1.0) for x, y in ring]
        cut = [(19.5 + x, 19.5 + y, float(z)) for z in (0, slices - 1) for x in range(-7, 8) for y in range(-7, 8) if x * x + y * y < 49]
        write_xyz(self.out / "rings.xyz", rings)
        write_xyz(self.out / "all.xyz", rings + cut)
        command = [COVOL, "segment", "tube.nrrd", "-o", "s.vdb", "--quiet", "--json", "-", "--points"]
        run = lambda *more: subprocess.run([*command, *more], cwd=self.out, capture_output=True, text=True, timeout=300)
        truth = math.pi * radius ** 2 * slices
        for way, within in ((["all.xyz"], 0.035), (["rings.xyz"], 0.02), (["rings.xyz", "--tag-distance", "10"], 0.1)):
            with self.subTest(way):
                done = run(*way)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertAlmostEqual(json.loads(done.stdout)["surface"]["volume"] / truth, 1, delta=within)


if __name__ == "__main__":
    unittest.main()
