"""Common to the tests of structures, time-lapse and evidence: images of balls, marks on them, and tables."""
import csv
import math
import os

import numpy as np

SIZE = 48
H = 0.5
ORIGIN = (-H * (SIZE - 1) / 2,) * 3
DATA = os.environ.get("COVOL_DATA")


def fibonacci(count):
    golden = math.pi * (3 - math.sqrt(5))
    z = 1 - (2 * np.arange(count) + 1) / count
    r = np.sqrt(1 - z * z)
    turn = golden * np.arange(count)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def ball_points(center, radius, count=1500):
    return np.asarray(center) + radius * fibonacci(count)


def write_points(path, points):
    path.write_text("".join("%.6f %.6f %.6f\n" % tuple(p) for p in points))


def lattice(size=SIZE, h=H, origin=ORIGIN):
    """World coordinates of the voxel centres, indexed [z][y][x]."""
    axes = [o + h * np.arange(size) for o in origin]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    return x, y, z


def ball_image(center, radius, size=SIZE, h=H, origin=ORIGIN):
    x, y, z = lattice(size, h, origin)
    r = np.sqrt((x - center[0]) ** 2 + (y - center[1]) ** 2 + (z - center[2]) ** 2)
    return (20 + 200 * np.clip((radius - r) / h + 0.5, 0, 1)).astype(np.uint8)


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def nrrd_keys(path):
    header = path.read_bytes().split(b"\n\n", 1)[0].decode()
    return dict(line.split(":=", 1) for line in header.splitlines() if ":=" in line)
