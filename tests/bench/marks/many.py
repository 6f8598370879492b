"""The page of `covol mark` with many structures in one study: opened again, scrolled, marked and undone, in headless Chromium.

    /usr/bin/python3 tests/bench/marks/many.py [--covol BINARY] [--count 200] [--marks 12]

The structures are ellipsoids in noise, like the nuclei of a tissue. First the study is made and all its surfaces are computed;
then the program is killed and started again.
"""
import argparse
import pathlib
import tempfile
import time

import numpy as np
import tifffile

from browser import Browser, Program
from large import scroll
from live_client import Live, Page

# voxels: distance of neighbouring centres, depth of the image, half axes along x, y, z.
APART, DEPTH, RADII = 30, 40, (10, 11, 9)


def make_image(path, count, rng):
    """Centres of the ellipsoids, voxels."""
    columns = 20
    rows = -(-count // columns)
    x, y, z = np.arange(columns * APART), np.arange(rows * APART), np.arange(DEPTH)
    values = rng.normal(60, 15, (len(z), len(y), len(x)))
    middles = []
    for n in range(count):
        middle = np.array([APART * (n % columns + 0.5), APART * (n // columns + 0.5), DEPTH / 2]) + rng.uniform(-3, 3, 3)
        box = tuple(slice(max(0, int(m) - 15), int(m) + 16) for m in middle[::-1])
        far = np.sqrt(((z[box[0], None, None] - middle[2]) / RADII[2]) ** 2 + ((y[None, box[1], None] - middle[1]) / RADII[1]) ** 2
                      + ((x[None, None, box[2]] - middle[0]) / RADII[0]) ** 2)
        values[box] += 100 / (1 + np.exp(10 * (far - 1)))
        middles.append(middle)
    tifffile.imwrite(path, np.clip(values, 0, 255).astype(np.uint8), imagej=True, resolution=(2, 2), metadata={"spacing": 0.5, "unit": "um", "axes": "ZYX"})
    return middles


def begin(covol, image, study, count, marks):
    """Makes the study. @return the seconds until all of its surfaces are there, and how many failed"""
    rng = np.random.default_rng(4)
    middles = make_image(image, count, rng)
    program = Program(covol, image, study=study)
    try:
        page = Page(program.url)
        facts, live = page.json("/image"), Live(page)
        to_world = np.array(facts["direction"]) * np.array(facts["spacing"])
        began = time.perf_counter()
        for n, middle in enumerate(middles):
            directions = rng.normal(size=(marks, 3))
            places = middle + np.array(RADII) * directions / np.linalg.norm(directions, axis=1)[:, None]
            structure = live.add_structure(f"nucleus {n + 1}")
            live.act(do="add_marks", structure=structure, kind="surface", world=[(facts["origin"] + to_world @ place).tolist() for place in places])
        made = {}
        while len(made) < count:
            for result in live.results:
                if result["stage"] in ("refined", "failed"):
                    made[result["structure"]] = result["stage"]
            live.results.clear()
            if len(made) < count:
                live.receive()
        live.close()
        return time.perf_counter() - began, sum(stage == "failed" for stage in made.values())
    finally:
        program.close()


def shown(browser, count, seconds=300):
    browser.wait("return mark.meshes.items.size >= arguments[0]", count, seconds=seconds)


def click_to_outline(browser, count):
    """Medians in seconds: from a click near a structure's surface to its first outline, and from the key z to the picture without the mark."""
    first, undone = [], []
    for n in range(count):
        browser.js("mark.state.set({active: mark.study.structures[arguments[0]].id})", n)
        index = browser.js("const s = mark.study.structures[arguments[0]], m = s.marks[0]; return mark.space.toIndex(m.world)", n)
        index[2], index[0] = round(index[2]), index[0] + 2.5
        browser.go(index)
        sequence = browser.js("return mark.study.seq") + 1
        browser.js("mark.panels[2].zoomAt(6, ...mark.panels[2].spotOf(mark.space.toWorld(arguments[0])))", index)
        browser.click(2, index)
        browser.wait("return mark.timing.outlines.some((o) => o.seq === arguments[0])", sequence)
        pointer, at = browser.js("const t = mark.timing.outlines.find((o) => o.seq === arguments[0]); return [t.pointer, t.shown]", sequence)
        first.append((at - pointer) / 1000)
        browser.js("window.undone = null; const begin = performance.now(), marks = mark.study.structures[arguments[0]].marks.length;"
                   "mark.study.on('change', () => { if (window.undone === null && mark.study.structures[arguments[0]].marks.length < marks) requestAnimationFrame((now) => { window.undone = now - window.pressed; }); });"
                   "addEventListener('keydown', (event) => { window.pressed = event.timeStamp; }, {once: true, capture: true});", n)
        browser.actions().send_keys("z").perform()
        undone.append(browser.wait("return window.undone") / 1000)
        browser.js("mark.panels[2].setView(null)")
    return float(np.median(first)), float(np.median(undone))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", default="build/bin/covol")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--marks", type=int, default=12)
    parser.add_argument("--shot", help="a picture of the page at the end")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study, image = folder + "/study", pathlib.Path(folder) / "nuclei.tif"
        seconds, failed = begin(options.covol, image, study, options.count, options.marks)
        print(f"{options.count} structures of {options.marks} marks were found in {seconds:.1f} s; {failed} failed", flush=True)
        browser = Browser()
        try:
            browser.driver.get("about:blank")
            program = Program(options.covol, image, study=study)
            ready = time.perf_counter() - program.began
            try:
                browser.open(program.url)
                print(f"opened again: all marks after {time.perf_counter() - program.began:.2f} s, of which the program took {ready:.2f} s", flush=True)
                shown(browser, options.count - failed)
                print(f"all surfaces after {time.perf_counter() - program.began:.2f} s", flush=True)
                for axis in (2, 1, 0):
                    frames, requested, gap = scroll(browser, axis, 40)
                    print(f"plane {axis}: {frames:.1f} slices a second seen of {requested:.1f} asked for, the longest wait {gap:.0f} ms", flush=True)
                first, undone = click_to_outline(browser, 10)
                print(f"from a click to the outline {first:.2f} s, from z to the picture without the mark {undone:.3f} s (medians)", flush=True)
                if options.shot:
                    browser.driver.save_screenshot(options.shot)
                browser.print_memory(program)
            finally:
                program.close()
        finally:
            browser.close()


if __name__ == "__main__":
    main()
