"""Report pages: `--report` and `covol report`, and what the page shows in headless Chromium.

    COVOL=build/bin/covol python3 -m unittest tests/cli/report_page_test.py
"""
import base64
import json
import math
import os
import pathlib
import re
import unittest
import zlib

from covol_case import CENTER, H, ORIGIN, RADIUS, SIZE, ball_bytes, sphere_points, write_nrrd, write_xyz
from report_page_case import COARSE, EVIL, MB, BrowserCase, By, Keys, PageCase, WebDriverWait, data_of, marks_file


class Page(PageCase):
    def test_a_run_leaves_a_page(self):
        report = self.report("segment", self.image, "--points", self.few, *COARSE, "-o", "s.vdb", "--report", "s.html")
        self.assertEqual(self.files(), ["s.html", "s.vdb"])
        data = data_of(self.out / "s.html")
        self.assertEqual(data["title"], "ball.nrrd")
        self.assertEqual(data["image"]["size"], [SIZE] * 3)
        self.assertEqual(len(data["image"]["slices"]), SIZE)
        ball, = data["structures"]
        self.assertEqual(ball["marks"]["count"], 60)
        self.assertEqual(ball["mesh"]["of_triangles"], report["mesh"]["triangles"])
        for axis in range(3):
            self.assertAlmostEqual(ball["mesh"]["max"][axis], CENTER[axis] + RADIUS, delta=2 * H)
        self.assertEqual(sorted(ball["mesh"]["values"]), ["distance_to_marks", "edge_strength"])
        self.assertEqual(data["facts"]["surface"], report["surface"])
        self.assertEqual(data["facts"]["automatic"], report["automatic"])
        self.assertEqual(sorted(data["facts"]["given"]), ["image", "output", "points", "report", "voxel-size"])
        self.assertTrue(data["facts"]["command_line"].startswith("covol segment "))
        self.assertEqual(report["page"]["bytes"], (self.out / "s.html").stat().st_size)
        # Compressed marks: x, y, z of each as 4-byte floats, thus 12 bytes for each of 60 marks.
        first = zlib.decompress(base64.b64decode(ball["marks"]["data"]))
        self.assertEqual(len(first), 60 * 12)
        self.assertIn("suggestions", report["evidence"])

    def test_the_same_run_gives_the_same_mesh(self):
        self.segment(*COARSE, "--report", "a.html")
        self.run_covol("report", "s.vdb", "--image", self.image, "--points", self.points, "-o", "b.html")
        a, b = (data_of(self.out / name) for name in ("a.html", "b.html"))
        self.assertEqual(a["structures"][0]["mesh"]["corners"], b["structures"][0]["mesh"]["corners"])
        self.assertEqual(a["image"]["slices"], b["image"]["slices"])
        self.assertEqual(b["facts"]["resolved"], a["facts"]["resolved"])  # the .vdb contains the options of the run

    def test_facts_of_the_run(self):
        self.segment(*COARSE, "--json", "s.json")
        self.run_covol("report", "s.vdb", "--run-report", "s.json", "-o", "p.html")
        reported = json.loads((self.out / "s.json").read_text())
        facts = data_of(self.out / "p.html")["facts"]
        self.assertEqual(facts["seconds"], reported["seconds"])
        self.assertEqual(facts["automatic"], reported["automatic"])
        (self.out / "odd.json").write_text(json.dumps({"covol": 1, "input": 3, "seconds": [], "structures": [4], "warnings": "x"}))
        self.run_covol("report", "s.vdb", "--run-report", "odd.json", "--points", self.few, "-o", "o.html")
        (self.out / "bad.json").write_text("[1, 2]")
        done = self.run_covol("report", "s.vdb", "--run-report", "bad.json", "-o", "q.html", code=3)
        self.assertIn("--run-report: bad.json: expected a report that covol wrote", done.stderr)
        self.assertNotIn("q.html", self.files())

    def test_several_structures(self):
        self.run_covol("segment", self.image, "--points", f"a b={self.few}", f"other={marks_file(self.inputs / 'o.xyz', shift=0.5)}",
                       *COARSE, "-o", "s.vdb", "--report", "s.html")
        data = data_of(self.out / "s.html")
        self.assertEqual([s["name"] for s in data["structures"]], ["a b", "other"])
        self.assertNotEqual(data["structures"][0]["color"], data["structures"][1]["color"])
        self.run_covol("report", "s.vdb", "--points", f"other={self.few}", "-o", "t.html")
        data = data_of(self.out / "t.html")
        self.assertEqual([s["marks"]["count"] for s in data["structures"]], [0, 60])
        done = self.run_covol("report", "s.vdb", "--points", self.few, "-o", "u.html", code=2)
        self.assertIn("expected NAME=FILE with a level set of the file (a_b, other)", done.stderr)

    def test_points_alone(self):
        self.run_covol("reconstruct", self.points, "-o", "s.vdb", "--report", "s.html")
        data = data_of(self.out / "s.html")
        self.assertNotIn("image", data)
        self.assertEqual(list(data["structures"][0]["mesh"]["values"]), ["distance_to_marks"])

    def test_frames_have_a_page_each(self):
        self.run_covol("segment", self.image, self.image, "--points", self.few, *COARSE, "-o", "s.vdb", "--report", "s.html")
        self.assertEqual([name for name in self.files() if name.endswith(".html")], ["s_t000.html", "s_t001.html"])
        second = data_of(self.out / "s_t001.html")
        self.assertEqual(second["title"], "ball.nrrd_t001")
        self.assertEqual(second["frames"], {"at": 1, "pages": ["s_t000.html", "s_t001.html"]})

    def test_letters_are_for_patients(self):
        import nibabel
        import numpy
        values = numpy.frombuffer(self.image.read_bytes()[-SIZE ** 3:], numpy.uint8).reshape((SIZE,) * 3).T
        affine = numpy.diag([-H, -H, H, 1.0])  # world of NIfTI is RAS: x and y have the opposite sign
        affine[:3, 3] = [-ORIGIN[0], -ORIGIN[1], ORIGIN[2]]
        nibabel.save(nibabel.Nifti1Image(values, affine), self.out / "ball.nii.gz")
        self.run_covol("segment", "ball.nii.gz", "--points", self.few, *COARSE, "-o", "s.vdb", "--report", "s.html")
        self.assertTrue(data_of(self.out / "s.html")["anatomical"])
        self.segment(*COARSE, "--report", "t.html")
        self.assertFalse(data_of(self.out / "t.html")["anatomical"])

    def test_wrong_names(self):
        self.refuse("segment", self.image, "--points", self.few, *COARSE, "-o", "s.vdb", "--report", "s.pdf", code=3, expected_text="--report: s.pdf: expected a name that ends in .html")
        self.refuse("report", "none.vdb", "-o", "s.html", code=4, expected_text="none.vdb")
        self.refuse("report", self.image, "-o", "s.html", code=3, expected_text="ball.nrrd")

    def test_the_page_names_no_host(self):
        self.segment(*COARSE, "--report", "s.html")
        page = (self.out / "s.html").read_text()
        self.assertIn("default-src 'none'", page)
        self.assertIsNone(re.search(r'(src|href)="(?!data:)', page))
        self.assertLess(len(page), 1.5 * MB)


