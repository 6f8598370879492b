"""Images that are rotated, flipped and have permuted axes: every start gives the same body, with the real program.

    COVOL=build/bin/covol python3 -m unittest tests/cli/tilted_test.py

One phantom, an ellipsoid that the image's first slice cuts off (and another one that two of its faces cut, at their edge), placed
in the world in several ways. Marks are in world units and move with the phantom.
"""
import csv
import math
import unittest
import zlib

import numpy as np

from covol_case import Case

SIZES = np.array([40, 36, 26])          # number of voxels along i, j, k
SPACING = np.array([0.5, 0.5, 0.75])
RADII = np.array([6.0, 5.0, 7.0])
# Centres of the two ellipsoids: lengths along the phantom's axes from the centre of voxel (0, 0, 0).
MIDDLES = {"slice": np.array([9.75, 8.75, 4.0]), "edge": np.array([2.5, 8.75, 4.0])}


def rotation(axis, angle):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


class Place:
    """Placement of the image in the world: the columns of `direction` are the directions of its axes; `order` states which of the
    phantom's axes are the file's i, j and k."""

    def __init__(self, direction, order=(0, 1, 2)):
        self.direction, self.order = np.asarray(direction, float), list(order)
        self.origin = np.array([12.0, -30.0, 101.0])

    def to_world(self, along):
        """World positions from lengths along the phantom's own axes."""
        return self.origin + np.asarray(along) @ self.direction.T

    def write(self, path, values, kind="uint8"):
        """@param values  k, j, i of the phantom"""
        stored = np.transpose(values, [2 - a for a in self.order[::-1]])
        vectors = (self.direction * SPACING)[:, self.order]
        head = ["NRRD0004", f"type: {kind}", "dimension: 3", "space: left-posterior-superior",
                "sizes: " + " ".join(str(SIZES[a]) for a in self.order),
                "space directions: " + " ".join("(" + ",".join(f"{v:.17g}" for v in column) + ")" for column in vectors.T),
                "endian: little", "encoding: raw", "space origin: (" + ",".join(f"{v:.17g}" for v in self.origin) + ")", "", ""]
        path.write_bytes("\n".join(head).encode() + np.ascontiguousarray(stored).astype(kind).tobytes())
        return path

    def read(self, path):
        """Back to the phantom's k, j, i."""
        header, pixels = path.read_bytes().split(b"\n\n", 1)
        if b"gzip" in header:
            pixels = zlib.decompress(pixels, 47)
        stored = np.frombuffer(pixels, "u1").reshape([SIZES[a] for a in self.order[::-1]])
        return np.transpose(stored, np.argsort([2 - a for a in self.order[::-1]])) > 0


UPRIGHT = Place(np.eye(3))
PLACES = {
    "turned by 0.35 about x": Place(rotation((1, 0, 0), 0.35)),
    "turned by 0.5 about y": Place(rotation((0, 1, 0), 0.5)),
    "turned by 0.8 about a diagonal": Place(rotation((1, 2, 3), 0.8)),
    "flipped": Place(np.diag([1.0, -1.0, -1.0])),
    "mirrored and turned": Place(rotation((2, 1, -1), 0.6) @ np.diag([-1.0, 1.0, 1.0])),
    "axes k, i, j": Place(np.eye(3), (2, 0, 1)),
    "axes j, k, i, turned": Place(rotation((1, 1, 0), 0.45), (1, 2, 0)),
}


def lattice():
    k, j, i = np.meshgrid(*(SPACING[a] * np.arange(SIZES[a]) for a in (2, 1, 0)), indexing="ij")
    return np.stack([i, j, k], -1)


def level(cut):
    """Approximate distance to the body's surface, negative inside."""
    q = (lattice() - MIDDLES[cut]) / RADII
    r = np.linalg.norm(q, axis=-1)
    return (r - 1) * r / np.maximum(np.linalg.norm(q / RADII, axis=-1), 1e-9)


def sections(cut, step=3):
    """Outlines on every step-th slice, beginning with the first, as lengths along the axes, within the image."""
    lines = []
    for k in range(0, SIZES[2], step):
        w = (SPACING[2] * k - MIDDLES[cut][2]) / RADII[2]
        if abs(w) > 0.97:
            continue
        turns = 2 * np.pi * np.arange(64) / 64
        line = MIDDLES[cut] + np.stack([np.cos(turns), np.sin(turns), 0 * turns], 1) * RADII * math.sqrt(1 - w * w)
        line[:, 2] = SPACING[2] * k
        lines.append(np.maximum(line, -0.5 * SPACING * [1, 1, 0]))
    return lines


