"""Marks, outlines and views of the page of `covol mark` in headless Chromium, with real mouse and key events.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_page_test.py
"""
import math
import unittest

import axe
from mark_page_case import BALL, RADII, By, Keys, PageCase


class Marks(PageCase):
    def clicks_in_all_planes(self, **options):
        self.open(**options)
        for axis in (2, 1, 0):
            self.slices(30, 35, 25)
            wanted = [30, 35, 25]
            for a in range(3):
                wanted[a] += 0 if a == axis else 7.25
            before = len(self.marks())
            self.click(axis, wanted)
            self.assertEqual(len(self.marks()), before + 1)
            self.near(self.marks()[-1]["index"], wanted, axis)
            # The view of the plane is enlarged 5 times about the mark, which is not in the middle of the view. The next
            # mark is set by a click on the voxel position `again`.
            x, y = self.spot(axis, wanted)
            self.js("const p = mark.panels[arguments[0]], b = p.canvas.getBoundingClientRect(); p.zoomAt(5, arguments[1] - b.left, arguments[2] - b.top)", axis, x, y)
            self.slices(31, 36, 26)
            again = [31, 36, 26]
            for a in range(3):
                again[a] += 0 if a == axis else 6.4
            self.click(axis, again)
            self.assertEqual(len(self.marks()), before + 2)
            for a in range(3):
                self.assertLess(abs(self.marks()[-1]["index"][a] - again[a]), 1e-6 if a == axis else 0.1)
            self.keys("r")
        self.settled()
        self.assertEqual([m["kind"] for m in self.marks()], ["surface"] * 6)
        self.assertEqual([action["do"] for action in self.server.journal()], ["add_structure"] + ["add_mark"] * 6)

    def test_a_click_sets_a_mark_where_it_is(self):
        self.clicks_in_all_planes()

    def test_a_click_sets_a_mark_in_a_turned_image(self):
        self.clicks_in_all_planes(is_turned=True)

    def test_a_click_sets_a_mark_in_an_anatomical_image(self):
        self.clicks_in_all_planes(is_turned=True, is_anatomical=True)

    def test_the_first_click_makes_a_structure_and_it_gets_a_surface(self):
        self.open()
        self.assertEqual(self.structures(), [])
        self.mark_ball(3)
        self.assertEqual([s["name"] for s in self.structures()], ["structure 1"])
        self.assertIn("1 more mark is needed", self.driver.find_element(By.CSS_SELECTOR, ".structure .message").text)
        self.mark_ball(14)
        self.surface()
        self.slices(*BALL)
        self.wait("return mark.lastShown > mark.lastAction")
        # The result includes the last mark.
        self.wait("const r = mark.study.structures[0].result; return r.stage === 'refined' && r.seq === mark.study.seq")
        self.assertGreater(self.js("return mark.resultsSeen"), 1)
        self.assertIn("µm³", self.driver.find_element(By.CSS_SELECTOR, ".structure .figures").text)
        self.assertRegex(self.driver.find_element(By.CSS_SELECTOR, ".structure .dice").text, r"0\.\d\d \(0\.\d\d–0\.\d\d\)")

    def test_kinds_of_marks_and_the_crosshair(self):
        self.open()
        self.slices(*BALL)
        self.click(2, [30, 40, 30])
        self.click(2, [40, 50, 30], Keys.SHIFT)
        self.click(2, [60, 60, 30], Keys.ALT)
        self.keys("i")
        self.click(2, [38, 30, 30])
        self.settled()
        self.assertEqual([m["kind"] for m in self.marks()], ["surface", "inside", "outside", "inside"])
        self.click(2, [50, 20, 30], Keys.CONTROL)
        self.assertEqual(len(self.marks()), 4)
        self.assertEqual(self.slices(), [50, 20, 30])
        self.hover(1, [20, 20, 10])
        self.keys("x")
        self.assertEqual(self.slices(), [20, 20, 10])

    @unittest.skipIf(axe.MISSING, axe.MISSING)
    def test_axe_finds_no_serious_fault(self):
        self.open()
        self.mark_ball(6)
        for width in (1400, 400):
            self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width == 400})
            for _ in range(2):
                self.assertEqual(axe.serious_faults(self.driver), [])
                self.keys("t")
        self.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def test_undo_and_redo(self):
        self.open()
        self.mark_ball(4)
        self.keys("z")
        self.wait("return mark.study.structures[0].marks.length === 3 && mark.queue.items.length === 0")
        self.chord(Keys.CONTROL, "z")
        self.wait("return mark.study.structures[0].marks.length === 2 && mark.queue.items.length === 0")
        self.chord(Keys.CONTROL, Keys.SHIFT, "z")
        self.wait("return mark.study.structures[0].marks.length === 3 && mark.queue.items.length === 0")
        self.chord(Keys.SHIFT, "Z")
        self.wait("return mark.study.structures[0].marks.length === 4 && mark.queue.items.length === 0")
        self.assertFalse(self.driver.find_element(By.CSS_SELECTOR, "[data-do=redo]").is_enabled())
        self.driver.find_element(By.CSS_SELECTOR, "[data-do=undo]").click()
        self.wait("return mark.study.structures[0].marks.length === 3")

    def test_a_mark_is_dragged_and_deleted(self):
        self.open()
        self.slices(*BALL)
        self.click(2, [30, 40, 30])
        self.settled()
        self.drag(2, [30, 40, 30], [44, 55, 30])
        self.settled()
        self.assertEqual(len(self.marks()), 1)
        self.near(self.marks()[0]["index"], [44, 55, 30], 2)
        self.assertEqual(self.server.journal()[-1]["do"], "move_mark")
        self.click(2, [60, 20, 30])
        self.hover(2, [44, 55, 30])
        self.keys(Keys.DELETE)
        self.settled()
        self.near(self.marks()[0]["index"], [60, 20, 30], 2)
        self.assertEqual(len(self.marks()), 1)
        # A click selects the mark; the key then deletes it although the pointer is elsewhere.
        self.click(2, [60, 20, 30])
        self.assertEqual(len(self.marks()), 1)
        self.assertTrue(self.driver.find_element(By.CSS_SELECTOR, ".chosen").is_displayed())
        self.hover(2, [20, 20, 30])
        self.keys(Keys.BACKSPACE)
        self.settled()
        self.assertEqual(self.marks(), [])
        # If the pointer moves while the button is pressed, no mark is set.
        self.drag(2, [20, 20, 30], [26, 26, 30])
        self.assertEqual(self.marks(), [])

    def test_outlines(self):
        self.open()
        self.slices(*BALL)
        self.keys("c")
        for place in ([20, 30, 30], [50, 30, 30], [50, 60, 30]):
            self.click(2, place)
        self.keys(Keys.ENTER)
        self.settled()
        outline, = self.structures()[0]["outlines"]
        self.assertEqual((outline["axis"], outline["at"], outline["closed"], len(outline["world"])), (2, 30, True, 3))
        self.slices(30, 42, 20)
        self.drag(1, [20, 42, 20], [50, 42, 20], [50, 42, 40], [20, 42, 40], [20, 42, 20])
        self.settled()
        freehand = self.structures()[0]["outlines"][1]
        self.assertEqual((freehand["axis"], freehand["at"], freehand["closed"]), (1, 42, True))
        self.assertGreater(len(freehand["world"]), 3)
        self.click(2, [60, 20, 20])
        self.click(2, [70, 30, 20])
        self.keys(Keys.ESCAPE)
        self.assertIsNone(self.js("return mark.state.get('draft')"))
        self.click(2, [60, 20, 20])
        self.click(2, [70, 30, 20])
        self.chord(Keys.SHIFT, Keys.ENTER)
        self.settled()
        self.assertEqual([o["closed"] for o in self.structures()[0]["outlines"]], [True, True, False])
        self.keys("e")
        self.click(2, [65, 25, 20])
        self.settled()
        self.assertEqual(len(self.structures()[0]["outlines"]), 2)
        # A double click adds one corner, not two, and closes the outline.
        self.keys("c")
        self.slices(30, 42, 22)
        for place in ([20, 30, 22], [50, 30, 22]):
            self.click(2, place)
        self.move(self.actions(), self.spot(2, [50, 60, 22])).double_click().perform()
        self.settled()
        self.assertEqual(len(self.structures()[0]["outlines"][-1]["world"]), 3)

    def test_the_keyboard_alone(self):
        self.open()
        self.slices(*BALL)
        canvas = self.driver.find_element(By.CSS_SELECTOR, ".axis-2 canvas")
        self.js("arguments[0].focus()", canvas)
        self.keys(*[Keys.ARROW_RIGHT] * 3, Keys.ARROW_DOWN, "]", "a")
        self.settled()
        self.near(self.marks()[0]["index"], [37, 43, 31], 2)
        self.keys("N")
        self.settled()
        self.assertEqual(self.js("return mark.study.structure(mark.state.get('active')).name"), "structure 2")
        self.keys("1", "h")
        self.settled()
        self.assertEqual([s["visible"] for s in self.structures()], [False, True])
        self.keys("h", "l")
        self.settled()
        self.assertTrue(self.structures()[0]["locked"])
        self.keys("a")
        self.assertEqual(len(self.marks()), 1)
        self.assertIn("is locked", self.driver.find_element(By.CSS_SELECTOR, ".toast").text)
        for key, tool in zip("siocemp", ("surface", "inside", "outside", "outline", "erase", "ruler", "crosshair")):
            self.keys(key)
            self.assertEqual(self.js("return mark.state.get('tool')"), tool)
        theme = self.js("return document.documentElement.dataset.theme")
        self.keys("t")
        self.assertNotEqual(self.js("return document.documentElement.dataset.theme"), theme)
        self.keys("f")
        self.assertEqual(self.js("return mark.state.get('large')"), 2)
        self.keys("f", "?")
        self.assertTrue(self.driver.find_element(By.CSS_SELECTOR, "dialog.help").is_displayed())
        self.keys(Keys.ESCAPE, "w")
        self.assertEqual(self.js("return mark.state.get('window').white"), self.js("return mark.image.high"))
        # Every visible control has a name for screen readers: an aria-label or a text.
        nameless = self.js("return [...document.querySelectorAll('button, input, select, a, canvas')].filter((e) => e.checkVisibility() && !e.closest('[aria-hidden=true]') && !(e.getAttribute('aria-label') || e.textContent.trim())).map((e) => e.outerHTML)")
        self.assertEqual(nameless, [])

    def test_wheel_zoom_pan_and_window(self):
        self.open()
        self.slices(*BALL)
        spot = self.spot(2, [40, 40, 30])
        fetched = self.js("return performance.getEntriesByType('resource').length")
        before = self.js("return mark.panels[2].layer.canvas.toDataURL()")
        chain = self.move(self.actions(), spot)
        chain.w3c_actions.pointer_action.pointer_down(button=2)
        chain.w3c_actions.pointer_action.move_to_location(spot[0] + 120, spot[1] - 30)
        chain.w3c_actions.pointer_action.pointer_up(button=2)
        chain.perform()
        self.assertNotEqual(self.js("mark.panels[2].draw(); return mark.panels[2].layer.canvas.toDataURL()"), before)
        self.assertGreater(self.js("const w = mark.state.get('window'); return (w.white - w.black) / (mark.image.white - mark.image.black)"), 2)
        self.assertEqual(self.js("return performance.getEntriesByType('resource').length"), fetched)
        for n in range(5):
            chain = self.actions()
            chain.w3c_actions.wheel_action.scroll(*spot, 0, 100, 0, "viewport")
            chain.perform()
        self.assertEqual(self.slices()[2], 35)
        self.wait("return mark.panels[2].shownAt === 35")
        place = self.js("return mark.panels[2].plane.unplace(arguments[0] - mark.panels[2].canvas.getBoundingClientRect().left, arguments[1] - mark.panels[2].canvas.getBoundingClientRect().top)", *spot)
        chain = self.actions()
        chain.key_down(Keys.CONTROL)
        chain.w3c_actions.wheel_action.pause()
        chain.w3c_actions.wheel_action.scroll(*spot, 0, -100, 0, "viewport")
        chain.perform()
        self.actions().key_up(Keys.CONTROL).perform()
        self.assertGreater(self.js("return mark.state.get('views')[2].zoom"), 1.2)
        after = self.spot(2, [*place, 35])
        self.assertLess(math.hypot(after[0] - spot[0], after[1] - spot[1]), 1.5)
        chain = self.move(self.actions(), spot)
        chain.w3c_actions.pointer_action.pointer_down(button=1)
        chain.w3c_actions.pointer_action.move_to_location(spot[0] + 60, spot[1] + 40)
        chain.w3c_actions.pointer_action.pointer_up(button=1)
        chain.perform()
        moved = self.spot(2, [*place, 35])
        self.assertLess(math.hypot(moved[0] - spot[0] - 60, moved[1] - spot[1] - 40), 1.5)
        self.assertEqual(self.structures(), [])

    def test_the_ruler_measures_in_the_world(self):
        self.open(is_turned=True)
        self.slices(*BALL)
        self.keys("m")
        self.drag(1, [10, 42, 10], [50, 42, 40])
        length = self.js("const r = mark.state.get('ruler'), [a, b] = [mark.space.toWorld(r.from), mark.space.toWorld(r.to)]; return Math.hypot(...a.map((v, n) => v - b[n]))")
        self.assertAlmostEqual(length, math.hypot(40 * 0.8, 30 * 1.4), delta=0.5)
        self.assertEqual(self.structures(), [])

    def test_suggestions(self):
        self.open()
        self.mark_ball(8)
        self.surface()
        self.keys("n")
        self.wait("return Boolean(mark.state.get('ring'))")
        ring = self.js("return mark.space.toIndex(mark.state.get('ring').world)")
        self.assertEqual(self.slices(), [round(v) for v in ring])
        self.keys(Keys.ENTER)
        self.settled()
        for a in range(3):
            self.assertAlmostEqual(self.marks()[-1]["index"][a], ring[a], places=6)
        self.assertIsNone(self.js("return mark.state.get('ring')"))
        self.keys("n")
        second = self.js("return mark.space.toIndex(mark.state.get('ring').world)")
        self.assertNotEqual(second, ring)
        self.wait("return mark.panels.every((p) => p.shownAt === p.at)")
        beside = [second[0] + 6, second[1] + 6, self.slices()[2]]
        self.click(2, beside)
        self.settled()
        self.near(self.marks()[-1]["index"], beside, 2)
        self.assertIsNone(self.js("return mark.state.get('ring')"))

    def test_outline_of_the_surface_and_the_one_before(self):
        self.open()
        self.mark_ball(8)
        self.surface()
        self.slices(*BALL)
        count = "return mark.meshes.get(mark.study.structures[0].id)"
        camera = "mark.view.keepCamera(); mark.view.isTouched = true; return mark.view.camera.position.toArray()"
        before = self.js(camera)
        self.click(1, [BALL[0], BALL[1], BALL[2] + RADII[2]])
        self.wait("return Boolean(mark.meshes.get(mark.study.structures[0].id).before)")
        self.wait("return mark.meshes.get(mark.study.structures[0].id).before === null", seconds=5)
        self.assertEqual(self.js(camera), before)
        self.assertIsNotNone(self.js(count + "?.version"))
        # The segments in which a plane cuts the triangles are joined to closed lines: to a single one through the
        # middle of a ball.
        lines = self.js("const m = mark.meshes.get(mark.study.structures[0].id); mark.panels[2].draw(); return m.lines[2].lines.map((l) => [l.closed, l.places.length])")
        self.assertEqual(len(lines), 1)
        self.assertTrue(lines[0][0])

    def test_a_click_on_the_surface_brings_the_planes_there(self):
        self.open()
        self.mark_ball(8)
        self.click(1, [BALL[0], BALL[1], BALL[2] + RADII[2]])
        self.click(1, [BALL[0], BALL[1], BALL[2] - RADII[2]])
        self.settled()
        self.wait("const r = mark.study.structures[0].result; return r.stage === 'refined' && r.seq === mark.study.seq")
        self.surface()
        self.slices(0, 0, 0)
        canvas = self.driver.find_element(By.CSS_SELECTOR, ".three canvas")
        self.actions().move_to_element(canvas).click().perform()
        self.wait("return mark.state.get('slices').some((v) => v > 0)")
        index = self.slices()
        fraction = math.sqrt(sum(((index[a] - BALL[a]) / RADII[a]) ** 2 for a in range(3)))
        self.assertLess(abs(fraction - 1), 0.15)
        count = len(self.marks())
        self.actions().key_down(Keys.SHIFT).move_to_element(canvas).click().key_up(Keys.SHIFT).perform()
        self.settled()
        self.assertEqual(len(self.marks()), count + 1)
