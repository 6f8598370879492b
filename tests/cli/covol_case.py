"""Common to the tests of the program: runs of the real program, and an image and points of a ball. Standard library only."""
import json
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

COVOL = os.environ.get("COVOL", "build/bin/covol")
COMMANDS = ["mark", "segment", "reconstruct", "distance", "band", "edge", "evolve", "surface", "mesh", "mask", "compare",
            "info", "check", "convert", "render", "report", "phantom", "plan", "brick", "rerun", "demo", "doctor"]

# The image of all tests: a bright ball on a dark background. The unit of length is arbitrary.
SIZE = 40          # voxels along each axis
H = 0.5            # spacing, in units of length
CENTER = (3.0, -2.0, 1.0)
RADIUS = 12 * H
ORIGIN = tuple(c - H * (SIZE - 1) / 2 for c in CENTER)


def write_nrrd(path, sizes, data, spacing=H, origin=ORIGIN, kind="uint8"):
    n = len(sizes)
    axes = " ".join("(" + ",".join(str(spacing if a == b else 0) for b in range(n)) + ")" for a in range(n))
    lines = ["NRRD0004", f"type: {kind}", f"dimension: {n}"]
    if n == 3:
        lines += ["space: left-posterior-superior"]
    else:
        lines += [f"space dimension: {n}"]
    lines += ["sizes: " + " ".join(map(str, sizes)), f"space directions: {axes}", "endian: little", "encoding: raw",
              "space origin: (" + ",".join(map(str, origin[:n])) + ")", "", ""]
    with open(path, "wb") as file:
        file.write("\n".join(lines).encode() + data)


def ball_bytes():
    """A ball whose edge is blurred over one voxel."""
    middle, half = (SIZE - 1) / 2, range(SIZE // 2)

    def value(i, j, k):
        r = math.dist((i, j, k), (middle,) * 3)
        return int(20 + 200 * min(1, max(0, RADIUS / H - r + 0.5)))

    def whole(part):
        """From one half of a line, a slice or the image, of which the other half is the mirror image."""
        return part + part[::-1]

    return whole(b"".join(whole(b"".join(whole(bytes(value(i, j, k) for i in half)) for j in half)) for k in half))


def sphere_points(count):
    """A Fibonacci lattice on the surface of the ball."""
    golden = math.pi * (3 - math.sqrt(5))
    points = []
    for n in range(count):
        z = 1 - (2 * n + 1) / count
        r = math.sqrt(1 - z * z)
        points.append(tuple(c + RADIUS * v for c, v in
                            zip(CENTER, (r * math.cos(golden * n), r * math.sin(golden * n), z))))
    return points


def radius_of(volume):
    return (volume * 3 / (4 * math.pi)) ** (1 / 3)


def write_xyz(path, points):
    path.write_text("".join("%.6f %.6f %.6f\n" % p for p in points))


class Case(unittest.TestCase):
    """Inputs that are made once, and an empty folder for each test."""

    @classmethod
    def setUpClass(cls):
        cls.inputs = pathlib.Path(tempfile.mkdtemp(prefix="covol-in-"))
        cls.image = cls.inputs / "ball.nrrd"
        cls.points = cls.inputs / "ball.xyz"
        cls.sparse = cls.inputs / "sparse.xyz"  # fewer marks: sufficient for a ball, and faster
        write_nrrd(cls.image, (SIZE,) * 3, ball_bytes())
        write_xyz(cls.points, sphere_points(1500))
        write_xyz(cls.sparse, sphere_points(60))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.inputs)

    def setUp(self):
        self.out = pathlib.Path(tempfile.mkdtemp(prefix="covol-out-"))
        self.addCleanup(shutil.rmtree, self.out)

    def run_covol(self, *args, code=0, cwd=None):
        done = subprocess.run([COVOL, *map(str, args)], capture_output=True, text=True, cwd=cwd or self.out, timeout=300)
        self.assertEqual(done.returncode, code, f"covol {' '.join(map(str, args))}\n{done.stdout}\n{done.stderr}")
        return done

    def report(self, *args, code=0):
        return json.loads(self.run_covol(*args, "--quiet", "--json", "-", code=code).stdout)

    def files(self):
        return sorted(p.name for p in self.out.iterdir())

    def refuse(self, *args, code, expected_text=""):
        """Checks for one clear line, the exit code, and no file."""
        done = self.run_covol(*args, "--quiet", code=code)
        lines = done.stderr.strip().splitlines()
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("covol: error: "), lines[0])
        self.assertIn(expected_text, lines[0])
        self.assertEqual(done.stdout, "")
        self.assertEqual(self.files(), [])
        return lines[0]

    def segment(self, *more, points=None, **keywords):
        return self.run_covol("segment", self.image, "--points", points or self.points, "-o", "s.vdb", *more, **keywords)
