"""The time from a click on the page of `covol mark` until the outline is on the screen, in headless Chromium.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/clicks.py [--covol BINARY] [--only WORDS] [--picture PNG]

All marks but some are set beforehand; each of the others is a click of the mouse, timed by the page's own clock from the browser's
event to the frame after the one in which the new outline was drawn.
"""
import argparse

import numpy as np

import annotator
import truth
from browser import Browser, Program
from live_client import Live, Page

# (structure, number of its marks, number of marks that are clicked, and limits in seconds for the first and for the
# refined outline)
JOBS = (("embryo nucleus 2", 20, 14, 0.2, 0.5), ("hippocampus", 60, 20, 0.2, 0.5), ("ventricle", 60, 20, 0.3, 2.0),
        ("spleen", 60, 20, 0.3, 2.0), ("brain", 300, 10, 1.0, 5.0))


def outline(browser, sequence, stage):
    """When the outline for that state was on the screen, ms of the page's clock; None if a newer one replaced it before."""
    return browser.js("const t = mark.timing.outlines.find((o) => o.seq === arguments[0] && o.stage === arguments[1]); return t ? [t.pointer, t.shown] : null", sequence, stage)


def measure(covol, structure, count, clicked):
    browser, program = Browser(), Program(covol, structure.image, structure.options)
    try:
        page = Page(program.url)
        facts, live = page.json("/image"), Live(page)
        to_world = np.array(facts["direction"]) * np.array(facts["spacing"])
        marks = annotator.marks_of(structure, count, 0)
        one = live.add_structure("structure")
        for mark in marks[:-clicked]:
            live.add_mark(one, (facts["origin"] + to_world @ mark).tolist())
        live.wait_for(one, "refined", count - clicked + 1)
        live.close()
        browser.open(program.url)
        browser.wait("return mark.meshes.items.size === 1")
        first, refined = [], []
        for mark in marks[-clicked:]:
            browser.go(mark.tolist())
            index = [float(v) for v in mark]
            index[2] = float(round(index[2]))
            if browser.js("const p = mark.panels[2]; return p.input.markAt(p.spotOf(mark.space.toWorld(arguments[0])), 12) !== null", index):
                continue  # pressing the button close to a mark would drag this mark
            sequence = browser.js("return mark.study.seq") + 1
            browser.click(2, index)
            browser.wait("const r = mark.study.structures[0].result; return mark.study.seq === arguments[0] && r.seq === arguments[0] && r.stage === 'refined' && mark.timing.outlines.some((o) => o.seq === r.seq && o.stage === 'refined')", sequence)
            pointer, shown = outline(browser, sequence, "refined")
            refined.append((shown - pointer) / 1000)
            early = outline(browser, sequence, "first")
            first.append((early[1] - early[0]) / 1000 if early else refined[-1])
        return np.array(first), np.array(refined)
    finally:
        program.close()
        browser.close()


def draw(path, results):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, all_axes = pyplot.subplots(1, len(results), figsize=(11, 2.3), constrained_layout=True)
    for axes, (name, first, refined, limits) in zip(np.atleast_1d(all_axes), results):
        bins = np.linspace(0, 1.05 * max(refined.max(), limits[1]), 26)
        axes.hist(first, bins, color="#1f6fb2", alpha=0.85, label="first outline")
        axes.hist(refined, bins, color="#e08a1e", alpha=0.75, label="refined")
        axes.set_title(name, fontsize=9)
        axes.set_xlabel("s", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
        axes.yaxis.get_major_locator().set_params(integer=True)
    np.atleast_1d(all_axes)[0].legend(fontsize=7, frameon=False)
    np.atleast_1d(all_axes)[0].set_ylabel("clicks", fontsize=8)
    figure.savefig(path, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", default="build/bin/covol")
    parser.add_argument("--only", default="")
    parser.add_argument("--clicks", type=int, help="fewer of them than usual")
    parser.add_argument("--picture", help="a histogram")
    options = parser.parse_args()
    structures = truth.by_name()
    results = []
    print("| structure | marks | first: median, 95 % below | refined: median, 95 % below |\n|---|---|---|---|")
    for name, count, clicked, *limits in JOBS:
        if options.only and options.only not in name:
            continue
        first, refined = measure(options.covol, structures[name], count, min(clicked, options.clicks or clicked))
        results.append((f"{name}, {count} marks", first, refined, limits))
        times = [f"{np.median(t):.2f}, {np.quantile(t, 0.95):.2f} s" for t in (first, refined)]
        print(f"| {name} | {count} | {times[0]} | {times[1]} |", flush=True)
    if options.picture:
        draw(options.picture, results)


if __name__ == "__main__":
    main()
