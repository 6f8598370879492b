"""Painting, files, options, colours and the table on the page of `covol mark`, in headless Chromium.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_content_page_test.py
"""
import http.server
import math
import os
import threading
import time

from mark_page_case import BALL, RADII, SPACING, By, Keys, PageCase


class Content(PageCase):
    def strokes(self, structure=0):
        return self.js("return mark.study.structures[arguments[0]].strokes", structure)

    def colour_at(self, axis, index):
        """A pixel of the canvas: red, green and blue."""
        x, y = self.spot(axis, index)
        return self.js("const p = mark.panels[arguments[0]], c = p.layer.canvas, b = c.getBoundingClientRect(), r = c.width / b.width; p.draw();"
                       "return [...c.getContext('2d').getImageData((arguments[1] - b.left) * r, (arguments[2] - b.top) * r, 1, 1).data].slice(0, 3)", axis, x, y)

    def painted(self, axis, at):
        """Number of voxels that the page shows as painted on the current slice."""
        return self.js("const s = mark.study.structures[0], c = mark.panels[arguments[0]].painting.get(s, arguments[0], arguments[1]);"
                       "if (!c) return 0; const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
                       "for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n", axis, at)

    def test_the_brush_paints_and_rubs_out(self):
        self.open()
        self.slices(*BALL)
        self.keys("b")
        self.drag(2, [25, 42, 30], [45, 42, 30])
        self.settled()
        stroke, = self.strokes()
        self.assertEqual((stroke["erases"], stroke["axis"], stroke["at"]), (False, 2, 30))
        radius = stroke["radius"] / SPACING[0]
        self.assertAlmostEqual(radius, 5, places=6)
        self.assertAlmostEqual(self.painted(2, 30), math.pi * 25 + 10 * 20, delta=25)
        self.assertEqual(self.painted(2, 31), 0)
        self.assertGreater(self.painted(1, 42), 20)  # the stroke crosses this slice in a line
        self.assertEqual([action["do"] for action in self.server.journal()], ["add_structure", "add_stroke"])
        # The key g selects the eraser, which clears the middle of the stroke.
        self.keys("g")
        self.drag(2, [35, 42, 30], [36, 42, 30])
        self.settled()
        rubbed = self.painted(2, 30)
        self.assertLess(rubbed, math.pi * 25 + 10 * 20 - 60)
        self.keys("z")
        self.wait("return mark.study.structures[0].strokes.length === 1 && mark.queue.items.length === 0")
        self.assertGreater(self.painted(2, 30), rubbed)
        # The key d changes the brush to a ball, and each "." enlarges it by a factor of 1.25.
        self.keys("b", "d", ".", ".")
        self.click(2, [34, 42, 30])
        self.settled()
        ball = self.strokes()[-1]
        self.assertNotIn("axis", ball)
        self.assertAlmostEqual(ball["radius"] / SPACING[0], 5 * 1.25 ** 2, places=6)
        self.assertGreater(self.painted(2, 32), 20)
        self.assertEqual(self.js("return mark.study.structures[0].marks.length"), 0)
        self.driver.find_element(By.CSS_SELECTOR, '[aria-label="remove all paint"]').click()
        self.settled()
        self.assertEqual(self.strokes(), [])
        # Strokes that cover the whole cross-sections of the body on five slices determine a surface.
        self.js("mark.state.set({brush: {radius: 1, isBall: false}})")
        for k in (22, 26, 30, 34, 38):
            self.js("const [k, r] = arguments; mark.study.act({do: 'add_stroke', structure: mark.study.structures[0].id, erases: false, radius: r, axis: 2, at: k, world: [mark.space.toWorld([34, 42, k])]})",
                    k, RADII[0] * SPACING[0] * math.sqrt(1 - ((k - BALL[2]) / RADII[2]) ** 2))
        self.surface()

    def test_files_are_chosen_and_become_part_of_the_study(self):
        self.open()
        marks = self.server.folder / "clicked.csv"
        places = self.js("return [[54, 42, 30], [14, 42, 30], [34, 66, 30], [34, 18, 30], [34, 42, 43], [34, 42, 17]].map((i) => mark.space.toWorld(i))")
        marks.write_text("x,y,z\n" + "".join(",".join(map(repr, place)) + "\n" for place in places))
        field = self.driver.find_element(By.CSS_SELECTOR, "input[type=file]")
        self.js("mark.files.as = 'points'")
        field.send_keys(str(marks))
        self.wait("return mark.study.structures[0]?.marks.length === 6")
        self.surface()
        self.assertEqual([action["do"] for action in self.server.journal()], ["add_structure", "add_marks"])
        self.assertIn("±", self.driver.find_element(By.CSS_SELECTOR, ".structure .figures").text)
        self.keys("z")
        self.wait("return mark.study.structures[0].marks.length === 0")
        # A file that cannot be read causes a message and no change.
        self.may_fail = True  # the browser logs the response 400 as an error
        broken = self.server.folder / "broken.nii"
        broken.write_bytes(b"no image")
        self.js("mark.files.as = 'guess'")
        field.send_keys(str(broken))
        self.wait("return Boolean(document.querySelector('.toast.failed'))")
        self.assertIsNone(self.js("return mark.study.structures[0].guess"))

    def test_table_options_and_colours(self):
        self.open()
        self.mark_ball(9)
        self.surface()
        self.keys("N")
        self.settled()
        self.driver.find_element(By.CSS_SELECTOR, "[data-do=table]").click()
        self.wait("return document.querySelectorAll('dialog.results tbody tr').length === 2")
        # Text is read by a script, because each result recreates the rows, and references to the old elements become
        # invalid.
        rows = self.js("return [...document.querySelectorAll('dialog.results tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent).join(' '))")
        self.assertRegex(rows[0], r"structure 1.* 9 ")
        self.assertIn("–", rows[1])
        name, marks, volume = self.driver.find_elements(By.CSS_SELECTOR, "dialog.results thead button")[:3]
        self.assertIn("µm³", volume.text)
        for header, first in ((marks, "structure 1"), (marks, "structure 2"), (name, "structure 1"), (name, "structure 2"), (volume, "structure 1"), (volume, "structure 1")):
            header.click()
            self.assertIn(first, self.js("return document.querySelector('dialog.results tbody tr').textContent"))
        self.assertEqual(self.driver.find_element(By.CSS_SELECTOR, "dialog.results thead th:nth-child(3)").get_attribute("aria-sort"), "ascending")
        if os.environ.get("COVOL_PICTURES"):
            self.driver.save_screenshot(os.environ["COVOL_PICTURES"] + "/table.png")
        self.keys(Keys.ESCAPE)
        # The first answer has coarser voxels, and a busy machine may still show it, or the result of fewer marks. With
        # all marks and voxels of the image's size, the mesh has some 18,000 triangles.
        before = self.wait("const r = mark.study.structures[0].result; return r.stage === 'refined' && r.triangles > 12000 && r.triangles")
        self.driver.find_element(By.CSS_SELECTOR, "[data-do=options]").click()
        field = self.driver.find_element(By.CSS_SELECTOR, "dialog.options [name=voxel_size]")
        field.send_keys("1.6")
        if os.environ.get("COVOL_PICTURES"):
            self.driver.save_screenshot(os.environ["COVOL_PICTURES"] + "/options.png")
        self.driver.find_element(By.CSS_SELECTOR, "dialog.options .primary").click()
        self.settled()
        self.assertEqual(self.js("return mark.study.options"), {"voxel_size": 1.6})
        self.wait("const r = mark.study.structures[0].result; return r.stage === 'refined' && r.triangles < 0.6 * arguments[0]", before)
        self.keys("z")
        self.wait("return Object.keys(mark.study.options).length === 0")
        for colors in ("viridis", "magma", "inverted"):
            self.js("mark.state.set({colors: arguments[0]})", colors)
            red, green, blue = self.colour_at(2, [90, 5, 30])
            if colors == "inverted":
                self.assertEqual((red, red), (green, blue))
                self.assertGreater(red, 128)
            else:
                self.assertGreater(blue, green)
        # The choice of colours is kept after a reload of the page.
        self.wait("return localStorage.getItem('covol-mark/view/ball.nrrd/colors') === '\"inverted\"'")
        self.driver.refresh()
        self.ready()
        self.assertEqual(self.js("return mark.state.get('colors')"), "inverted")

    def test_a_notebook_shows_it_in_a_frame_and_others_do_not(self):
        """Pages of two servers: only the one whose origin was named may embed the page, on the same host name."""
        notebook, other = (self.serve_page() for _ in range(2))
        self.open(options=("--in-frame-of", f"http://localhost:{notebook}"))
        address = self.server.url.replace("127.0.0.1", "localhost")
        show = "const f = document.createElement('iframe'); f.width = 900; f.height = 600; f.src = arguments[0]; document.body.append(f)"
        self.driver.get(f"http://localhost:{notebook}/")
        self.driver.execute_script(show, address)
        self.driver.switch_to.frame(0)
        self.ready()
        self.assertEqual(self.js("return location.search"), "")
        self.slices(*BALL)
        self.js("mark.tools.addMark('surface', mark.space.toWorld([54, 42, 30]))")
        self.settled()
        self.assertEqual(len(self.server.journal()), 2)
        self.driver.switch_to.default_content()
        self.may_fail = True  # the browser logs as an error that the frame was refused
        for port, host in ((other, "localhost"), (notebook, "127.0.0.1")):
            self.driver.get(f"http://{host}:{port}/")
            self.driver.execute_script(show, address)
            self.driver.switch_to.frame(0)
            time.sleep(1)
            self.assertFalse(self.driver.execute_script("return Boolean(window.covolMark)"))
            self.driver.switch_to.default_content()

    def serve_page(self):
        class Plain(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.end_headers()
                self.wfile.write(b"<!doctype html><title>notebook</title><link rel=icon href=data:,><body>")

            def log_message(self, *_):
                pass
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Plain)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        return server.server_address[1]

    def test_each_new_control_has_a_name(self):
        self.open()
        nameless = self.js("return [...document.querySelectorAll('button, input, select, a, canvas')].filter((e) => e.checkVisibility() && !e.closest('[aria-hidden=true]') && !(e.getAttribute('aria-label') || e.textContent.trim())).map((e) => e.outerHTML)")
        self.assertEqual(nameless, [])
        self.driver.find_element(By.CSS_SELECTOR, '[aria-label="add files"]').click()
        self.assertEqual(len(self.driver.find_elements(By.CSS_SELECTOR, "[data-import]")), 3)
