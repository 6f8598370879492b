"""Meshes of random solids by the real program: valid, without slivers, decimated within the deviation that the report states.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mesh_test.py
"""
import math
import random

from covol_case import Case


def random_cloud(seed, count=3000):
    """Points on a random bent tube: thick, thin or of varying thickness, closed or with ends."""
    draw = random.Random(seed)
    closed = draw.random() < 0.5
    thick, swing, bend = draw.uniform(0.12, 0.3), draw.uniform(0, 0.4), draw.uniform(0, 0.5)
    points = []
    for _ in range(count):
        t, a = draw.random(), draw.uniform(0, 2 * math.pi)
        r = thick * (1 + swing * math.sin(4 * math.pi * t + seed))
        u = 2 * math.pi * t if closed else math.pi * t
        if not closed:
            r *= math.sqrt(max(0.0, 1 - (2 * t - 1) ** 8))
        out = (math.cos(u), math.sin(u), bend * math.sin(2 * u))
        points.append((out[0] * (1 + r * math.cos(a)), out[1] * (1 + r * math.cos(a)), out[2] + r * math.sin(a)))
    return points


class Meshes(Case):
    def check(self, file, genus, components):
        self.assertEqual(self.report("check", file)["problems"], 0, file)
        mesh = self.report("info", file)["mesh"]
        self.assertTrue(mesh["closed"] and mesh["manifold"], file)
        self.assertGreater(mesh["volume"], 0)
        self.assertEqual((mesh["genus"], mesh["components"]), (genus, components), file)

    def test_random_clouds(self):
        for seed in range(6):
            with self.subTest(seed=seed):
                (self.out / "c.xyz").write_text("".join("%.6f %.6f %.6f\n" % p for p in random_cloud(seed)))
                whole = self.report("reconstruct", "c.xyz", "-o", "s.vdb", "--mesh", "s.ply")
                topology = (whole["surface"]["genus"], whole["surface"]["components"])
                self.assertGreater(whole["mesh"]["smallest_angle"], 20)
                self.assertLess(whole["mesh"]["deviation_voxels"]["mean"], 0.05)
                self.check("s.ply", *topology)
                plain = self.report("mesh", "s.vdb", "-o", "m.ply")
                self.assertEqual(plain["mesh"]["triangles"], whole["mesh"]["triangles"])
                self.assertAlmostEqual(plain["mesh"]["deviation_voxels"]["mean"], whole["mesh"]["deviation_voxels"]["mean"])
                few = self.report("mesh", "s.vdb", "-o", "d.ply", "--target-edge", "2vx")["cleanup"]
                self.assertTrue(few["intersection_free"])
                self.assertLess(few["decimation"]["triangles"], 0.5 * plain["mesh"]["triangles"])
                self.assertLess(few["decimation"]["deviation_voxels"]["mean"], 0.1)
                self.check("d.ply", *topology)
                flat = self.report("mesh", "s.vdb", "-o", "a.ply", "--adaptive", "0.1vx")["cleanup"]["decimation"]
                self.assertLess(flat["deviation_voxels"]["max"], max(0.1, plain["mesh"]["deviation_voxels"]["max"]) + 0.001)
                self.check("a.ply", *topology)
                smooth = self.report("mesh", "s.vdb", "-o", "t.ply", "--smooth", 5)["cleanup"]["smoothing"]
                self.assertLess(smooth["change_voxels"]["mean"], 0.1)
                self.check("t.ply", *topology)

    def test_adaptive_has_a_bound(self):
        self.segment(points=self.sparse)
        (self.out / "s.vdb").rename(self.inputs / "s.vdb")
        self.refuse("mesh", self.inputs / "s.vdb", "-o", "m.ply", "--adaptive", "3vx", code=3, expected_text="at most two voxels")
