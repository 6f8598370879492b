"""Common to the tests of the page of `covol mark`: the program with an image, a browser, mouse and keys."""
import json
import math
import pathlib
import shutil
import signal
import subprocess
import tempfile
import unittest

import numpy as np

from covol_case import COVOL

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    webdriver = By = Keys = None

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
SIZE, SPACING, ORIGIN = (96, 80, 60), (0.8, 0.8, 1.4), (-31, 12, 5)
BALL = (34, 42, 30)  # the bright ellipsoid: its centre and its half axes (RADII), in voxels
RADII = (20, 24, 13)
# Pages are composited on the CPU, as on a computer without a graphics card. WebGL is rendered by SwiftShader on the
# CPU.
FLAGS = ["--headless=new", "--disable-gpu-compositing", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--no-first-run", "--disable-quic",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1400,900"]


def turned():
    """A direction matrix: a rotation by 25 degrees about an oblique axis."""
    axis = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(0.44) * cross + (1 - math.cos(0.44)) * cross @ cross


def write_image(path, direction, unit):
    """A bright ellipsoid with a brighter core, noise and a varying background."""
    i, j, k = np.meshgrid(*map(np.arange, SIZE), indexing="ij")
    soft = (lambda distance: 1 / (1 + np.exp(2 * distance)))
    ball = 14 * (np.sqrt(sum(((x - c) / r) ** 2 for x, c, r in zip((i, j, k), BALL, RADII))) - 1)
    core = 6 * (np.sqrt(((i - 38) / 7) ** 2 + ((j - 45) / 8) ** 2 + ((k - 31) / 5) ** 2) - 1)
    noise = np.random.default_rng(7).normal(0, 35, SIZE)
    values = 180 + 420 * soft(ball) + 180 * soft(core) + noise + 40 * np.sin(i / 17 + j / 23)
    axes = " ".join("(" + ",".join(repr(float(x)) for x in direction[:, a] * SPACING[a]) + ")" for a in range(3))
    head = ["NRRD0004", "type: uint16", "dimension: 3", "space: left-posterior-superior", "sizes: " + " ".join(map(str, SIZE)),
            f"space directions: {axes}", f'space units: "{unit}" "{unit}" "{unit}"', "endian: little", "encoding: raw",
            f"space origin: ({','.join(map(str, ORIGIN))})", "", ""]
    path.write_bytes("\n".join(head).encode() + np.clip(values, 0, 65535).astype("<u2").tobytes("F"))


class Server:
    """The program. After being killed and restarted it has the same study, but another token."""

    def __init__(self, is_turned=False, is_anatomical=False, name="ball", options=(), write=None):
        """@param write  writes another image into a folder and returns its path"""
        self.options = options
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="covol-mark-"))
        self.image = write(self.folder) if write else self.folder / f"{name}.nrrd"
        if not write:
            write_image(self.image, turned() if is_turned else np.eye(3), "mm" if is_anatomical else "um")
        self.start()

    def start(self):
        self.process = subprocess.Popen([COVOL, "mark", self.image, "--no-browser", *self.options], stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True)
        self.url = self.process.stdout.readline().split()[1]

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()

    def close(self):
        self.kill()
        shutil.rmtree(self.folder)

    def journal(self):
        lines = (self.image.parent / (self.image.name + ".covol") / "journal.jsonl").read_text().splitlines()
        return [json.loads(line) for line in lines[1:]]


def start_chromium(profile):
    """The driver of a headless Chromium. @param profile  a folder of its own"""
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for argument in [*FLAGS, f"--user-data-dir={profile}"]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))


