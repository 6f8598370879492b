"""Clouds of few and of many points on closed bodies: the results, and whether the advice in error messages works.

    COVOL=build/bin/covol python3 -m unittest tests/cli/clouds_test.py
"""
import json
import math
import random
import re
import subprocess
import unittest

from clouds_case import (RADIUS, Clouds, fold_normals, random_bowl, random_folds, random_knot, random_scan_from_the_air, random_sphere,
                         shell_fraction)
from covol_case import COVOL, write_nrrd, write_xyz


class Few(Clouds):
    def test_spheres(self):
        # For exact points of a sphere, the surface of minimum bending energy is the sphere.
        for count, within in ((50, 0.03), (100, 0.01), (200, 0.01), (300, 0.01)):
            for seed in range(3):
                with self.subTest(count=count, seed=seed):
                    surface = self.surface(random_sphere(count, seed))
                    self.assertEqual((surface["components"], surface["genus"]), (1, 0))
                    fraction = surface["volume"] / (4 / 3 * math.pi * RADIUS ** 3)
                    self.assertAlmostEqual(fraction, 1, delta=within)

    def test_normals_of_few_points_are_not_believed(self):
        points = random_sphere(200, 1)
        inwards = [tuple(-c / RADIUS for c in p) for p in points]
        for name, normals in (("inwards", inwards), ("upwards", [(0, 0, 1)] * len(points))):
            with self.subTest(name):
                path = self.out / f"{name}.ply"
                head = "ply\nformat ascii 1.0\nelement vertex 200\n" + "".join(
                    f"property float {c}\n" for c in ("x", "y", "z", "nx", "ny", "nz")) + "end_header\n"
                path.write_text(head + "".join(" ".join(map(str, (*p, *n))) + "\n" for p, n in zip(points, normals)))
                surface = self.surface(path)
                self.assertEqual((surface["components"], surface["genus"]), (1, 0))
                self.assertAlmostEqual(surface["volume"] / (4 / 3 * math.pi * RADIUS ** 3), 1, delta=0.01)

    def test_voxels_are_finer_than_few_points_lie_apart(self):
        points, output = random_sphere(1000, 1), []
        for more in ((), ("--model", "paper")):
            automatic = json.loads(self.reconstruct(points, *more).stdout)["automatic"]["voxel_size"]
            output.append(re.fullmatch(r"([0-9.]+) \((.*)\)", automatic).groups())
        (finer, why_finer), (spacing, why) = output
        self.assertAlmostEqual(float(spacing) / float(finer), 2, places=4)
        self.assertTrue(why_finer.startswith("finer than the median distance"))
        self.assertEqual(why, "the median distance between neighbouring points")

    def test_two_dozen(self):
        for seed in range(8):
            surface = self.surface(random_sphere(24, seed))
            self.assertEqual((surface["components"], surface["genus"]), (1, 0))
            self.assertAlmostEqual(surface["volume"] / (4 / 3 * math.pi * RADIUS ** 3), 1, delta=0.15)

    def test_so_few_that_the_tag_distance_has_to_be_given(self):
        # With the automatic tag distance, the gaps between these points stay open; with other seeds they are closed.
        for seed in (3, 5, 6):
            points = random_sphere(24, seed)
            advice = re.search(r"try (--tag-distance) ([0-9.]+)",
                               self.advice(points, "the points enclose nothing", "--model", "paper"))
            surface = self.surface(points, "--model", "paper", *advice.groups())
            self.assertEqual((surface["components"], surface["genus"]), (1, 0))


class Thin(Clouds):
    """A few hundred points on bodies that bend strongly compared with the spacing of the points: none of the bending is taken for noise."""

    def check(self, made, genus, within):
        points, volume = made
        surface = self.surface(points)
        self.assertEqual((surface["components"], surface["genus"]), (1, genus))
        self.assertAlmostEqual(surface["volume"] / volume, 1, delta=within)

    def test_knot(self):
        for seed in range(3):
            for count, noise, within in ((400, 0, 0.04), (600, 0.01, 0.03), (1500, 0.03, 0.03)):
                with self.subTest(count=count, noise=noise, seed=seed):
                    self.check(random_knot(count, 0.4, noise, seed), 1, within)

    def test_bowl(self):
        for seed in range(3):
            for count, noise, within in ((300, 0, 0.06), (600, 0, 0.03), (600, 0.01, 0.05), (1500, 0.01, 0.03)):
                with self.subTest(count=count, noise=noise, seed=seed):
                    self.check(random_bowl(count, 0.15, noise, seed), 0, within)

    def test_a_wall_that_noise_pierces_is_doubted(self):
        points, _ = random_bowl(600, 0.15, 0.03, 1)
        done = self.reconstruct(points)
        self.assertIn("handles", " ".join(json.loads(done.stdout).get("warnings", [])))

    def test_noise_is_distinguished_from_shape(self):
        # Mean distance from the ball: less than half of that of the noisy points, which is sigma sqrt(2 / pi).
        points = [tuple(x * (1 + 0.03 * random.Random(n).gauss(0, 1)) for x in p) for n, p in enumerate(random_sphere(1500, 2))]
        self.assertEqual(self.reconstruct(points, "--mesh", "s.ply").returncode, 0)
        write_xyz(self.out / "ball.xyz", random_sphere(5000, 3))
        done = subprocess.run([COVOL, "compare", "ball.xyz", "s.ply", "--quiet", "--json", "-"], cwd=self.out, capture_output=True,
                              text=True, timeout=300)
        self.assertLess(json.loads(done.stdout)["fit"]["points_to_surface"]["mean"], 0.5 * 0.03 * RADIUS * math.sqrt(2 / math.pi))


