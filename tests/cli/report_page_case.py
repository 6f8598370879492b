"""Common to the tests of report pages: pages, a browser, mouse and keys."""
import csv
import json
import os
import pathlib
import re
import shutil
import tempfile
import unittest

from covol_case import H, Case, sphere_points, write_xyz

try:
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    webdriver = By = Keys = WebDriverWait = None

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
# Markup that must stay text; without a slash, which names of structures cannot contain.
EVIL = "<!--<script>alert(1)\"&amp;'"
MB = 1e6
COARSE = ("--voxel-size", 2 * H)


def data_of(page):
    """The data of the page, as a browser finds it."""
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script', page.read_text(), re.S)[1])


def marks_file(path, count=60, shift=0.0):
    write_xyz(path, [(x + shift, y, z) for x, y, z in sphere_points(count)])
    return path


class PageCase(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.few = marks_file(cls.inputs / "few.xyz")


@unittest.skipUnless(webdriver and CHROMIUM and DRIVER, "SKIPPED: chromium, chromium-driver or python3-selenium is not installed")
class BrowserCase(PageCase):
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
        self.load(page.as_uri())
        self.addCleanup(self.quiet)
        # The page cannot save its state any more, and what it saved is removed: the next test starts from an empty
        # state.
        self.addCleanup(self.js, "Storage.prototype.setItem = () => {}; localStorage.clear(); sessionStorage.clear()")

    def load(self, address):
        self.driver.get(address)
        WebDriverWait(self.driver, 60).until(lambda d: d.execute_script("return Boolean(window.covolReport?.done)"))

    def quiet(self):
        """No errors occurred, and nothing was requested from the network."""
        self.assertEqual([entry for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"], [])
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                self.assertRegex(message["params"]["request"]["url"], "^(file|data|blob):")

    def js(self, script, *arguments):
        return self.driver.execute_script("const report = window.covolReport;" + script, *arguments)

    def picture(self):
        """The pixels of the 3D view: how many are drawn, and their sum."""
        return self.js("""
            report.view.renderNow();
            const gl = report.view.renderer.getContext(), width = gl.drawingBufferWidth, height = gl.drawingBufferHeight;
            const pixels = new Uint8Array(4 * width * height);
            gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
            let drawn = 0, sum = 0;
            for (let n = 0; n < pixels.length; n += 4) { drawn += pixels[n + 3] > 0; sum += pixels[n] + 2 * pixels[n + 1] + 3 * pixels[n + 2]; }
            return [drawn / (width * height), sum];""")

    def slice_picture(self, axis):
        return self.js("report.panels[arguments[0]].draw(); return report.panels[arguments[0]].layer.canvas.toDataURL()", axis)

    def slices(self, *at):
        if at:
            self.js("report.state.set({slices: arguments[0]}); for (const panel of report.panels) panel.draw();", at)
        return self.js("return report.state.get('slices')")

    def marks(self, structure=0):
        """The positions of the marks, in voxels, with their kinds."""
        return self.js("return report.study.structures[arguments[0]].marks.map((m) => [m.kind, ...report.space.toIndex(m.world)])", structure)

    def new_marks(self, structure=0):
        return self.marks(structure)[self.js("return report.study.given.get(arguments[0] + 1)", structure):]

    def spot(self, axis, index):
        return [round(v) for v in self.js("const p = report.panels[arguments[0]]; p.draw(); return p.pixelOf(report.space.toWorld(arguments[1]))", axis, index)]

    def mouse(self, *steps, keys=()):
        """Real events: ("move", x, y), ("down", button), ("up", button), ("wheel", x, y, delta)."""
        chain = ActionChains(self.driver, duration=0)
        for key in keys:
            chain.key_down(key)
        for what, *rest in steps:
            if what == "wheel":
                chain.w3c_actions.wheel_action.pause()
                chain.w3c_actions.wheel_action.scroll(rest[0], rest[1], 0, rest[2], 0, "viewport")
                chain.w3c_actions.key_action.pause()
                continue
            pointer = chain.w3c_actions.pointer_action
            pointer.move_to_location(*rest) if what == "move" else pointer.pointer_down(button=rest[0]) if what == "down" else pointer.pointer_up(button=rest[0])
            chain.w3c_actions.key_action.pause()
        for key in keys:
            chain.key_up(key)
        chain.perform()

    def click(self, axis, index, *keys):
        self.mouse(("move", *self.spot(axis, index)), ("down", 0), ("up", 0), keys=keys)

    def keys(self, *keys):
        chain = ActionChains(self.driver, duration=0)
        for key in keys:
            chain.send_keys(key)
        chain.perform()

    def near(self, index, wanted):
        for one, other in zip(index, wanted):
            self.assertLess(abs(one - other), 0.51, (index, wanted))

    def rows(self, name): return list(csv.DictReader((self.saved / name).read_text().splitlines()))

    def downloads(self):
        """Each file of the menu, saved."""
        self.saved = pathlib.Path(tempfile.mkdtemp(prefix="saved-", dir=self.pages))
        self.driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(self.saved)})
        menu = self.driver.find_element(By.CSS_SELECTOR, '[aria-label="save marks and the table"][aria-haspopup]')
        menu.click()
        names = [item.get_attribute("data-file") for item in self.driver.find_elements(By.CSS_SELECTOR, "[data-file]")]
        menu.click()
        for name in names:
            menu.click()
            self.driver.find_element(By.CSS_SELECTOR, f'[data-file="{name}"]').click()
            WebDriverWait(self.driver, 20, 0.05).until(lambda _: (self.saved / name).exists())
        return set(os.listdir(self.saved))
