"""Images with sheared axes, and with several channels, on the page of `covol mark`, in headless Chromium.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_images_page_test.py
"""
import math

import numpy as np

from live_client import Page
from mark_page_case import BALL, ORIGIN, SPACING, By, PageCase, write_image

try:
    import tifffile
except ImportError:
    tifffile = None

# Columns: directions of the axes i, j, k. Axis j is tilted by 20 degrees towards i, and k is perpendicular to neither.
SHEARED = np.array([[1, math.sin(math.radians(20)), 0.2], [0, math.cos(math.radians(20)), -0.25], [0, 0, math.sqrt(1 - 0.2 ** 2 - 0.25 ** 2)]])


def write_sheared(folder):
    write_image(folder / "sheared.nrrd", SHEARED, "mm")
    return folder / "sheared.nrrd"


def channel_values(n):
    """A block whose left half is bright in channel 0, and its right half in channel 1."""
    values = np.full((12, 40, 60), 10, np.uint8)
    if n == 0:
        values[:, :, :30] = 200
    else:
        values[:, :, 30:] = 240
    return values


def write_channels(folder):
    data = np.stack([channel_values(0), channel_values(1)], 1)  # axes z, c, y, x
    tifffile.imwrite(folder / "two.tif", data, imagej=True, resolution=(1, 1), metadata={"spacing": 1.0, "unit": "um", "axes": "ZCYX"})
    return folder / "two.tif"


