"""Pictures of `covol render`, with the real binary, read back by Pillow.

    COVOL=build/bin/covol python3 -m unittest tests/cli/pictures_test.py
"""
import unittest

import numpy as np
import pyopenvdb as vdb
from PIL import Image

from covol_case import Case, write_nrrd
from structures_case import H, ORIGIN, ball_image, ball_points, write_points

BLUE, RED = (68, 119, 170), (238, 102, 119)  # colours of the first and the second structure, 0 to 255


def near(pixels, color, upper_bound=60):
    return np.abs(pixels.astype(int) - color).sum(axis=-1) < upper_bound


class Pictures(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.left, cls.right = cls.inputs / "left.xyz", cls.inputs / "right.xyz"
        centers = {cls.left: (-5, 0, 0), cls.right: (5, 0, 1)}
        for path, center in centers.items():
            write_points(path, ball_points(center, 4, 400))
        cls.stack = cls.inputs / "two.nrrd"
        image = np.maximum(*(ball_image(c, 4) for c in centers.values()))
        write_nrrd(cls.stack, image.shape[::-1], image.tobytes(), H, ORIGIN)
        cls.two = cls.inputs / "two.vdb"

    def setUp(self):
        super().setUp()
        if not self.two.exists():
            self.run_covol("segment", self.stack, "--points", f"left={self.left}", f"right={self.right}", "-o", self.two)

    def picture(self, *arguments, name="p.png"):
        self.run_covol("render", self.two, *arguments, "-o", name)
        return np.asarray(Image.open(self.out / name).convert("RGB"))

    def test_all_structures_or_one(self):
        both = self.picture("--figure", "surface", "--view", "front", "--size", "500x300")
        self.assertEqual(both.shape, (300, 500, 3))
        middle = both[60:240]  # rows below the legend
        # Pixels are classified by the difference of blue and red, because the brightness varies with the shading.
        blue = (middle[..., 2].astype(int) - middle[..., 0] > 30).nonzero()[1]
        red = (middle[..., 0].astype(int) - middle[..., 2] > 30).nonzero()[1]
        self.assertGreater(len(blue), 4000)
        self.assertGreater(len(red), 4000)
        self.assertLess(blue.mean(), 250)
        self.assertGreater(red.mean(), 250)
        self.assertGreater(near(both[:60, :60], BLUE).sum(), 20)
        self.assertGreater(near(both[:60, :60], RED).sum(), 20)
        self.two = f"{self.two}:left"
        one = self.picture("--figure", "surface", "--view", "front", "--size", "500x300", name="q.png")
        # A single structure has the default colour, which is not blue. Rows from 240 on are left out, because they
        # contain the axes, one of which is blue.
        self.assertEqual((one[:240, ..., 2].astype(int) - one[:240, ..., 0] > 30).sum(), 0)
        behind = self.picture("--figure", "surface", "--view", "back", "--size", "500x300", name="r.png")
        self.assertFalse(np.array_equal(one, behind))

    def test_slices_show_outlines_in_the_structures_colours(self):
        pixels = self.picture("--image", self.stack, "--figure", "slices", "--slices", 2, "--slice-axis", "x", "--size", "600x400")
        self.assertGreater(near(pixels, BLUE).sum(), 60)
        self.assertGreater(near(pixels, RED).sum(), 60)
        planes = self.picture("--image", self.stack, "--figure", "slices", "--size", "600x400", "--at", "-5,0,0")
        self.assertGreater(near(planes, BLUE).sum(), near(planes, RED).sum())
        composed = self.picture("--image", self.stack, "--points", f"left={self.left}", f"right={self.right}", "--size", "600x400")
        white = (composed > 250).all(axis=-1)
        for part in (white[:200, :300], white[:200, 300:], white[200:, :300], white[200:, 300:]):
            self.assertLess(part.mean(), 0.9)
        self.assertFalse(np.array_equal(composed, self.picture("--image", self.stack, "--size", "600x400")))

    def nest(self, apart):
        """A core and a surrounding layer; the wall of the layer is partly in front of that of the core and partly behind it, by up
        to `apart` voxels."""
        x, y, z = np.mgrid[-16:17, -16:17, -16:17] + 0.3
        r, grids = np.sqrt(x**2 + y**2 + z**2), []
        inner = 7 + apart * np.sin(x) * np.sin(z)
        for name, away in (("core", r - 7), ("layer", np.maximum(inner - r, r - 14))):
            grid = vdb.FloatGrid(3.0)
            grid.copyFromArray(np.clip(away, -3, 3).astype(np.float32), tolerance=0)
            grid.name, grid.gridClass = name, vdb.GridClass.LEVEL_SET
            grids.append(grid)
        self.two = self.out / "nested.vdb"
        vdb.write(str(self.two), grids)

    def test_a_common_wall_has_the_colour_of_the_one_behind(self):
        self.nest(0.2)
        pixels = self.picture("--figure", "surface", "--view", "front", "--size", "400x400").astype(int)
        y, x = np.mgrid[0:400, 0:400]
        ball = (pixels.max(axis=-1) - pixels.min(axis=-1) > 20) & (y > 60) & (y < 360)
        middle, radius = (x[ball].mean(), y[ball].mean()), np.sqrt(ball.sum() / np.pi)
        away = np.hypot(x - middle[0], y - middle[1]) / radius
        redness = pixels[..., 0] - pixels[..., 2]
        behind, beside = redness[away < 0.4], redness[(away > 0.6) & (away < 0.8)]
        self.assertLess(behind.std(), 0.25 * (beside.mean() - behind.mean()), "specks of the layer's inner wall on the core")

    def test_a_common_outline_shows_both(self):
        self.nest(0)
        write_nrrd(self.out / "grey.nrrd", (33,) * 3, np.full(33**3, 128, np.uint8).tobytes(), 1, (-16,) * 3)
        pixels = self.picture("--image", "grey.nrrd", "--figure", "slices", "--slices", 1, "--size", "1200x1200").astype(int)
        blueness = pixels[:1100, ..., 2] - pixels[:1100, ..., 0]  # rows above the legend
        self.assertGreater((blueness > 40).sum(), 800)
        self.assertGreater((blueness < -40).sum(), 800)

    def test_background_opacity_and_volume(self):
        size = ("--figure", "surface", "--size", "300x200")
        plain = self.picture(*size)
        self.assertTrue((plain[0] > 250).all())
        self.assertTrue((self.picture(*size, "--background", "black")[0] < 5).all())
        pale = self.picture(*size, "--opacity", 0.3)
        self.assertGreater(pale.mean(), plain.mean() + 3)
        half = self.picture(*size, "--opacity", "left=0.3")
        self.assertTrue(plain.mean() < half.mean() < pale.mean())
        self.assertFalse(np.array_equal(self.picture(*size, "--image", self.stack, "--volume", "--opacity", 1), plain))
        self.assertGreater((self.picture(*size, "--zoom", 0.5) > 250).all(axis=-1).sum(), (plain > 250).all(axis=-1).sum())

    def test_turntable(self):
        self.run_covol("render", self.two, "--turntable", 3, "--size", "200x160", "-o", "turn.png")
        self.assertEqual(sorted(self.files()), ["turn_0001.png", "turn_0002.png", "turn_0003.png"])
        frames = [np.asarray(Image.open(self.out / f"turn_{n:04}.png")) for n in (1, 2, 3)]
        for a, b in ((0, 1), (1, 2), (0, 2)):
            self.assertGreater((frames[a] != frames[b]).any(axis=-1).mean(), 0.02)

    def test_mistakes(self):
        for arguments, code, message in (
                (("--figure", "slices"), 3, "slices: expected an image, got none"),
                (("--volume",), 3, "volume: expected an image, got none"),
                (("--view", "aside"), 3, "expected front, back"),
                (("--view", "10,100"), 3, "elevation"),
                (("--opacity", "2"), 2, "0 to 1"),
                (("--opacity", "middle=0.5"), 2, "expected NAME=FRACTION with a level set of the file (left, right)"),
                (("--points", f"middle={self.left}"), 2, "(left, right)"),
                (("--zoom", "0"), 3, "zoom"),
                (("--slices", "-1"), 3, "slices"),
                (("--turntable", "-3"), 3, "--turntable: expected"),
                (("--size", "wide"), 2, "WIDTHxHEIGHT"),
                (("--slice-axis", "w"), 2, "slice-axis")):
            done = self.run_covol("render", self.two, *arguments, "-o", "x.png", code=code)
            self.assertIn(message, done.stderr)
            self.assertEqual(self.files(), [])


if __name__ == "__main__":
    unittest.main()