class Many(Clouds):
    """Clouds with enough points for the surface to be computed from the cloud itself."""

    def report(self, points, *more):
        done = self.reconstruct(points, *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_noise_is_averaged(self):
        draw = random.Random(3)
        noisy = []
        for p in random_sphere(6000, 3):
            factor = 1 + draw.gauss(0, 0.01)
            noisy.append(tuple(factor * x for x in p))
        report = self.report(noisy)
        self.assertTrue(report["cloud"]["encloses"])
        self.assertFalse(report["cloud"]["fills"])
        self.assertAlmostEqual(report["cloud"]["noise"], 0.01 * RADIUS, delta=0.003 * RADIUS)
        self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (1, 0))
        self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.005)

    def test_stray_points_are_left_out(self):
        draw = random.Random(4)
        stray = [tuple(draw.uniform(-2 * RADIUS, 2 * RADIUS) for _ in range(3)) for _ in range(200)]
        report = self.report(random_sphere(6000, 4) + stray)
        self.assertGreater(report["cloud"]["stray_points"], 150)
        self.assertLess(report["cloud"]["stray_points"], 220)
        self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (1, 0))
        self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.01)

    def test_one_side_is_closed_and_doubted(self):
        half = [p for p in random_sphere(12000, 5) if p[2] < 0]
        done = self.reconstruct(half)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("from every point", done.stderr)
        surface = json.loads(done.stdout)["surface"]
        self.assertEqual((surface["closed"], surface["components"], surface["genus"]), (True, 1, 0))

    def test_from_the_air(self):
        # The surface that closes the scan is larger than the scan and leaves the domain. This must not turn any roof
        # inside out.
        for seed in 1, 3:
            report = self.report(random_scan_from_the_air(5000, seed))
            self.assertIn("from every point", " ".join(report["warnings"]))
            self.assertTrue(report["surface"]["closed"])
            self.assertLessEqual(report["surface"]["components"], 1 + 9)  # the ground, and 9 roofs without walls
            # The scan and the surface below it have an area of about 100^2 each; the rest is for walls.
            self.assertLess(report["surface"]["area"], 4 * 100 ** 2)
            self.assertLess(report["fit"]["points_to_surface"]["mean"], 0.25 * report["resolved"]["voxel_size"])
            self.assertLess(report["fit"]["marks_off"]["count"], 0.02 * 5000)

    def test_folds_are_no_views(self):
        # A ball with deep folds, without its bottom: normals vary strongly on the walls, which are hidden from outside.
        points = [p for p in random_folds(14000, 16, 0.3, 2) if p[2] > -0.6]
        report = json.loads(self.reconstruct(points).stdout)
        self.assertTrue(report["cloud"]["encloses"])
        self.assertLess(report["fit"]["points_to_surface"]["mean"], 0.8 * report["resolved"]["voxel_size"])

    def test_folds_are_no_noise(self):
        # Folds with walls less than three spacings apart are smoothed away, with the warning that points lie on sheets.
        # It is not given for folds that are resolved, nor for noise of a standard deviation above the spacing.
        reported = "lie on sheets"
        folds = self.reconstruct(random_folds(10000, 30, 0.2, 1))
        self.assertIn(reported, folds.stderr)
        report = json.loads(folds.stdout)
        self.assertGreater(report["fit"]["points_to_surface"]["mean"], report["resolved"]["voxel_size"])
        self.assertNotIn(reported, self.reconstruct(random_folds(10000, 12, 0.3, 1)).stderr)
        draw = random.Random(7)
        for noise in 0.03, 0.1:
            ball = [tuple(factor * x for x in p)
                    for p in random_sphere(6000, 7) for factor in [1 + draw.gauss(0, noise)]]
            done = self.reconstruct(ball)
            self.assertEqual(done.returncode, 0, done.stderr)
            cloud = json.loads(done.stdout)["cloud"]
            self.assertGreater(cloud["noise"], cloud["nearest"])
            self.assertNotIn(reported, done.stderr)

    def test_points_that_fill_a_solid(self):
        # 2,000 points, too, must be recognised as filling a solid: the surface through so few marks would be folded.
        for count in 10000, 2000:
            draw = random.Random(count)
            filled = [tuple(x * f for x in p) for p in random_sphere(count, 8) for f in [draw.random() ** (1 / 3)]]
            report = self.report(filled)
            self.assertTrue(report["cloud"]["fills"])
            self.assertIn("fill a solid", " ".join(report["warnings"]))
            self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (1, 0))
            self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.06)

    def test_folds_are_met(self):
        # Too fine cells would merge neighbouring walls of folds: a quadric fitted to two walls lies between them.
        for seed in 1, 2:
            report = self.report(random_folds(8000, 16, 0.3, seed))
            self.assertLess(report["fit"]["points_to_surface"]["mean"], 0.6 * report["resolved"]["voxel_size"])
            self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (1, 0))

    def test_few_points_if_requested(self):
        report = self.report(random_sphere(800, 6), "--init", "cloud")
        self.assertTrue(report["automatic"]["start"].startswith("cloud"))
        self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.03)

    def test_with_an_image_there_is_no_cloud(self):
        write_nrrd(self.out / "i.nrrd", (8, 8, 8), bytes(512), spacing=1, origin=(0, 0, 0))
        write_xyz(self.out / "p.xyz", [(2, 2, 2), (5, 2, 2), (2, 5, 2), (2, 2, 5), (5, 5, 5)])
        done = subprocess.run([COVOL, "segment", "i.nrrd", "--points", "p.xyz", "--init", "cloud", "-o", "s.vdb"], cwd=self.out,
                              capture_output=True, text=True, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("points without an image", done.stderr)
        self.assertFalse((self.out / "s.vdb").exists())


class Edges(Clouds):
    """Solids with edges, which must keep their positions."""

    def check_edges(self, points, edges, spacing, volume, within=0.05):
        done = self.reconstruct(points, "--mesh", "m.obj")
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(done.stdout)
        surface = report["surface"]
        self.assertEqual((surface["closed"], surface["components"], surface["genus"]), (True, 1, 0))
        self.assertNotIn("warning", done.stderr)
        self.assertAlmostEqual(surface["volume"] / volume, 1, delta=0.005)
        self.assertEqual(subprocess.run([COVOL, "check", "m.obj"], cwd=self.out, capture_output=True).returncode, 0)
        lines = [line.split() for line in (self.out / "m.obj").read_text().splitlines()]
        vertices = [tuple(map(float, words[1:4])) for words in lines if words[:1] == ["v"]]
        used = set()
        for words in lines:
            if words[:1] == ["f"]:
                corners = [int(corner.split("/")[0]) - 1 for corner in words[1:]]
                used |= {tuple(sorted((corners[n], corners[n - 1]))) for n in range(3)}
        # Distance of the positions on the true edges of the solid (`edges`) from the nearest edge of the mesh.
        by_cell = {}
        for a, b in used:
            for v in (a, b):
                by_cell.setdefault(tuple(int(x // spacing) for x in vertices[v]), set()).add((a, b))
        off = []
        for place in edges:
            cell = [int(x // spacing) for x in place]
            near = (edge for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)
                    for edge in by_cell.get((cell[0] + i, cell[1] + j, cell[2] + k), ()))
            off.append(min((self.off_segment(place, vertices[a], vertices[b]) for a, b in near), default=spacing))
        self.assertLess(sum(off) / len(off), within * spacing)

    @staticmethod
    def off_segment(p, a, b):
        along, to = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, p)]
        square = sum(x * x for x in along)
        t = min(1, max(0, sum(x * y for x, y in zip(along, to)) / square)) if square > 0 else 0
        return math.dist(p, [x + t * y for x, y in zip(a, along)])

    @staticmethod
    def segment(a, b, count=100):
        return [tuple(x + n / count * (y - x) for x, y in zip(a, b)) for n in range(count + 1)]

    def test_box(self):
        # A rotated block with edges of length 12, 10 and 8. With 8 points per unit area, points are about 0.35 apart.
        draw, turned = random.Random(7), lambda p: (0.8 * p[0] - 0.6 * p[1], 0.6 * p[0] + 0.8 * p[1], p[2])
        sides, points = (12, 10, 8), []
        for axis in range(3):
            others = [a for a in range(3) if a != axis]
            for end in (0, sides[axis]):
                for _ in range(int(8 * sides[others[0]] * sides[others[1]])):
                    p = [0.0, 0.0, 0.0]
                    p[axis] = end
                    for a in others:
                        p[a] = draw.uniform(0, sides[a])
                    points.append(turned(p))
        corners = [(x, y, z) for x in (0, 12) for y in (0, 10) for z in (0, 8)]
        edges = [turned(p) for a in corners for b in corners
                 if a < b and sum(x != y for x, y in zip(a, b)) == 1 for p in self.segment(a, b)]
        self.check_edges(points, edges, 0.35, 960)

    def test_cylinder(self):
        draw, points = random.Random(8), []
        for _ in range(3000):
            angle = draw.uniform(0, 2 * math.pi)
            points.append((5 * math.cos(angle), 5 * math.sin(angle), draw.uniform(0, 10)))
        for _ in range(1500):
            angle, radius = draw.uniform(0, 2 * math.pi), 5 * math.sqrt(draw.random())
            points.append((radius * math.cos(angle), radius * math.sin(angle), draw.choice((0, 10))))
        edges = [(5 * math.cos(n / 100), 5 * math.sin(n / 100), z) for n in range(629) for z in (0, 10)]
        self.check_edges(points, edges, 0.32, 250 * math.pi)

    def test_bracket(self):
        # A bracket: two plates that meet at a right angle, with a concave edge between them.
        draw, points = random.Random(9), []
        outline = [(0, 0), (12, 0), (12, 3), (3, 3), (3, 10), (0, 10)]
        for (x0, z0), (x1, z1) in zip(outline, outline[1:] + outline[:1]):
            for _ in range(int(12 * 8 * math.hypot(x1 - x0, z1 - z0))):
                t = draw.random()
                points.append((x0 + t * (x1 - x0), draw.uniform(0, 8), z0 + t * (z1 - z0)))
        for y in (0, 8):
            for width, low, high in ((12, 0, 3), (3, 3, 10)):
                for _ in range(int(12 * width * (high - low))):
                    points.append((draw.uniform(0, width), y, draw.uniform(low, high)))
        edges = []
        for (x0, z0), (x1, z1) in zip(outline, outline[1:] + outline[:1]):
            edges += self.segment((x0, 0, z0), (x0, 8, z0))
            for y in (0, 8):
                edges += self.segment((x0, y, z0), (x1, y, z1))
        self.check_edges(points, edges, 0.29, 8 * (36 + 21))


class Normals(Clouds):
    """Normals and sensors in files are verified, and the outcome is reported."""

    def report(self, name, text, *more):
        (self.out / name).write_text(text)
        done = subprocess.run([COVOL, "reconstruct", name, "-o", "s.vdb", "--quiet", "--json", "-", *more], cwd=self.out, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout), done.stderr

    @staticmethod
    def rows(points, normals):
        return "".join(" ".join(f"{x:.6f}" for x in (*p, *n)) + "\n" for p, n in zip(points, normals))

    def test_normals_of_a_file(self):
        points = random_sphere(6000, 21)
        outward = [tuple(x / RADIUS for x in p) for p in points]
        draw = random.Random(2)
        for sign, inward in ((1, False), (-1, True)):
            report, _ = self.report("p.xyz", self.rows(points, [tuple(sign * x for x in n) for n in outward]))
            found = report["cloud"]["normals"]
            self.assertEqual((found["given"], found["used"], found["inward"], found["from_sensor"]), (6000, True, inward, False))
            self.assertGreater(found["agree"], 0.99)
            self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.01)
        noise = [tuple(draw.choice((-1, 1)) * x for x in n) for n in outward]
        report, output = self.report("p.xyz", self.rows(points, noise))
        self.assertFalse(report["cloud"]["normals"]["used"])
        self.assertAlmostEqual(report["cloud"]["normals"]["agree"], 0.5, delta=0.05)
        self.assertIn("file are not used: one half of them", output)
        self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.01)

    def test_normals_of_narrow_folds(self):
        # Of these points, a twentieth get a wrong orientation without normals; the given normals are right.
        points = random_folds(10000, 20, 0.3, 1)
        report, output = self.report("p.xyz", self.rows(points, fold_normals(points, 20, 0.3)))
        self.assertTrue(report["cloud"]["normals"]["used"])
        self.assertNotIn("file not used", output)
        self.assertLess(report["fit"]["points_to_surface"]["mean"], 0.6 * report["resolved"]["voxel_size"])
        self.assertEqual((report["surface"]["components"], report["surface"]["genus"]), (1, 0))

    def test_normals_stay_with_their_points_where_a_cloud_is_thinned(self):
        points = random_sphere(12000, 23)
        text = self.rows(points, [tuple(x / RADIUS for x in p) for p in points])
        for maximum, used in ((6000, 6000), (0, 12000), (20000, 12000)):
            report, _ = self.report("p.xyz", text, "--most-points", str(maximum))
            reported = report["input"]["points"]
            self.assertEqual((reported["count"], reported.get("thinned_to", 12000)), (12000, used))
            found = report["cloud"]["normals"]
            self.assertEqual((found["given"], found["used"]), (used, True))
            self.assertGreater(found["agree"], 0.99)
            self.assertAlmostEqual(shell_fraction(report["surface"]), 1, delta=0.01)

    def test_sensor_of_a_pcd(self):
        sensor = (0, 0, 8 * RADIUS)
        seen = [p for p in random_sphere(16000, 22) if p[2] > 0.3 * RADIUS]
        header = (f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(seen)}\nHEIGHT 1\n"
                  f"VIEWPOINT {sensor[0]} {sensor[1]} {sensor[2]} 1 0 0 0\nPOINTS {len(seen)}\nDATA ascii\n")
        report, _ = self.report("p.pcd", header + "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in seen))
        found = report["cloud"]["normals"]
        self.assertEqual((found["sensor_given"], found["used"], found["from_sensor"]), (len(seen), True, True))
        self.assertGreater(found["agree"], 0.99)


class Far(Clouds):
    """Clouds in a national grid, millions of voxels from the origin."""
    ORIGIN = (500000.0, 5400000.0, -3000.0)

    def run_covol(self, *words, code=0):
        done = subprocess.run([COVOL, *words, "--quiet", "--json", "-"], cwd=self.out, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stderr)
        return json.loads(done.stdout), done.stderr

    def make(self, name, origin):
        write_xyz(self.out / f"{name}.xyz", [tuple(a + b for a, b in zip(p, origin)) for p in random_sphere(3000, 1)])
        return self.run_covol("reconstruct", f"{name}.xyz", "-o", f"{name}.vdb", "--mesh", f"{name}.ply", "--voxel-size", "0.4",
                              "--report", f"{name}.html")[0]

    def test_as_near_0(self):
        near, far = self.make("near", (0, 0, 0)), self.make("far", self.ORIGIN)
        self.assertEqual(far["surface"]["genus"], 0)
        self.assertAlmostEqual(far["surface"]["volume"] / near["surface"]["volume"], 1, places=3)
        self.assertAlmostEqual(far["fit"]["points_to_surface"]["mean"], near["fit"]["points_to_surface"]["mean"], delta=0.01)
        self.assertIn(b"property double x", (self.out / "far.ply").read_bytes())
        for file in ("far.vdb", "far.ply"):
            box = self.run_covol("compare", file, "far.xyz")[0]["fit"]["points_to_surface"]
            self.assertLess(box["mean"], 0.05)
        alike = self.run_covol("compare", "far.ply", "far.vdb")[0]["compare"]
        self.assertGreater(alike["dice"], 0.99)
        self.assertLess(alike["hausdorff"], 0.2)
        self.assertEqual(self.run_covol("check", "far.ply")[0]["problems"], 0)
        # mesh, compare and report accept files with coordinates this large
        for end in ("obj", "glb"):
            self.run_covol("mesh", "far.vdb", "-o", f"again.{end}")
            self.assertGreater(self.run_covol("compare", f"again.{end}", "far.ply")[0]["compare"]["dice"], 0.999)
        self.run_covol("mesh", "far.vdb", "-o", "plain.ply", "--plain")
        self.assertGreater(self.run_covol("compare", "plain.ply", "far.ply")[0]["compare"]["dice"], 0.99)
        self.assertIn("single precision", self.run_covol("mesh", "far.vdb", "-o", "far.stl")[1])
        self.run_covol("mesh", "far.vdb", "-o", "far.stl", "--strict", code=5)
        self.run_covol("report", "far.vdb", "--points", "far.xyz", "-o", "page.html")
        for picture, vdb in (("a.png", "near.vdb"), ("b.png", "far.vdb")):
            self.run_covol("render", vdb, "-o", picture)
        self.run_covol("reconstruct", "far.xyz", "-o", "b.vdb", "--voxel-size", "0.4", "--init", "mesh:far.ply", "--theta", "1")


if __name__ == "__main__":
    unittest.main()