class Images(PageCase):
    def world(self, index):
        return np.array(ORIGIN) + SHEARED @ (np.array(SPACING) * index)

    def test_a_sheared_image_is_marked_where_it_is_seen(self):
        self.open(write=write_sheared)
        for axis, index in ((2, [40.0, 20.0, 30]), (1, [20.0, 42, 45.0]), (0, [34, 60.0, 12.0])):
            self.slices(*[round(v) for v in index])
            self.click(axis, index)
        self.settled()
        marks = self.marks()
        self.assertEqual(len(marks), 3)
        for mark, (axis, index) in zip(marks, ((2, [40, 20, 30]), (1, [20, 42, 45]), (0, [34, 60, 12]))):
            self.near(mark["index"], index, axis)
            np.testing.assert_allclose(mark["world"], self.world(mark["index"]), atol=1e-6)
        # Lengths on the screen are proportional to those in the world, and angles are equal.
        places = [self.js("const p = mark.panels[2]; return p.spotOf(mark.space.toWorld(arguments[0]))", index) for index in ([20, 20, 30], [60, 20, 30], [20, 60, 30])]
        a, b = (np.subtract(place, places[0]) for place in places[1:])
        world_a, world_b = self.world([60, 20, 30]) - self.world([20, 20, 30]), self.world([20, 60, 30]) - self.world([20, 20, 30])
        self.assertAlmostEqual(np.linalg.norm(a) / np.linalg.norm(b), np.linalg.norm(world_a) / np.linalg.norm(world_b), places=3)
        self.assertAlmostEqual(abs(a @ b) / np.linalg.norm(a) / np.linalg.norm(b), abs(world_a @ world_b) / np.linalg.norm(world_a) / np.linalg.norm(world_b), places=3)
        # The picture is sheared like the marks, so that the bright body appears at its voxels.
        self.slices(*BALL)
        for index, is_bright in (([34, 42, 30], True), ([34, 42 - 20, 30], True), ([34, 42 - 30, 30], False), ([34 + 26, 42, 30], False), ([34, 42 + 20, 30], True)):
            self.assertEqual(self.bright(2, index), is_bright, index)
        # A stroke of the brush is a disc in the world, although the voxels are sheared.
        self.keys("b")
        self.click(2, [34.0, 42.0, 30])
        self.settled()
        radius = self.js("return mark.study.structures[0].strokes[0].radius")
        painted = self.js("const s = mark.study.structures[0], c = mark.panels[2].painting.get(s, 2, 30), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
                          "let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n")
        voxel = SPACING[0] * SPACING[1] * math.cos(math.radians(20))
        self.assertAlmostEqual(painted * voxel, math.pi * radius ** 2, delta=0.08 * math.pi * radius ** 2)

    def test_a_plane_of_any_direction_shows_the_image(self):
        self.open(write=write_sheared)
        self.slices(*BALL)
        self.keys("y")
        grey = ("const o = mark.view.oblique, p = o.pixels, n = 384, at = (x, y) => p.slice(4 * (y * n + x), 4 * (y * n + x) + 4);"
                "return o.codes ? [[...at(192, 192)], [...at(0, 0)]] : null")
        middle, corner = self.wait(grey)
        self.assertGreater(middle[0], 110)  # in the middle of the oblique plane, the bright body
        self.assertEqual(middle[3], 255)
        self.assertEqual(corner[3], 0)  # transparent outside of the image
        self.driver.find_element(By.CSS_SELECTOR, ".three canvas").send_keys("]" * 3)
        self.wait("return mark.view.oblique.codes")
        page = Page(self.server.url)
        for bad in ("first=0,0&right=1,0,0&down=0,1,0&count=9", "first=0,0,0&right=1,0,0&down=0,1,x&count=9", "first=0,0,0&right=1,0,0&down=0,1,0&count=0",
                    "first=0,0,0&right=1,0,0&down=0,1,0&count=5000", "first=nan,0,0&right=1,0,0&down=0,1,0&count=9"):
            self.assertEqual(page.get("/oblique?" + bad)[0], 400, bad)
        self.keys("y")
        self.wait("return mark.state.get('oblique') === null")

    def bright(self, axis, index):
        x, y = self.spot(axis, index)
        red = self.js("const p = mark.panels[arguments[0]], c = p.layer.canvas, b = c.getBoundingClientRect(), r = c.width / b.width; p.draw();"
                      "const d = c.getContext('2d').getImageData((arguments[1] - b.left) * r - 3, (arguments[2] - b.top) * r - 3, 7, 7).data;"
                      "let sum = 0; for (let n = 0; n < d.length; n += 4) sum += d[n]; return sum / 49", axis, x, y)
        return red > 110

    def test_channels_are_seen_together_each_in_its_colour(self):
        if tifffile is None:
            self.skipTest("python3-tifffile is not installed")
        self.open(write=write_channels, options=("--channel", "0"))
        self.assertEqual(self.js("return mark.image.channels"), ["channel 0", "channel 1"])
        left, right = self.colours()
        self.assertEqual(left, [255] * 3)
        self.assertLess(max(right), 30)
        self.driver.find_element(By.CSS_SELECTOR, "button[aria-label^='grey values']").click()
        self.driver.find_element(By.CSS_SELECTOR, "[data-channel='1']").click()
        self.wait("return mark.state.get('grey').others?.length === 1 && mark.panels[2].slice.others.size === 1")
        own, other = self.js("const m = mark.state.get('mix'); return [m[0], m[1]]")
        left, right = self.colours()
        np.testing.assert_allclose(left, own, atol=2)
        np.testing.assert_allclose(right, other, atol=2)
        self.assertEqual(self.driver.find_element(By.CSS_SELECTOR, "[data-channel='1']").get_attribute("aria-checked"), "true")
        # The choice of the second channel is kept after a reload of the page.
        self.driver.refresh()
        self.ready()
        self.wait("return mark.panels[2].slice.others.size === 1 && mark.state.get('grey').others?.length === 1")
        np.testing.assert_allclose(self.colours()[1], other, atol=2)
        self.driver.find_element(By.CSS_SELECTOR, "button[aria-label^='grey values']").click()
        self.driver.find_element(By.CSS_SELECTOR, "[data-channel='1']").click()
        self.wait("return mark.panels[2].slice.others.size === 0")
        self.assertEqual(self.colours()[0], [255] * 3)
        page = Page(self.server.url)
        self.assertEqual(page.json("/channel?channel=1"), {"low": 10, "high": 240, "black": 10, "white": 240})
        for bad in ("/channel?channel=2", "/channel?channel=-1", "/channel?channel=x", "/slice?axis=2&at=1&step=1&channel=9"):
            self.assertEqual(page.get(bad)[0], 400, bad)

    def colours(self):
        """Brightness on the left and on the right of the middle, as drawn."""
        self.wait("return mark.slices.underWay.size === 0")
        found = []
        for index in ([10, 20, 5], [50, 20, 5]):
            x, y = self.spot(2, index)
            found.append(self.js("const p = mark.panels[2], c = p.layer.canvas, b = c.getBoundingClientRect(), r = c.width / b.width; p.draw();"
                                 "return [...c.getContext('2d').getImageData((arguments[0] - b.left) * r, (arguments[1] - b.top) * r, 1, 1).data].slice(0, 3)", x, y))
        return found
