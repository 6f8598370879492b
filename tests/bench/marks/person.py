"""The result of `covol mark` after a number of clicks by a simulated person: real mouse and key events in headless Chromium, on
images with truth.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/person.py [--covol BINARY] [--only WORDS] [--seeds N] [--shots FOLDER]

The person begins with marks all around the structure, on its outlines in three planes through its middle, then looks at some
slices of each plane, and clicks at the point of the border that is farthest from the displayed outline; each third mark is set at
the page's suggestion (key n). All clicks are off by up to half a voxel. The mask is saved with the page's menu.
"""
import argparse
import base64
import pathlib
import tempfile
import time

import numpy as np
from scipy.spatial import cKDTree

import annotator
import truth
from browser import Browser, Program

# (structure, number of clicks, number of outlines). Each outline has CORNERS corners and lies on a slice of its own.
JOBS = (("embryo nucleus 2", 20, 0), ("ventricle", 60, 0), ("spleen", 40, 3))
FIRST = 9          # number of marks that are set before the first surface is awaited
SLICES = 8         # number of slices in each plane that the person looks at before a click
CORNERS = 12
PIXELS = 4         # pixels of the screen per voxel that zooming is to reach
MESH = """
const mesh = mark.meshes.items.get(mark.study.structures[0].id), bytes = new Uint8Array(Float32Array.from(mesh.positions).buffer);
let text = ''; for (let n = 0; n < bytes.length; n += 8192) text += String.fromCharCode(...bytes.subarray(n, n + 8192));
return btoa(text);
"""