@unittest.skipUnless(webdriver and CHROMIUM and DRIVER, "SKIPPED: chromium, chromium-driver or python3-selenium is not installed")
class PageCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.profile = tempfile.mkdtemp(prefix="covol-chromium-")
        cls.driver = start_chromium(cls.profile)

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        shutil.rmtree(cls.profile, ignore_errors=True)

    def open(self, **options):
        self.server = Server(**options)
        self.addCleanup(self.server.close)
        self.driver.get_log("browser")
        self.driver.get(self.server.url)
        self.ready()
        self.may_fail = False
        self.addCleanup(self.quiet)

    def ready(self):
        self.wait("return Boolean(window.covolMark) && mark.state.get('link') === 'open' && mark.panels.every((p) => p.slice)")

    def quiet(self):
        severe = [entry for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]
        # A surface may be replaced by a newer one before the page has requested its mesh. The status 404 is then no
        # error.
        severe = [entry for entry in severe if not ("/mesh?" in entry["message"] and "404" in entry["message"])]
        self.driver.get("about:blank")  # leaves the page before the server ends, which would cause further errors
        if not self.may_fail:
            self.assertEqual(severe, [])

    def js(self, script, *arguments):
        return self.driver.execute_script("const mark = window.covolMark;" + script, *arguments)

    def wait(self, script, *arguments, seconds=60):  # far longer than necessary, for busy machines
        return WebDriverWait(self.driver, seconds, 0.05).until(lambda _: self.js(script, *arguments))

    def settled(self):
        """Waits until all actions are on disk."""
        self.wait("return mark.queue.items.length === 0")

    def structures(self):
        return self.js("return mark.study.structures.map((s) => ({id: s.id, name: s.name, visible: s.visible, locked: s.locked, color: s.color,"
                       "marks: s.marks.map((m) => ({...m, index: mark.space.toIndex(m.world)})), outlines: s.outlines, stage: s.result?.stage ?? null}))")

    def marks(self, structure=0):
        found = self.structures()
        return found[structure]["marks"] if found else []

    def slices(self, *at):
        if at:
            self.js("mark.state.set({slices: arguments[0]})", at)
            self.wait("return mark.panels.every((p) => p.shownAt === p.at)")
        return self.js("return mark.state.get('slices')")

    def spot(self, axis, index):
        return [round(v) for v in self.js("const p = mark.panels[arguments[0]]; p.draw(); return p.pixelOf(mark.space.toWorld(arguments[1]))", axis, index)]

    def actions(self):
        return ActionChains(self.driver, duration=0)

    def move(self, chain, spot):
        """Both devices advance by one tick: held keys are down before the button press."""
        chain.w3c_actions.pointer_action.move_to_location(*spot)
        chain.w3c_actions.key_action.pause()
        return chain

    def click(self, axis, index, *held):
        chain = self.actions()
        for key in held:
            chain.key_down(key)
        self.move(chain, self.spot(axis, index)).click()
        for key in held:
            chain.key_up(key)
        chain.perform()

    def drag(self, axis, *places, steps=6):
        spots = [self.spot(axis, place) for place in places]
        chain = self.move(self.actions(), spots[0]).click_and_hold()
        for (x0, y0), (x1, y1) in zip(spots, spots[1:]):
            for n in range(1, steps + 1):
                self.move(chain, (round(x0 + (x1 - x0) * n / steps), round(y0 + (y1 - y0) * n / steps)))
        chain.release().perform()

    def hover(self, axis, index):
        self.move(self.actions(), self.spot(axis, index)).perform()

    def keys(self, *keys):
        chain = self.actions()
        for key in keys:
            chain.send_keys(key)
        chain.perform()

    def chord(self, *keys):
        chain = self.actions()
        for key in keys[:-1]:
            chain.key_down(key)
        chain.send_keys(keys[-1])
        for key in reversed(keys[:-1]):
            chain.key_up(key)
        chain.perform()

    def near(self, index, wanted, axis):
        """Along the axis the position is exact; within the slice, a screen pixel has a finite size in voxels."""
        for a in range(3):
            self.assertLess(abs(index[a] - wanted[a]), 1e-6 if a == axis else 0.5, (index, wanted))

    def mark_ball(self, count=8):
        """Marks all around it; the first ones are on its middle slice."""
        for n in range(count):
            up = (0, 0, -0.5, 0.5, 0, -0.8, 0.8)[n % 7]
            angle, wide = 2 * math.pi * n / count, math.sqrt(1 - up * up)
            k = BALL[2] + round(up * RADII[2])
            self.slices(BALL[0], BALL[1], k)
            self.click(2, [BALL[0] + wide * RADII[0] * math.cos(angle), BALL[1] + wide * RADII[1] * math.sin(angle), k])
        self.settled()
        self.slices(*BALL)

    def surface(self, structure=0):
        self.wait("const s = mark.study.structures[arguments[0]]; return s?.result?.stage === 'refined' && mark.meshes.get(s.id)?.version === s.result.version", structure)
        self.wait("return mark.view.due === Infinity")  # no drawing of the 3D view is pending