def on_surface(cut, count):
    """Points all over the surface within the image, but not on the cut."""
    n = np.arange(count) + 0.5
    z = 1 - 2 * n / count
    turn = np.pi * (1 + 5 ** 0.5) * n
    r = np.sqrt(1 - z * z)
    points = MIDDLES[cut] + RADII * np.stack([r * np.cos(turn), r * np.sin(turn), z], 1)
    return points[(points >= 0).all(1)]


def dice(a, b):
    return 2 * np.count_nonzero(a & b) / (np.count_nonzero(a) + np.count_nonzero(b))


class TiltedCase(Case):
    def starts(self, place, cut, folder):
        """The arguments of segment, except image and outputs, by the start's name."""
        truth = level(cut) < 0
        contours = folder / "contours.csv"
        with open(contours, "w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["contour", "x", "y", "z"])
            for n, line in enumerate(sections(cut)):
                table.writerows([n, *(f"{v:.6f}" for v in p)] for p in place.to_world(line))

        def cloud(name, points):
            path = folder / f"{name}.xyz"
            np.savetxt(path, place.to_world(points), "%.6f")
            return path

        def triple(p):
            return ",".join(f"{v:.6f}" for v in place.to_world(p))

        painted = truth.copy()
        painted[np.arange(SIZES[2]) % 3 != 0] = False
        mask = place.write(folder / "mask.nrrd", truth)
        inner = MIDDLES[cut] + 0.6 * (on_surface(cut, 200) - MIDDLES[cut])
        outer = MIDDLES[cut] + 1.35 * (on_surface(cut, 200) - MIDDLES[cut])
        outer = outer[((outer >= 0) & (outer <= SPACING * (SIZES - 1))).all(1)]
        middle = np.maximum(MIDDLES[cut], 2.5)
        return {
            "contours": ("--contours", contours),
            "contours alone": ("--contours", contours, "--rho", 0),
            "painted": ("--painted", place.write(folder / "paint.nrrd", painted)),
            "points": ("--points", cloud("marks", on_surface(cut, 80))),
            "points alone": ("--points", folder / "marks.xyz", "--rho", 0),
            "tag": ("--points", cloud("many", on_surface(cut, 2500)), "--init", "tag"),
            "seeds": ("--inside", cloud("inner", inner), "--outside", cloud("outer", outer)),
            "seed alone": ("--inside", triple(middle)),
            "guess": ("--guess", mask),
            "sphere": ("--theta", 0, "--init", f"sphere:{triple(middle)},2"),
            "mask": ("--theta", 0, "--init", f"mask:{mask}"),
        }

    def segment(self, place, cut, name):
        """(mask, report)"""
        folder = self.out
        values = np.clip(40 + 160 * np.clip(0.5 - level(cut) / 0.5, 0, 1), 0, 255)
        image = place.write(folder / "image.nrrd", values)
        report = self.report("segment", image, *self.starts(place, cut, folder)[name], "-o", "s.vdb", "--mask", "m.nrrd")
        return place.read(folder / "m.nrrd"), report

    def compare(self, cut, name, minimum=0.97, min_of_truth=0.94):
        truth = level(cut) < 0
        upright, _ = self.segment(UPRIGHT, cut, name)
        self.assertGreater(dice(upright, truth), min_of_truth, f"{name}, upright")
        for how, place in PLACES.items():
            with self.subTest(start=name, place=how, cut=cut):
                mask, report = self.segment(place, cut, name)
                surface = report["surface"]
                self.assertGreater(dice(mask, upright), minimum)
                self.assertGreater(dice(mask, truth), min_of_truth)
                self.assertEqual((surface["components"], surface["genus"]), (1, 0))
                volume = np.count_nonzero(mask) * np.prod(SPACING)
                self.assertLess(abs(surface["volume"] / volume - 1), 0.03)


class Marks(TiltedCase):
    def test_contours(self):
        for cut in MIDDLES:
            self.compare(cut, "contours")
            self.compare(cut, "contours alone")

    def test_painted(self):
        self.compare("slice", "painted")
        self.compare("edge", "painted")

    def test_points(self):
        for cut in MIDDLES:
            self.compare(cut, "points")
        self.compare("slice", "points alone")

    def test_tag(self):
        self.compare("slice", "tag")


class Starts(TiltedCase):
    def test_seeds(self):
        self.compare("slice", "seeds")
        self.compare("slice", "seed alone")

    def test_guess_and_mask(self):
        self.compare("slice", "guess")
        self.compare("edge", "mask")

    def test_sphere(self):
        self.compare("slice", "sphere")


if __name__ == "__main__":
    unittest.main()
