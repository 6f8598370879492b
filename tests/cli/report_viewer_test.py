"""Interaction with a report page by real mouse, touch and key events in headless Chromium.

    COVOL=build/bin/covol python3 -m unittest tests/cli/report_viewer_test.py
"""
import math
import os
import re
import unittest

import axe
from covol_case import H, ORIGIN
from report_page_case import COARSE, BrowserCase, By, Keys, WebDriverWait, data_of


class Viewer(BrowserCase):
    def test_zoom_pan_window_and_value(self):
        self.open(self.two())
        self.slices(20, 20, 20)
        spot = self.spot(2, [26, 18, 20])
        place = self.js("const p = report.panels[2], box = p.canvas.getBoundingClientRect(); return p.plane.unplace(arguments[0] - box.left, arguments[1] - box.top)", *spot)
        self.mouse(("wheel", *spot, -200), keys=[Keys.CONTROL])
        zoom = self.js("return report.state.get('views')[2].zoom")
        self.assertGreater(zoom, 1.2)
        after = self.spot(2, [*place, 20])
        # The wheel zooms about the cursor, so that the position under it stays in place, up to 1.5 px.
        self.assertLess(math.hypot(after[0] - spot[0], after[1] - spot[1]), 1.5)
        self.mouse(("move", *spot), ("down", 1), ("move", spot[0] + 40, spot[1] + 30), ("up", 1))
        after = self.spot(2, [*place, 20])
        self.assertLess(math.hypot(after[0] - spot[0] - 40, after[1] - spot[1] - 30), 1.5)
        before, picture = self.js("return report.state.get('window')"), self.slice_picture(2)
        self.mouse(("move", *spot), ("down", 2), ("move", spot[0] + 120, spot[1]), ("up", 2))
        window = self.js("return report.state.get('window')")
        self.assertGreater(window["white"] - window["black"], 1.5 * (before["white"] - before["black"]))
        self.assertNotEqual(self.slice_picture(2), picture)
        self.mouse(("move", *self.spot(2, [20, 20, 20])))
        cursor = self.driver.find_element(By.CSS_SELECTOR, ".status .cursor").text
        self.assertIn("voxel 20, 20, 20", cursor)
        image = data_of(self.two())["image"]
        value = float(re.search(r"value \u2248\u2009([\d.]+)", cursor)[1])
        # Voxel 20, 20, 20 is in the bright ball.
        self.assertGreater(value, image["black"] + 0.8 * (image["white"] - image["black"]))
        self.load(self.driver.current_url)  # a reload: zoom and window are kept
        self.assertAlmostEqual(self.js("return report.state.get('views')[2].zoom"), zoom)
        self.assertEqual(self.js("return report.state.get('window')"), window)
        self.js("document.activeElement.blur()")
        self.keys("r")
        self.assertEqual(self.js("return report.state.get('views')"), [None] * 3)

    def test_two_fingers_zoom_and_move_the_picture(self):
        self.open(self.two())
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 400, "height": 850, "deviceScaleFactor": 1, "mobile": True})
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
        self.addCleanup(self.driver.execute_cdp_cmd, "Emulation.clearDeviceMetricsOverride", {})
        self.addCleanup(self.driver.execute_cdp_cmd, "Emulation.setTouchEmulationEnabled", {"enabled": False})
        self.js("report.panels[2].canvas.scrollIntoView({block: 'center'})")
        x, y = self.spot(2, [20, 20, self.slices()[2]])
        touch = lambda kind, *places: self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": a, "y": b, "id": n} for n, (a, b) in enumerate(places)]})
        touch("touchStart", (x - 30, y))
        touch("touchStart", (x - 30, y), (x + 30, y))
        for n in range(1, 7):
            touch("touchMove", (x - 30 - 5 * n, y), (x + 30 + 5 * n, y))
        touch("touchEnd")
        self.assertAlmostEqual(self.js("return report.state.get('views')[2]?.zoom ?? 1"), 2, delta=0.15)
        after = self.spot(2, [20, 20, self.slices()[2]])
        self.assertLess(math.hypot(after[0] - x, after[1] - y), 4)
        self.assertEqual(self.new_marks(), [])

    def test_slider_wheel_keys_and_click_change_the_slice(self):
        self.open(self.two())
        slider = self.driver.find_element(By.CSS_SELECTOR, 'input[data-axis="2"]')
        before, middle = self.slice_picture(2), self.slices()[2]
        self.js("arguments[0].value = 12; arguments[0].dispatchEvent(new Event('input'))", slider)
        self.assertEqual(self.slices()[2], 12)
        self.assertNotEqual(12, middle)
        self.assertNotEqual(self.slice_picture(2), before)
        where = self.driver.find_element(By.CSS_SELECTOR, ".axis-2 .where")
        self.assertIn("12 of 0\u201339", where.text)
        where.click()  # changes the slice numbers to count from 1, as in Fiji
        WebDriverWait(self.driver, 10).until(lambda _: "13 of 1\u201340" in where.text)
        spot = self.spot(2, [15, 25, 12])
        self.mouse(("wheel", *spot, 100))
        self.assertEqual(self.slices()[2], 13)
        self.click(2, [15, 25, 13])  # the initial tool is the crosshair, which moves to the click
        self.assertEqual(self.slices(), [15, 25, 13])
        self.keys("]", Keys.ARROW_LEFT)
        self.assertEqual(self.slices(), [14, 25, 14])

    def test_marks_are_set_undone_and_read_by_covol(self):
        self.open(self.two())
        self.slices(20, 20, 20)
        given = len(self.marks())
        self.keys("s")
        self.click(2, [33, 20, 20])
        self.click(2, [20, 33, 20])
        self.click(2, [22, 21, 20], Keys.SHIFT)
        self.assertEqual([kind for kind, *_ in self.new_marks()], ["surface", "surface", "inside"])
        self.near(self.new_marks()[0][1:], [33, 20, 20])
        start, end = self.spot(2, [33, 20, 20]), self.spot(2, [31, 18, 20])
        self.mouse(("move", *start), ("down", 0), ("move", (start[0] + end[0]) // 2, (start[1] + end[1]) // 2), ("move", *end), ("up", 0))
        self.near(self.new_marks()[0][1:], [31, 18, 20])
        self.keys("z")
        self.near(self.new_marks()[0][1:], [33, 20, 20])
        self.keys("Z")
        self.near(self.new_marks()[0][1:], [31, 18, 20])
        self.mouse(("move", *self.spot(2, [20, 33, 20])))
        self.keys(Keys.DELETE)
        self.assertEqual(len(self.marks()), given + 2)
        self.keys("z")
        self.load(self.driver.current_url)
        kept = self.marks()
        self.assertEqual(len(kept), given + 3)  # all marks are there after the reload
        self.assertEqual(self.downloads(), {"first_marks.csv", "first_new_marks.csv", "first_inside.csv", "structures.csv", *self.second_files()})
        for name, count in (("first_marks.csv", given + 2), ("first_inside.csv", 1)):
            rows = self.rows(name)
            self.assertEqual((len(rows), list(rows[0])), (count, ["x", "y", "z"]))
        worlds = [[float(row[c]) for c in "xyz"] for row in self.rows("first_marks.csv")]
        wanted = [[ORIGIN[a] + H * index[a] for a in range(3)] for kind, *index in kept if kind == "surface"]
        for one, other in zip(worlds, wanted):
            self.assertLess(math.dist(one, other), 1e-3)
        run = self.report("segment", self.image, "--points", self.saved / "first_marks.csv", "--inside", self.saved / "first_inside.csv", *COARSE, "-o", "again.vdb")
        self.assertEqual((run["input"]["points"]["count"], run["seeds"]["inside"]), (given + 2, 1))

    def test_an_oblique_plane_faces_the_eye_and_shows_the_image(self):
        self.open(self.two())
        self.slices(20, 20, 20)
        before = self.picture()[1]
        self.keys("d")
        self.assertNotEqual(self.picture()[1], before)
        normal, eye = self.js("const v = report.view, e = v.camera.position.clone().sub(v.controls.target).normalize(); return [report.state.get('oblique').normal, e.toArray()]")
        self.assertLess(math.dist(normal, eye), 1e-6)
        # The oblique plane goes through the middle of the ball: bright at the middle of the picture, dark beyond the
        # ball.
        values = self.js("""
            const {pixels} = report.view.oblique, n = Math.sqrt(pixels.length / 4), at = (x, y) => pixels[4 * (Math.round(y * (n - 1)) * n + Math.round(x * (n - 1)))];
            return [at(0.5, 0.5), at(0.5, 0.72), at(0.72, 0.5)];""")
        self.assertGreater(values[0], 200)
        self.assertLess(max(values[1:]), 60)
        self.assertGreater(self.js("return report.view.oblique.lines.geometry.getAttribute('position').count"), 100)
        whole = self.picture()[1]
        self.js("report.state.set({cut: 3})")
        self.assertNotEqual(self.picture()[1], whole)
        self.js("report.view.canvas.focus()")
        self.keys("]")
        moved = self.js("const o = report.state.get('oblique'), c = report.space.toWorld([20, 20, 20]); return o.center.map((x, a) => x - c[a])")
        self.assertAlmostEqual(math.hypot(*moved), H, places=6)

    def test_frames_are_gone_through_and_seen_in_the_same_way(self):
        pages = [self.pages / f"frames_t00{n}.html" for n in range(2)]
        self.run_covol("segment", self.image, self.image, "--points", self.few, *COARSE, "-o", "s.vdb", "--report", self.pages / "frames.html")
        self.open(pages[0])
        self.slices(9, 21, 14)
        self.js("report.panels[2].zoomAt(3); report.view.rotate(1, 0)")
        camera = self.js("return report.view.camera.position.toArray()")
        self.keys(".")
        WebDriverWait(self.driver, 60).until(lambda d: d.current_url == pages[1].as_uri() and d.execute_script("return Boolean(window.covolReport?.done)"))
        self.assertEqual((self.slices(), self.js("return Math.round(report.state.get('views')[2].zoom)")), ([9, 21, 14], 3))
        self.assertLess(math.dist(self.js("return report.view.camera.position.toArray()"), camera), 1e-4)
        slider = self.driver.find_element(By.CSS_SELECTOR, ".frames input")
        self.assertEqual(slider.get_attribute("value"), "1")
        self.js("arguments[0].value = 0; arguments[0].dispatchEvent(new Event('change'))", slider)
        WebDriverWait(self.driver, 60).until(lambda d: d.current_url == pages[0].as_uri() and d.execute_script("return Boolean(window.covolReport?.done)"))

    def test_the_keyboard_alone(self):
        """Tab reaches the plane; keys move, mark, enlarge, and list the keys, but do not measure."""
        self.open(self.two())
        self.js("document.querySelector('.axis-2 .where').focus()")
        for _ in range(4):
            self.keys(Keys.TAB)
            if self.js("return document.activeElement === report.panels[2].canvas"):
                break
        self.assertTrue(self.js("return document.activeElement === report.panels[2].canvas"))
        at = self.slices()
        self.keys(Keys.ARROW_RIGHT, "]", "i", "a")
        at = [at[0] + 1, at[1], at[2] + 1]
        self.assertEqual(self.slices(), at)
        (kind, *index), = self.new_marks()
        self.assertEqual(kind, "inside")
        self.near(index, at)
        self.keys("z", "f")
        self.assertEqual((self.new_marks(), self.js("return report.state.get('large')")), ([], 2))
        self.keys("f", "?")
        self.assertTrue(self.js("return document.querySelector('dialog.help').open"))
        self.keys(Keys.ESCAPE)
        self.assertFalse(self.js("return document.querySelector('dialog.help').open"))

    def test_every_control_has_a_name(self):
        self.open(self.two())
        nameless = self.js("""
            return [...document.querySelectorAll('button, a, input, select, canvas, summary, [role=menu], [role=region]')].filter((e) => !e.closest('[aria-hidden=true]') &&
                !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label')?.textContent.trim())).map((e) => e.outerHTML)""")
        self.assertEqual(nameless, [])
        unreachable = self.js("return [...document.querySelectorAll('#page button, #page a[href], #page input, #page select, #page canvas')].filter((e) => e.tabIndex < 0 && !e.closest('[aria-hidden=true]') && e.getAttribute('role') !== 'menuitem').map((e) => e.outerHTML)")
        self.assertEqual(unreachable, [])

    @unittest.skipIf(axe.MISSING, axe.MISSING)
    def test_axe_finds_no_serious_fault(self):
        self.open(self.two())
        for width in (1200, 400):
            self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width == 400})
            for _ in range(2):
                self.assertEqual(axe.serious_faults(self.driver), [])
                self.keys("t")
        self.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def second_files(self):
        return {name for name in os.listdir(self.saved) if name.startswith("second")}


if __name__ == "__main__":
    unittest.main()
