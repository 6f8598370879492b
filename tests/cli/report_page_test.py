"""Report pages: `--report` and `covol report`, and the page itself in headless Chromium.

    COVOL=build/bin/covol python3 -m unittest tests/cli/report_page_test.py
"""
import base64
import json
import os
import pathlib
import re
import shutil
import tempfile
import unittest
import zlib

from cli_test import CENTER, H, ORIGIN, RADIUS, SIZE, Case, ball_bytes, sphere_points, write_nrrd, write_xyz

try:
    from selenium import webdriver
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    webdriver = None

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
EVIL = "<!--<script>alert(1)\"&amp;'"  # a name of a structure holds no slash
MB = 1e6
COARSE = ("--voxel-size", 2 * H)


def data_of(page):
    """What the page tells, as a browser finds it."""
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script', page.read_text(), re.S)[1])


def marks_file(path, count=60, shift=0.0):
    write_xyz(path, [(x + shift, y, z) for x, y, z in sphere_points(count)])
    return path


class PageCase(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.few = marks_file(cls.inputs / "few.xyz")


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
        # Marks are floats behind each other.
        first = zlib.decompress(base64.b64decode(ball["marks"]["data"]))
        self.assertEqual(len(first), 60 * 12)
        self.assertIn("suggestions", report["evidence"])

    def test_the_same_run_gives_the_same_mesh(self):
        self.segment(*COARSE, "--report", "a.html")
        self.run_covol("report", "s.vdb", "--image", self.image, "--points", self.points, "-o", "b.html")
        a, b = (data_of(self.out / name) for name in ("a.html", "b.html"))
        self.assertEqual(a["structures"][0]["mesh"]["corners"], b["structures"][0]["mesh"]["corners"])
        self.assertEqual(a["image"]["slices"], b["image"]["slices"])
        self.assertEqual(b["facts"]["resolved"], a["facts"]["resolved"])  # the .vdb keeps it

    def test_facts_of_the_run(self):
        self.segment(*COARSE, "--json", "s.json")
        self.run_covol("report", "s.vdb", "--run-report", "s.json", "-o", "p.html")
        told = json.loads((self.out / "s.json").read_text())
        facts = data_of(self.out / "p.html")["facts"]
        self.assertEqual(facts["seconds"], told["seconds"])
        self.assertEqual(facts["automatic"], told["automatic"])
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
        self.assertEqual(data_of(self.out / "s_t001.html")["title"], "ball.nrrd_t001")

    def test_letters_are_for_patients(self):
        import nibabel
        import numpy
        values = numpy.frombuffer(self.image.read_bytes()[-SIZE ** 3:], numpy.uint8).reshape((SIZE,) * 3).T
        affine = numpy.diag([-H, -H, H, 1.0])  # NIfTI's world is RAS
        affine[:3, 3] = [-ORIGIN[0], -ORIGIN[1], ORIGIN[2]]
        nibabel.save(nibabel.Nifti1Image(values, affine), self.out / "ball.nii.gz")
        self.run_covol("segment", "ball.nii.gz", "--points", self.few, *COARSE, "-o", "s.vdb", "--report", "s.html")
        self.assertTrue(data_of(self.out / "s.html")["anatomical"])
        self.segment(*COARSE, "--report", "t.html")
        self.assertFalse(data_of(self.out / "t.html")["anatomical"])

    def test_wrong_names(self):
        self.refuse("segment", self.image, "--points", self.few, *COARSE, "-o", "s.vdb", "--report", "s.pdf", code=3, says="--report: s.pdf: expected a name that ends in .html")
        self.refuse("report", "none.vdb", "-o", "s.html", code=4, says="none.vdb")
        self.refuse("report", self.image, "-o", "s.html", code=3, says="ball.nrrd")

    def test_the_page_names_no_host(self):
        self.segment(*COARSE, "--report", "s.html")
        page = (self.out / "s.html").read_text()
        self.assertIn("default-src 'none'", page)
        self.assertIsNone(re.search(r'(src|href)="(?!data:)', page))
        self.assertLess(len(page), 1.5 * MB)


@unittest.skipUnless(webdriver and CHROMIUM and DRIVER, "SKIPPED: chromium, chromium-driver or python3-selenium is not installed")
class Browser(PageCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.profile = tempfile.mkdtemp(prefix="covol-chromium-")
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for argument in ["--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--no-first-run",
                         "--disable-quic", "--disable-background-networking", "--disable-component-update", "--disable-sync",
                         f"--user-data-dir={cls.profile}", "--window-size=1200,800"]:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        from selenium.webdriver.chrome.service import Service
        cls.driver = webdriver.Chrome(options=options, service=Service(DRIVER))
        cls.pages = pathlib.Path(tempfile.mkdtemp(prefix="covol-pages-"))

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        shutil.rmtree(cls.profile, ignore_errors=True)
        shutil.rmtree(cls.pages)
        super().tearDownClass()

    def page_of(self, name, *arguments):
        page = self.pages / f"{name}.html"
        if not page.exists():
            self.run_covol(*arguments, "--report", page)
        return page

    def two(self):
        return self.page_of("two", "segment", self.image, "--points", f"first={self.few}",
                            f"second{EVIL}={marks_file(self.inputs / 'o.xyz', shift=0.5)}", *COARSE, "-o", "s.vdb", "--suggest", 2)

    def open(self, page):
        self.driver.get_log("browser")
        self.driver.get_log("performance")
        self.driver.get(page.as_uri())
        WebDriverWait(self.driver, 60).until(lambda d: d.execute_script("return Boolean(window.covolReport?.done)"))
        self.addCleanup(self.quiet)

    def quiet(self):
        """Nothing went wrong, and nobody was asked for anything."""
        self.assertEqual([entry for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"], [])
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                self.assertRegex(message["params"]["request"]["url"], "^(file|data|blob):")

    def js(self, script, *arguments):
        return self.driver.execute_script("const report = window.covolReport;" + script, *arguments)

    def picture(self):
        """The 3D view's pixels: how many are drawn, and their sum."""
        return self.js("""
            report.view.renderNow();
            const gl = report.view.renderer.getContext(), width = gl.drawingBufferWidth, height = gl.drawingBufferHeight;
            const pixels = new Uint8Array(4 * width * height);
            gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
            let drawn = 0, sum = 0;
            for (let n = 0; n < pixels.length; n += 4) { drawn += pixels[n + 3] > 0; sum += pixels[n] + 2 * pixels[n + 1] + 3 * pixels[n + 2]; }
            return [drawn / (width * height), sum];""")

    def slice_picture(self, axis):
        return self.js("report.panels[arguments[0]].draw(); return report.panels[arguments[0]].canvas.toDataURL()", axis)

    def test_surface_planes_and_switches(self):
        self.open(self.two())
        drawn, all_on = self.picture()
        self.assertGreater(drawn, 0.1)
        boxes = self.driver.find_elements(By.CSS_SELECTOR, ".structures input")
        self.assertEqual(len(boxes), 2)
        labels = [label.text for label in self.driver.find_elements(By.CSS_SELECTOR, ".structures label")]
        self.assertEqual(labels, ["first", f"second{EVIL}"])
        boxes[0].click()
        one_off = self.picture()[1]
        self.assertNotEqual(one_off, all_on)
        boxes[0].click()
        self.assertEqual(self.picture()[1], all_on)
        for selector in ("[data-key=marks]", '[data-plane="2"]', '[data-plane="0"]', '[aria-label^="cut"] [data-value="2"]'):
            before = self.picture()[1]
            self.driver.find_element(By.CSS_SELECTOR, selector).click()
            self.assertNotEqual(self.picture()[1], before, selector)
        before = self.picture()[1]
        self.js("const s = document.querySelector('.toolbar select'); s.value = 'distance_to_marks'; s.dispatchEvent(new Event('change'))")
        self.assertNotEqual(self.picture()[1], before)
        self.assertEqual(len(self.driver.find_elements(By.CSS_SELECTOR, ".legend .ramp")), 1)

    def test_slider_keys_and_click_change_the_slice(self):
        self.open(self.two())
        slider = self.driver.find_element(By.CSS_SELECTOR, 'input[data-axis="2"]')
        before, middle = self.slice_picture(2), self.js("return report.state.get('slices')[2]")
        self.js("arguments[0].value = 12; arguments[0].dispatchEvent(new Event('input'))", slider)
        self.assertEqual(self.js("return report.state.get('slices')[2]"), 12)
        self.assertNotEqual(12, middle)
        self.assertNotEqual(self.slice_picture(2), before)
        self.assertIn("12 of 0–39", self.driver.find_element(By.CSS_SELECTOR, ".axis-2 .where").text)
        canvas = self.driver.find_element(By.CSS_SELECTOR, ".axis-2 canvas")
        canvas.click()
        canvas.send_keys("\ue013")  # arrow up
        self.assertEqual(self.js("return report.state.get('slices')[2]"), 13)
        side = self.slice_picture(0)
        self.js("report.state.set({slices: [5, 20, 13]})")
        self.assertNotEqual(self.slice_picture(0), side)

    def test_outline_is_where_the_surface_is(self):
        """Through the middle of a ball it is a circle: its points are as far from the middle as the mesh says."""
        self.open(self.two())
        radii = self.js("""
            const middle = (report.volume.size[0] - 1) / 2;
            report.state.set({slices: [20, 20, Math.round(middle)]});
            const s = report.panels[2].outline(report.data.structures[1]), radii = [];
            for (let n = 0; n < s.length; n += 2) radii.push(Math.hypot(s[n] - middle - arguments[0], s[n + 1] - middle));
            return [Math.min(...radii), Math.max(...radii), s.length / 4];""", 0.5 / H)
        self.assertGreater(radii[2], 50)
        self.assertGreater(radii[0], RADIUS / H - 2.5)
        self.assertLess(radii[1], RADIUS / H + 1.5)

    def test_a_suggestion_is_jumped_to(self):
        half = self.inputs / "half.xyz"  # no marks above
        write_xyz(half, [p for p in sphere_points(120) if p[2] < CENTER[2] + 1] + [(CENTER[0], CENTER[1], CENTER[2] + RADIUS)])
        half_image = self.inputs / "half.nrrd"  # nothing to see there either
        write_nrrd(half_image, (SIZE,) * 3, ball_bytes()[:SIZE ** 3 // 2] + bytes([20]) * (SIZE ** 3 // 2))
        self.open(self.page_of("half", "segment", half_image, "--points", half, "-o", "s.vdb", "--suggest", 2))
        buttons = self.driver.find_elements(By.CSS_SELECTOR, ".suggestion")
        self.assertEqual(len(buttons), 2)
        wanted = int(buttons[0].get_attribute("data-slice"))
        self.js("report.state.set({slices: [0, 0, 0]})")
        before = self.picture()[1]
        buttons[0].click()
        self.assertEqual(self.js("return report.state.get('slices')[2]"), wanted)
        WebDriverWait(self.driver, 10).until(lambda _: self.picture()[1] != before)
        self.assertEqual(buttons[0].get_attribute("aria-current"), "true")

    def test_dark_light_and_a_phone(self):
        self.open(self.two())
        back = "return getComputedStyle(document.documentElement).backgroundColor"
        first = self.js(back)
        self.driver.find_element(By.CSS_SELECTOR, "header .icon").click()
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
        self.driver.get_log("browser")  # three.js says there that it has no context

    def test_points_alone_have_no_slices(self):
        self.open(self.page_of("cloud", "reconstruct", self.points, "-o", "s.vdb"))
        self.assertGreater(self.picture()[0], 0.1)
        self.assertEqual(self.driver.find_elements(By.CSS_SELECTOR, ".slice"), [])

    @unittest.skipUnless(os.environ.get("COVOL_DATA"), "SKIPPED: COVOL_DATA is not set")
    def test_a_stack_of_15_million_voxels_stays_small_and_opens_soon(self):
        data = pathlib.Path(os.environ["COVOL_DATA"]) / "phantoms"
        page = self.page_of("embryo", "segment", data / "embryo.tif", "--init", "sphere:89.6,89.6,28.5,25", "--max-steps", 0, "-o", "s.vdb")
        self.assertLess(page.stat().st_size, 15 * MB)
        self.open(page)
        print(f"page of {page.stat().st_size / MB:.1f} MB: first view after {self.js('return report.ready'):.0f} ms, all slices after {self.js('return report.decoded'):.0f} ms")
        self.assertLess(self.js("return report.ready"), 20000)  # no gate on time: a machine with two busy cores


if __name__ == "__main__":
    unittest.main()
