"""Meshes, grids and segmentations that careless readers misread or cannot read.

    COVOL=build/bin/covol python3 -m unittest tests/cli/cases_solids_test.py
"""
import json
import unittest

from cases_case import SIZE, Case, body

try:
    import numpy as np
    import pyopenvdb
    MISSING = ""
except ImportError as error:
    MISSING = f"SKIPPED: {error}; see tests/install_packages.sh"

# Area 8, perimeter 14; prism of height 2 over it: area 44, volume 16.
L_SHAPE = ((0, 3), (0, 0), (4, 0), (4, 1), (2, 1), (2, 3))


def prism(outline, height, first=1):
    """OBJ of a prism over a polygon, whose top and bottom are one face each."""
    n = len(outline)
    lines = [f"v {x} {y} {z}" for z in (0, height) for x, y in outline]
    lines.append("f " + " ".join(str(first + k) for k in reversed(range(n))))
    lines.append("f " + " ".join(str(first + n + k) for k in range(n)))
    lines += [f"f {first + k} {first + (k + 1) % n} {first + n + (k + 1) % n} {first + n + k}" for k in range(n)]
    return "\n".join(lines) + "\n"


def sphere(radius, count=24, inward=False, centre=(6, 5.5, 4), gap=0):
    """Vertices and triangles of a sphere; `gap`: number of rings that are left out at the pole."""
    vertices, triangles = [], []
    for i in range(count + 1):
        for j in range(2 * count):
            a, b = np.pi * i / count, np.pi * j / count
            vertices.append(np.array(centre) + radius * np.array((np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a))))
    for i in range(gap, count):
        for j in range(2 * count):
            k = (j + 1) % (2 * count)
            a, b, c, d = i * 2 * count + j, (i + 1) * 2 * count + j, (i + 1) * 2 * count + k, i * 2 * count + k
            triangles += ([(a, b, c)] if i < count - 1 else []) + ([(a, c, d)] if i > 0 else [])
    # The first and the last ring of vertices lie at the poles: each is replaced by its first vertex.
    vertices = np.array(vertices)
    ring = 2 * count
    pole = lambda v: 0 if v < ring else (count * ring if v >= count * ring else v)  # noqa: E731
    triangles = np.array([[pole(v) for v in t] for t in triangles])
    return vertices, triangles[:, ::-1] if inward else triangles


def write_obj(path, *parts):
    lines, first = [], 1
    for vertices, triangles in parts:
        lines += ["v %.6f %.6f %.6f" % tuple(v) for v in vertices] + ["f %d %d %d" % tuple(t + first) for t in triangles]
        first += len(vertices)
    path.write_text("\n".join(lines) + "\n")