class Person:
    def __init__(self, browser, structure, seed):
        self.browser, self.structure = browser, structure
        self.rng = annotator.generator(structure.name, "person", seed)
        facts = browser.js("return {direction: mark.image.direction, spacing: mark.image.spacing, origin: mark.image.origin}")
        self.to_world = np.array(facts["direction"]) * np.array(facts["spacing"])
        self.origin = np.array(facts["origin"])
        self.marked = []  # positions of all clicks, in voxels

    def zoom(self):
        """Shows the structure's middle in each plane, zoomed by Ctrl and the wheel to some pixels per voxel."""
        middle = [float(np.median(a)) for a in np.nonzero(self.structure.truth)][::-1]
        self.browser.go([round(m) for m in middle])
        for axis in (2, 1, 0):
            for _ in range(40):
                scale, x, y = self.browser.js(
                    "const p = mark.panels[arguments[0]], [x, y] = p.pixelOf(mark.space.toWorld(arguments[1])); p.draw();"
                    "return [Math.min(p.plane.scaleX, p.plane.scaleY), x, y]", axis, middle)
                if scale >= PIXELS:
                    break
                self.browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": -120, "modifiers": 2})

    def click(self, exact, axis, tool=True):
        """Clicks near a position of the border on a slice of that axis. @return whether a mark was set: an existing one nearby would be dragged"""
        index = np.array(exact, float)
        index += self.rng.uniform(-annotator.IMPRECISION, annotator.IMPRECISION, 3)
        index = np.clip(index, 0, self.structure.sizes - 1)
        index[axis] = round(exact[axis])
        self.browser.go(index.tolist())
        self.browser.js("for (const p of mark.panels) p.reveal(arguments[0])", index.tolist())
        if tool and self.browser.js("const p = mark.panels[arguments[0]]; p.draw(); return p.input.markAt(p.spotOf(mark.space.toWorld(arguments[1])), 10) !== null", axis, index.tolist()):
            return False
        self.browser.click(axis, index.tolist())
        self.marked.append(index)
        return True

    def outline_seen(self):
        """Vertices, in voxels, of the surface whose outlines the page shows; None if there is none yet."""
        self.browser.wait("return mark.queue.waiting === 0")
        sequence = self.browser.js("return mark.study.seq")
        self.browser.wait("const s = mark.study.structures[0], r = s.result; return r && (r.stage === 'empty' || r.stage === 'failed' || "
                          "(r.stage === 'refined' && r.seq >= arguments[0] && mark.meshes.items.get(s.id)?.version === r.version))", sequence)
        if not self.browser.js("return mark.meshes.items.size"):
            return None
        places = np.frombuffer(base64.b64decode(self.browser.js(MESH)), np.float32).reshape(-1, 3)
        return (places - self.origin) @ np.linalg.inv(self.to_world).T

    def first(self):
        structure = self.structure
        middle = [int(np.median(a)) for a in np.nonzero(structure.truth)][::-1]
        for axis in (2, 1, 0):
            lines = truth.Lines(structure, structure.outlines(axis, middle[axis]))
            for exact in lines.even(FIRST // 3, self.rng.random()):
                self.click(exact, axis)

    def draw_outlines(self, count):
        structure, axis = self.structure, self.structure.contour_axis
        first, last = structure.slices(axis)
        self.browser.actions().send_keys("c").perform()
        for k in np.round(first + (last - first) * (np.arange(count) + 0.5) / count).astype(int):
            line = max(structure.outlines(axis, k), key=len)
            corners = truth.Lines(structure, [line]).even(CORNERS)
            for corner in corners:
                self.click(corner, axis, tool=False)
            self.browser.actions().send_keys("\ue007").perform()  # the key Enter, which closes the outline
            self.browser.wait("return !mark.state.get('draft')")
        self.browser.actions().send_keys("s").perform()

    def on_slices(self):
        """Positions on the true border in some slices of each plane, the plane of each, and these slices."""
        places, axes, slices = [], [], []
        for axis in range(3):
            first, last = self.structure.slices(axis)
            for k in np.unique(self.rng.integers(first, last + 1, SLICES)):
                slices.append((axis, k))
                for line in self.structure.outlines(axis, k):
                    places.append(line[truth.off_end_faces(self.structure, line)])
                    axes.append(np.full(len(places[-1]), axis))
        return np.concatenate(places), np.concatenate(axes), slices

    def where_it_differs(self, seen):
        """The position, in these slices, at which border and outline differ most: a point of the border, and its plane."""
        spacing = self.structure.spacing
        places, axes, slices = self.on_slices()
        missed = cKDTree(seen * spacing).query(places * spacing)[0]
        border = cKDTree(places * spacing)
        # `missed`: distances of the true border from the nearest shown outline. `beyond`: distances of the outline from
        # the true surface. If the largest distance is one of the outline, the person clicks on the point of the border
        # that is nearest to that part of the outline.
        near = np.any([np.abs(seen[:, axis] - k) < 0.5 for axis, k in slices], axis=0)
        beyond, nearest = self.structure.surface_tree.query(seen[near] * spacing)
        if len(beyond) and beyond.max() > missed.max():
            worst = border.query(self.structure.surface_tree.data[nearest[beyond.argmax()]])[1]
        else:
            worst = missed.argmax()
        return places[worst], int(axes[worst])

    def suggested_position(self):
        """The point of the border that is nearest to the page's suggestion, in the planes that the page then shows; None: no suggestion."""
        self.browser.actions().send_keys("n").perform()
        self.browser.wait("return !mark.state.get('isAsking')")
        ring = self.browser.js("const r = mark.state.get('ring'); return r && mark.space.toIndex(r.world)")
        if ring is None:
            return None
        best = None
        for axis in range(3):
            k = int(np.clip(round(ring[axis]), 0, self.structure.sizes[axis] - 1))
            for line in self.structure.outlines(axis, k):
                away = np.linalg.norm((line - ring) * self.structure.spacing, axis=1)
                if best is None or away.min() < best[0]:
                    best = (away.min(), line[away.argmin()], axis)
        return best and best[1:]

    def mark(self, count):
        self.first()
        tries = 0
        while len(self.marked) < count and tries < 4 * count:
            tries += 1
            seen = self.outline_seen()
            suggested = self.suggested_position() if seen is not None and tries % 3 == 0 else None
            if seen is None:
                places, axes, _ = self.on_slices()
                n = self.rng.integers(len(places))
                self.click(places[n], axes[n])
            elif not self.click(*(suggested or self.where_it_differs(seen))):
                self.browser.actions().send_keys("\ue00c").perform()  # the key Escape


def save_mask(browser, folder):
    """Saves the mask with the page's menu, as a person does."""
    from selenium.webdriver.common.by import By
    browser.driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": folder})
    browser.driver.find_element(By.CSS_SELECTOR, "button[aria-label^='export']").click()
    browser.driver.find_element(By.CSS_SELECTOR, "a[title='mask.tif']").click()
    end = time.monotonic() + 120
    while time.monotonic() < end:
        saved = list(pathlib.Path(folder).glob("*.tif"))
        if saved:
            return truth.read_array(saved[0]) > 0
        time.sleep(0.1)
    raise SystemExit("the mask was not saved within two minutes")


def measure(covol, structure, clicks, outlines, seed, shots):
    browser, program = Browser(), Program(covol, structure.image, structure.options)
    try:
        browser.open(program.url)
        person = Person(browser, structure, seed)
        person.zoom()
        if outlines:
            person.draw_outlines(outlines)
            person.marked.clear()
        person.mark(clicks)
        person.outline_seen()
        if shots:
            browser.driver.save_screenshot(str(pathlib.Path(shots) / f"{structure.name.replace(' ', '_')}_{seed}.png"))
        expected = browser.js("return mark.study.structures[0].result.expected")
        with tempfile.TemporaryDirectory() as folder:
            return truth.score(structure, save_mask(browser, folder)), expected, len(person.marked)
    finally:
        program.close()
        browser.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", default="build/bin/covol")
    parser.add_argument("--only", default="")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--shots", help="a folder for pictures of the page at the end")
    options = parser.parse_args()
    structures = truth.by_name()
    print("| structure | clicks | outlines | Dice | 95 % of the border within | expected Dice |\n|---|---|---|---|---|---|")
    for name, clicks, outlines in JOBS:
        if options.only and options.only not in name:
            continue
        for seed in range(options.seeds):
            score, expected, set_marks = measure(options.covol, structures[name], clicks, outlines, seed, options.shots)
            reported = f"{expected['value']:.3f} ({expected['low']:.3f} to {expected['high']:.3f})" if expected else "none"
            print(f"| {name} | {set_marks} | {outlines} | {score['dice']:.3f} | {score['p95']:.1f} voxels | {reported} |", flush=True)


if __name__ == "__main__":
    main()
