"""Pictures of `covol render`, with the real binary, read back by Pillow.

    COVOL=build/bin/covol python3 -m unittest tests/cli/pictures_test.py
"""
import unittest

import numpy as np
from PIL import Image

from cli_test import Case, write_nrrd
from structures_test import H, ORIGIN, ball_image, ball_points, write_points

BLUE, RED = (68, 119, 170), (238, 102, 119)  # the first two structures'


def near(pixels, color, most=60):
    return np.abs(pixels.astype(int) - color).sum(axis=-1) < most


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
        middle = both[60:240]  # below the legend
        # Hue, for shades differ.
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
        self.assertEqual((one[:240, ..., 2].astype(int) - one[:240, ..., 0] > 30).sum(), 0)  # below are blue axes
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
                (("--figure", "slices"), 3, "slices are of an image"),
                (("--volume",), 3, "volume view is of an image"),
                (("--view", "aside"), 3, "expected front, back"),
                (("--view", "10,100"), 3, "elevation"),
                (("--opacity", "2"), 2, "0 to 1"),
                (("--opacity", "middle=0.5"), 2, "expected NAME=SHARE with a level set of the file (left, right)"),
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