@unittest.skipIf(MISSING, MISSING)
class Meshes(Case):
    def measures(self, name, text=None):
        if text is not None:
            (self.folder / name).write_text(text)
        return self.report("info", name)["mesh"]

    def test_concave_polygons(self):
        star = [((2 if k % 2 else 5) * np.cos(np.pi * k / 7), (2 if k % 2 else 5) * np.sin(np.pi * k / 7)) for k in range(14)]
        area = 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(star, star[1:] + star[:1]))
        rim = sum(np.hypot(a[0] - b[0], a[1] - b[1]) for a, b in zip(star, star[1:] + star[:1]))
        for start in range(6):
            outline = L_SHAPE[start:] + L_SHAPE[:start]
            found = self.measures("l.obj", prism(outline, 2))
            self.assertAlmostEqual(found["area"], 44, 4)
            self.assertAlmostEqual(found["volume"], 16, 4)
            self.assertTrue(found["closed"])
        found = self.measures("star.obj", prism(star, 3))
        self.assertAlmostEqual(found["area"], 2 * area + 3 * rim, 3)
        self.assertAlmostEqual(found["volume"], 3 * area, 3)

    def test_polygons_in_other_planes_and_formats(self):
        turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        lines = prism(L_SHAPE, 2).splitlines()
        places = [turn @ np.array(line.split()[1:], float) for line in lines if line.startswith("v")]
        faces = [[int(v) - 1 for v in line.split()[1:]] for line in lines if line.startswith("f")]
        off = f"OFF\n{len(places)} {len(faces)} 0\n" + "".join("%.9g %.9g %.9g\n" % tuple(p) for p in places)
        off += "".join(f"{len(f)} {' '.join(map(str, f))}\n" for f in faces)
        ply = (f"ply\nformat ascii 1.0\nelement vertex {len(places)}\nproperty float x\nproperty float y\nproperty float z\n"
               f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n" + off.split("\n", 2)[2])
        for name, text in (("l.off", off), ("l.ply", ply)):
            with self.subTest(name):
                found = self.measures(name, text)
                self.assertAlmostEqual(found["area"], 44, 3)
                self.assertAlmostEqual(found["volume"], 16, 3)

    def test_a_face_with_a_hole(self):
        """As an outline that runs along one edge to the hole and back."""
        outer, inner = [(0, 0), (6, 0), (6, 6), (0, 6)], [(2, 2), (2, 4), (4, 4), (4, 2)]
        lines = ["v %g %g %g" % (x, y, z) for z in (0, 1) for x, y in outer + inner]
        top, bottom = [9, 10, 11, 12, 9, 13, 14, 15, 16, 13], [1, 5, 8, 7, 6, 5, 1, 4, 3, 2]
        faces = [top, bottom]
        faces += [[1 + k, 1 + (k + 1) % 4, 9 + (k + 1) % 4, 9 + k] for k in range(4)]
        faces += [[5 + k, 5 + (k + 1) % 4, 13 + (k + 1) % 4, 13 + k] for k in range(4)]
        found = self.measures("frame.obj", "\n".join(lines + ["f " + " ".join(map(str, f)) for f in faces]) + "\n")
        self.assertAlmostEqual(found["volume"], 32, 4)
        self.assertAlmostEqual(found["area"], 2 * 32 + 24 + 8, 4)

    def test_faces_before_their_vertices(self):
        lines = prism(L_SHAPE, 2).splitlines()
        found = self.measures("l.obj", "\n".join(sorted(lines, key=lambda line: line[0])) + "\n")
        self.assertAlmostEqual(found["area"], 44, 4)

    def test_continued_lines(self):
        plain = prism(L_SHAPE, 2)
        for end in ("\n", "\r\n"):
            for text in (plain.replace(" 1 ", f" 1 \\{end}"), plain.replace("f ", f"f \\{end}  "), plain.replace(" ", f" \\{end}\t")):
                text = "# a comment that ends with \\\n" + text
                found = self.measures("l.obj", text.replace("\n", end) if end == "\r\n" and "\r" not in text else text)
                self.assertEqual((round(found["area"], 4), round(found["volume"], 4)), (44, 16))


@unittest.skipIf(MISSING, MISSING)
class Starts(Case):
    """Meshes as guesses and as starts."""

    def setUp(self):
        super().setUp()
        header = ["NRRD0005", "type: uint8", "dimension: 3", "sizes: %d %d %d" % SIZE, "spacings: 1 1 1", "encoding: raw"]
        (self.folder / "image.nrrd").write_bytes("\n".join(header).encode() + b"\n\n" + body().tobytes())

    def surface(self, *options):
        done = self.run_covol("segment", "image.nrrd", *options, "--voxel-size", 0.25, "-o", "s.vdb", "--json", "r.json")
        return json.loads((self.folder / "r.json").read_text())["surface"], done.stderr

    def test_cavities_stay(self):
        write_obj(self.folder / "shell.obj", sphere(3), sphere(1.5, inward=True))
        write_obj(self.folder / "ball.obj", sphere(3))
        volume = 4 / 3 * np.pi * (3 ** 3 - 1.5 ** 3)
        found, _ = self.surface("--guess", "shell.obj")
        self.assertAlmostEqual(found["volume"] / volume, 1, delta=0.03)
        self.assertEqual(found["components"], 2)
        found, _ = self.surface("--guess", "ball.obj")
        self.assertAlmostEqual(found["volume"] / (36 * np.pi), 1, delta=0.03)

    def test_bodies_beside_each_other(self):
        write_obj(self.folder / "two.obj", sphere(1.6, centre=(4, 5.5, 4)), sphere(1.6, centre=(9, 5.5, 4)))
        found, _ = self.surface("--guess", "two.obj")
        self.assertAlmostEqual(found["volume"] / (8 / 3 * np.pi * 1.6 ** 3), 1, delta=0.04)

    def test_holes_are_closed_and_reported(self):
        for gap in (1, 3):
            with self.subTest(gap=gap):
                write_obj(self.folder / "open.obj", sphere(3, gap=gap))
                found, errors = self.surface("--guess", "open.obj")
                self.assertIn("the mesh of the start is not closed: 1 hole", errors)
                self.assertAlmostEqual(found["volume"] / (36 * np.pi), 1, delta=0.05)
                self.assertTrue(found["closed"])

    def test_holes_in_shells(self):
        write_obj(self.folder / "open.obj", sphere(3, gap=1), sphere(1.5, inward=True, gap=1))
        found, errors = self.surface("--guess", "open.obj")
        self.assertIn("2 holes", errors)
        self.assertAlmostEqual(found["volume"] / (4 / 3 * np.pi * (3 ** 3 - 1.5 ** 3)), 1, delta=0.06)

    def test_sheets_are_refused(self):
        write_obj(self.folder / "open.obj", sphere(3, gap=14))
        message = self.refused("segment", "image.nrrd", "--guess", "open.obj", "-o", "s.vdb")
        self.assertIn("the mesh of the start is not closed", message)
        self.assertFalse((self.folder / "s.vdb").exists())


@unittest.skipIf(MISSING, MISSING)
class Grids(Case):
    def ball(self, centre, radius=6.0):
        return pyopenvdb.createLevelSetSphere(radius, centre, 1.0) if hasattr(pyopenvdb, "createLevelSetSphere") else None

    def test_grids_of_one_name(self):
        grids = []
        for x in (0, 20, 50):
            grid = self.ball((x, 0, 0))
            grid.name = "surface"
            grids.append(grid)
        pyopenvdb.write(str(self.folder / "a.vdb"), grids=grids)
        names = [grid["name"] for grid in self.report("info", "a.vdb")["grids"]]
        self.assertEqual(names, ["surface", "surface[1]", "surface[2]"])
        for name, x in (("surface", 0), ("surface[0]", 0), ("surface[1]", 20), ("surface[2]", 50)):
            self.run_covol("mesh", f"a.vdb:{name}", "-o", "m.obj", "--quiet")
            middle = np.array([line.split()[1:4] for line in (self.folder / "m.obj").read_text().splitlines() if line.startswith("v ")], float).mean(0)
            np.testing.assert_allclose(middle, (x, 0, 0), atol=0.05)
        self.assertIn("surface[2]", self.refused("mesh", "a.vdb:surface[3]", "-o", "m.obj"))

    def test_indicators_without_a_class(self):
        z, y, x = np.meshgrid(*[np.arange(20)] * 3, indexing="ij")
        inside = (x - 9) ** 2 + (y - 10) ** 2 + (z - 11) ** 2 < 36
        for high, smooth in ((1.0, False), (255.0, False), (1.0, True)):
            with self.subTest(high=high, smooth=smooth):
                values = inside.astype(np.float32)
                if smooth:
                    values = np.clip(0.5 + 6 - np.sqrt((x - 9) ** 2 + (y - 10) ** 2 + (z - 11.0) ** 2), 0, 1).astype(np.float32)
                grid = pyopenvdb.FloatGrid(0.0)
                grid.copyFromArray(np.ascontiguousarray(values.transpose(2, 1, 0)) * high)
                grid.name = "density"
                pyopenvdb.write(str(self.folder / "a.vdb"), grids=[grid])
                done = self.run_covol("mesh", "a.vdb", "-o", "m.ply")
                self.assertIn(f"its boundary is placed at {high / 2:g}", done.stderr)
                volume = self.report("info", "m.ply")["mesh"]["volume"]
                self.assertAlmostEqual(volume / (inside.sum() if not smooth else 4 / 3 * np.pi * 6 ** 3), 1, delta=0.03)


@unittest.skipIf(MISSING, MISSING)
class Segments(Case):
    """Segmentations of 3D Slicer: segments that overlap are stored in layers."""

    def setUp(self):
        super().setUp()
        z, y, x = np.meshgrid(*[np.arange(n) for n in SIZE[::-1]], indexing="ij")
        self.body = body() > 120
        self.core = (x - 6) ** 2 + (y - 5.5) ** 2 + (z - 4) ** 2 < 4
        self.write("layers.seg.nrrd", np.stack([self.body, self.core], -1), (("body", 1, 0), ("the core", 1, 1)))
        self.write("flat.seg.nrrd", (self.body + 2 * (self.core & self.body)).astype(np.uint8), (("rim", 1, 0), ("core", 3, 0)))
        header = ["NRRD0005", "type: uint8", "dimension: 3", "space: LPS", "sizes: %d %d %d" % SIZE,
                  "space directions: (1,0,0) (0,1,0) (0,0,1)", "space origin: (0,0,0)", "encoding: raw"]
        (self.folder / "image.nrrd").write_bytes("\n".join(header).encode() + b"\n\n" + body().tobytes())

    def write(self, name, data, segments):
        layers = data.shape[3:]
        lines = ["NRRD0005", "type: uint8", f"dimension: {3 + len(layers)}", "space: LPS",
                 "sizes: " + " ".join(map(str, layers + SIZE)), "encoding: raw", "space origin: (0,0,0)",
                 "kinds: " + "list " * len(layers) + "domain domain domain",
                 "space directions: " + "none " * len(layers) + "(1,0,0) (0,1,0) (0,0,1)"]
        for n, (segment, label, layer) in enumerate(segments):
            lines += [f"Segment{n}_ID:=S{n}", f"Segment{n}_Name:={segment}", f"Segment{n}_LabelValue:={label}", f"Segment{n}_Layer:={layer}"]
        (self.folder / name).write_bytes("\n".join(lines).encode() + b"\n\n" + np.ascontiguousarray(data, np.uint8).tobytes())

    def test_a_segment_is_a_mask(self):
        for name, right in (("layers.seg.nrrd:body", self.body), ("layers.seg.nrrd:the core", self.core), ("layers.seg.nrrd:S1", self.core),
                            ("flat.seg.nrrd:core", self.core & self.body), ("flat.seg.nrrd:rim", self.body & ~self.core)):
            with self.subTest(name):
                np.testing.assert_array_equal(self.voxels(name), right)

    def test_layers_without_a_name_are_listed(self):
        for command in (("compare", "layers.seg.nrrd", "flat.seg.nrrd"), ("segment", "image.nrrd", "--guess", "layers.seg.nrrd", "-o", "s.vdb"),
                        ("segment", "image.nrrd", "--painted", "layers.seg.nrrd", "-o", "s.vdb")):
            message = self.refused(*command)
            self.assertIn("layers.seg.nrrd:body", message)
            self.assertIn("the core", message)
        self.assertIn("expected one of its segments (body, the core), got 'liver'", self.refused("info", "layers.seg.nrrd:liver"))

    def test_wherever_a_mask_is_taken(self):
        found = self.report("compare", "layers.seg.nrrd:the core", "flat.seg.nrrd:core")["compare"]
        self.assertGreater(found["dice"], 0.99)
        surface = self.report("segment", "image.nrrd", "--guess", "layers.seg.nrrd:body", "-o", "s.vdb")["surface"]
        self.assertAlmostEqual(surface["volume"] / self.body.sum(), 1, delta=0.25)
        self.run_covol("check", "layers.seg.nrrd:body")


if __name__ == "__main__":
    unittest.main()
