"""The page of `covol mark` on one image: the first picture, scrolling by the wheel, marking by clicks, and memory.

    /usr/bin/python3 tests/bench/marks/large.py [IMAGE] [--covol BINARY] [--shot PNG]

Without an image it is that of large_image.py, which is made first: 2048 x 2048 x 2048 voxels in chunks, with a ball to mark.
"""
import argparse
import tempfile
import time

import numpy as np

import large_image
from browser import Browser, Program

COUNT = """
window.seen = []; const panel = window.covolMark.panels[arguments[0]], put = panel.onPicture;
panel.onPicture = (axis) => { put?.(axis); requestAnimationFrame((now) => window.seen.push([now, panel.shownAt, panel.slice.step])); };
"""


def scroll(browser, axis, slices, pause=0.02):
    """Number of different slices displayed per second while the wheel turns one slice every `pause` seconds."""
    browser.driver.execute_script(COUNT, axis)
    box = browser.js("const b = mark.panels[arguments[0]].canvas.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]", axis)
    chain = browser.actions()
    chain.w3c_actions.pointer_action.move_to_location(*map(round, box))
    chain.perform()
    begin, first = browser.js("return performance.now()"), browser.js("return mark.panels[arguments[0]].at", axis)
    for n in range(slices):
        browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseWheel", "x": box[0], "y": box[1], "deltaX": 0, "deltaY": -120})
        time.sleep(pause)
    browser.wait("const p = mark.panels[arguments[0]]; return p.shownAt === p.at", axis)
    end, last = browser.js("return performance.now()"), browser.js("return mark.panels[arguments[0]].at", axis)
    seen = browser.js("return window.seen")
    places = [place for n, (_, place, _) in enumerate(seen) if n == 0 or seen[n - 1][1] != place]
    # A voxel of the shown level of the image is `thick` slices high. These slices have the same picture, so that they
    # count as one.
    thick = browser.js("const p = mark.panels[arguments[0]]; return mark.slices.thickness(arguments[0], p.slice.step)", axis)
    seconds = (end - begin) / 1000
    gaps = [b[0] - a[0] for a, b in zip(seen, seen[1:])]
    return len(places) / seconds, abs(last // thick - first // thick) / seconds, max(gaps, default=0)


def mark_ball(browser, count=30, timed=10):
    """Clicks all around the ball of large_image.py. @return for the last clicks, seconds from the click to its first and its refined outline"""
    rng, first, refined = np.random.default_rng(3), [], []
    for n in range(count):
        direction = rng.normal(size=3)
        index = np.array(large_image.CENTRE) + large_image.RADIUS * direction / np.linalg.norm(direction)
        index[2] = round(index[2])
        browser.go(index.tolist())
        browser.js("const p = mark.panels[2]; p.setView({zoom: 8, x: arguments[0][0], y: arguments[0][1]}); p.draw()", index.tolist())
        browser.wait("return mark.slices.underWay.size === 0")
        # The first click is two actions: it also creates the structure.
        sequence = browser.js("return mark.study.seq") + 1 + (n == 0)
        browser.click(2, index.tolist())
        browser.wait("return mark.study.seq >= arguments[0]", sequence)
        if n < count - timed:
            continue
        browser.wait("return mark.timing.outlines.some((o) => o.seq === arguments[0] && o.stage === 'refined')", sequence)
        times = browser.js("return mark.timing.outlines.filter((o) => o.seq === arguments[0]).map((o) => [o.stage, (o.shown - o.pointer) / 1000])", sequence)
        first.append(min(t for _, t in times))
        refined.append(max(t for _, t in times))
    return first, refined


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?")
    parser.add_argument("--covol", default="build/bin/covol")
    parser.add_argument("--slices", type=int, default=100)
    parser.add_argument("--ball", action="store_true", help="the image is one of large_image.py")
    parser.add_argument("--shot")
    options = parser.parse_args()
    folder = tempfile.TemporaryDirectory()
    if not options.image:
        large_image.make(folder.name + "/large.zarr")
    browser = Browser()
    try:
        program = Program(options.covol, options.image or folder.name + "/large.zarr")
        try:
            ready = time.perf_counter() - program.began
            browser.open(program.url)
            print(f"first pictures {time.perf_counter() - program.began:.2f} s after the start, of which the program took {ready:.2f} s", flush=True)
            for axis in (2, 1, 0):
                browser.wait("return mark.slices.underWay.size === 0")
                shown, requested, gap = scroll(browser, axis, options.slices)
                print(f"plane {axis}: {shown:.1f} slices a second seen of {requested:.1f} asked for, the longest wait {gap:.0f} ms", flush=True)
            browser.js("const p = mark.panels[2]; p.zoomAt(30)")
            begin = time.perf_counter()
            browser.wait("const p = mark.panels[2]; return p.layer.hasFine || p.slice.step === 1")
            print(f"zoomed in: {time.perf_counter() - begin:.2f} s")
            shown, requested, gap = scroll(browser, 2, options.slices)
            print(f"plane 2, zoomed in: {shown:.1f} slices a second seen of {requested:.1f} asked for, the longest wait {gap:.0f} ms", flush=True)
            if not options.image or options.ball:
                first, refined = mark_ball(browser)
                print(f"from a click to the first outline {np.median(first):.2f} s (at most {max(first):.2f}), to the refined one {np.median(refined):.2f} s (at most {max(refined):.2f})", flush=True)
            if options.shot:
                browser.driver.save_screenshot(options.shot)
            browser.print_memory(program)
        finally:
            program.close()
    finally:
        browser.close()
        folder.cleanup()


if __name__ == "__main__":
    main()