class Browser(BrowserCase):
    def test_the_first_view_shows_the_whole_body(self):
        """The slice planes hide no half of the bodies: what is drawn lies within the view, and every structure is visible."""
        self.open(self.two())
        self.assertEqual(self.js("return report.state.get('planes')"), [False, False, False])
        edges = self.js("""
            const {camera} = report.view, out = [], {positions} = report.data.structures[0];
            for (let n = 0; n < positions.length; n += 3) {
                const p = camera.position.clone().set(positions[n], positions[n + 1], positions[n + 2]).project(camera);
                out.push(Math.max(Math.abs(p.x), Math.abs(p.y)));
            }
            return Math.max(...out);""")
        self.assertLess(edges, 1.0)
        self.assertGreater(edges, 0.5)  # the surface fills more than half of the view

    def test_surface_planes_and_switches(self):
        self.open(self.two())
        drawn, all_on = self.picture()
        self.assertGreater(drawn, 0.1)
        boxes = self.driver.find_elements(By.CSS_SELECTOR, ".structures input")
        names = [name.text for name in self.driver.find_elements(By.CSS_SELECTOR, ".structures .name")]
        self.assertEqual(names, ["first", f"second{EVIL}"])
        boxes[0].click()
        one_off = self.picture()[1]
        self.assertNotEqual(one_off, all_on)
        boxes[0].click()
        self.assertEqual(self.picture()[1], all_on)
        for selector in ("[data-key=marks]", '[data-plane="2"]', '[data-plane="0"]'):
            before = self.picture()[1]
            self.driver.find_element(By.CSS_SELECTOR, selector).click()
            self.assertNotEqual(self.picture()[1], before, selector)
        for label, value in (("cut the surfaces at a slice", "2"), ("colour by", "distance_to_marks")):
            before = self.picture()[1]
            self.js("const s = document.querySelector(`select[aria-label='${arguments[0]}']`); s.value = arguments[1]; s.dispatchEvent(new Event('change'))", label, value)
            self.assertNotEqual(self.picture()[1], before, label)
        self.assertEqual(len(self.driver.find_elements(By.CSS_SELECTOR, ".legend .ramp")), 1)
        self.assertRegex(self.driver.find_element(By.CSS_SELECTOR, ".three .scale").text, r"^\d")

    def test_the_table_is_sorted_and_saved(self):
        self.open(self.two())
        rows = lambda: [row.text for row in self.driver.find_elements(By.CSS_SELECTOR, ".structures-table tbody .name")]
        self.assertEqual(rows(), ["first", f"second{EVIL}"])
        unit = data_of(self.two())["unit"] or "units"
        volumes = [s["surface"]["volume"] for s in data_of(self.two())["facts"]["structures"]]
        head = self.driver.find_elements(By.CSS_SELECTOR, ".structures-table thead button")[1]
        self.js("arguments[0].scrollIntoView({block: 'center'})", head)
        head.click()
        self.assertEqual(rows()[0] == "first", volumes[0] > volumes[1])
        head.click()
        self.assertEqual(rows()[0] == "first", volumes[0] < volumes[1])
        self.assertEqual(head.find_element(By.XPATH, "..").get_attribute("aria-sort"), "ascending")
        self.downloads()
        table = self.rows("structures.csv")
        self.assertEqual([row["structure"] for row in table], ["first", f"second{EVIL}"])
        self.assertEqual([float(row[f"volume_{unit}3"]) for row in table], volumes)
        for row, own in zip(table, data_of(self.two())["structures"]):
            self.assertAlmostEqual(float(row[f"extent_x_{unit}"]), own["mesh"]["max"][0] - own["mesh"]["min"][0], places=9)

    def test_outline_is_where_the_surface_is(self):
        """Through the middle of a ball the outline is a circle: its points are at the mesh's distance from the middle."""
        self.open(self.two())
        radii = self.js("""
            const middle = (report.space.size[0] - 1) / 2, panel = report.panels[2], drawn = [], context = panel.canvas.getContext('2d');
            report.state.set({slices: [20, 20, Math.round(middle)]});
            panel.draw();
            // What is drawn: the places that the outline's path goes through.
            const lineTo = context.lineTo.bind(context), moveTo = context.moveTo.bind(context);
            let own = [];
            context.beginPath = () => { own = []; CanvasRenderingContext2D.prototype.beginPath.call(context); };
            context.moveTo = (x, y) => { own.push([x, y]); moveTo(x, y); };
            context.lineTo = (x, y) => { own.push([x, y]); lineTo(x, y); };
            context.stroke = () => { if (own.length > 40) drawn.push(own); CanvasRenderingContext2D.prototype.stroke.call(context); };
            panel.draw();
            for (const name of ['beginPath', 'moveTo', 'lineTo', 'stroke']) delete context[name];
            return drawn.map((line) => line.map(([x, y]) => panel.plane.unplace(x, y)).map(([x, y]) => Math.hypot(x - middle, y - middle)));""")
        self.assertGreaterEqual(len(radii), 2)  # outlines of both structures
        for line in radii:
            self.assertGreater(min(line), RADIUS / H - 2.5)
            self.assertLess(max(line), RADIUS / H + 2)

    def test_a_suggestion_is_jumped_to(self):
        half = self.inputs / "half.xyz"  # marks only in the lower half, and one at the upper pole
        write_xyz(half, [p for p in sphere_points(120) if p[2] < CENTER[2] + 1] + [(CENTER[0], CENTER[1], CENTER[2] + RADIUS)])
        half_image = self.inputs / "half.nrrd"  # an image that is dark in the upper half
        write_nrrd(half_image, (SIZE,) * 3, ball_bytes()[:SIZE ** 3 // 2] + bytes([20]) * (SIZE ** 3 // 2))
        self.open(self.page_of("half", "segment", half_image, "--points", half, "-o", "s.vdb", "--suggest", 2))
        buttons = self.driver.find_elements(By.CSS_SELECTOR, ".suggestion")
        self.assertEqual(len(buttons), 2)
        wanted = int(buttons[0].get_attribute("data-slice"))
        self.js("report.state.set({slices: [0, 0, 0]})")
        before = self.picture()[1]
        self.js("arguments[0].scrollIntoView({block: 'center'})", buttons[0])
        buttons[0].click()
        self.assertEqual(self.slices()[2], wanted)
        self.assertNotEqual(self.picture()[1], before)
        self.assertEqual(buttons[0].get_attribute("aria-current"), "true")
        count = len(self.marks())
        self.keys(Keys.ENTER)  # presses the focused button again, which sets no mark
        self.js("document.activeElement.blur()")
        self.keys(Keys.ENTER)  # without focus: sets a mark at the crosshair's ring
        self.assertEqual(len(self.marks()), count + 1)

    def test_dark_light_and_a_phone(self):
        self.open(self.two())
        back = "return getComputedStyle(document.documentElement).backgroundColor"
        first = self.js(back)
        self.keys("t")
        self.assertNotEqual(self.js(back), first)
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True})
        self.addCleanup(self.driver.execute_cdp_cmd, "Emulation.clearDeviceMetricsOverride", {})
        WebDriverWait(self.driver, 10).until(lambda d: self.js("return innerWidth") <= 400)
        self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), 390)

    def test_without_webgl_there_is_a_word_and_there_are_slices(self):
        hide = "HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext, {apply(f, self, args) { return String(args[0]).startsWith('webgl') ? null : Reflect.apply(f, self, args); }});"
        script = self.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": hide})["identifier"]
        self.addCleanup(self.driver.execute_cdp_cmd, "Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
        self.driver.get(self.two().as_uri())
        WebDriverWait(self.driver, 60).until(lambda d: d.execute_script("return Boolean(window.covolReport?.done)"))
        self.assertIn("no WebGL", self.driver.find_element(By.CSS_SELECTOR, ".three .notice").text)
        self.assertGreater(len(self.slice_picture(2)), 2000)
        self.driver.get_log("browser")  # discards what three.js logs: it has no WebGL context

    def test_points_alone_have_no_slices(self):
        self.open(self.page_of("cloud", "reconstruct", self.points, "-o", "s.vdb"))
        self.assertGreater(self.picture()[0], 0.1)
        self.assertEqual(self.driver.find_elements(By.CSS_SELECTOR, ".slice, [data-plane]"), [])
        whole = self.picture()[1]
        self.js("report.state.set({cut: 2})")
        half = self.picture()[1]
        slider = self.driver.find_element(By.CSS_SELECTOR, '[aria-label="place of the cut"]')
        self.js("arguments[0].value = 150; arguments[0].dispatchEvent(new Event('input'))", slider)
        self.assertEqual(len({whole, half, self.picture()[1]}), 3)
        box = self.driver.find_element(By.CSS_SELECTOR, ".three canvas").rect
        self.mouse(("move", round(box["x"] + box["width"] / 2), round(box["y"] + box["height"] / 2)), ("down", 0), ("up", 0), keys=[Keys.SHIFT])
        (kind, *index), = self.new_marks()
        self.assertEqual(kind, "surface")
        world = self.js("return report.space.toWorld(arguments[0])", index)
        self.assertAlmostEqual(math.dist(world, CENTER), RADIUS, delta=H)

    @unittest.skipUnless(os.environ.get("COVOL_DATA"), "SKIPPED: COVOL_DATA is not set")
    def test_a_stack_of_15_million_voxels_stays_small_and_opens_soon(self):
        data = pathlib.Path(os.environ["COVOL_DATA"]) / "phantoms"
        page = self.page_of("embryo", "segment", data / "embryo.tif", "--init", "sphere:89.6,89.6,28.5,25", "--max-steps", 0, "-o", "s.vdb")
        self.assertLess(page.stat().st_size, 15 * MB)
        self.open(page)
        print(f"page of {page.stat().st_size / MB:.1f} MB: first view after {self.js('return report.ready'):.0f} ms, all slices after {self.js('return report.decoded'):.0f} ms")
        self.assertLess(self.js("return report.ready"), 20000)  # ms; a wide limit, because the machine may be busy


if __name__ == "__main__":
    unittest.main()
