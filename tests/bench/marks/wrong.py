"""Gross outliers among the marks: their effect on Dice, and whether they are reported.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/wrong.py [--covol BINARY] [--only WORDS] [--draws N]

Of 60 or 300 marks 0, 5 or 10 % are replaced by random positions in the structure's box, widened by 0.3 of its sides. Those that
happen to lie within 2.5 voxels of the true surface are not counted as wrong. wrong_draws.csv has each run, wrong.md the Dice
coefficients and how many of the wrong marks, and of the correct ones, were reported (`inference.wrong_marks`).
"""
import os
import sys

import numpy as np
from scipy import ndimage

import annotator
import truth
from common import Bench, dice_cell, pivot, summary

COUNTS, FRACTIONS = (60, 300), (0.0, 0.05, 0.1)
NEAR = 2.5  # a mark is wrong if its distance from the true surface is larger, in voxels
MORE = ("hippocampus", "left atrium", "ventricle", "putamen", "iliac arteries", "colon")


def with_outliers(structure, marks, count, rng):
    """Replaces the first marks. @return the marks, and which of them are far from the truth"""
    inside = np.argwhere(structure.truth)[:, ::-1]
    low, high = inside.min(axis=0), inside.max(axis=0)
    sides = high - low
    marks = marks.copy()
    marks[:count] = np.clip(rng.uniform(low - 0.3 * sides, high + 0.3 * sides, (count, 3)), 0, structure.sizes - 1)
    away = ndimage.distance_transform_edt(~structure.truth) + ndimage.distance_transform_edt(structure.truth)
    return marks, ndimage.map_coordinates(away, marks[:, ::-1].T, order=1) > NEAR


def run(bench, structure, marks, wrong):
    answer = bench.covol.segment(structure, marks=marks)
    named = np.asarray(answer.report.get("inference", {}).get("wrong_marks", [])).reshape(-1, 3)
    info = answer.report.get("input", {}).get("image", {})
    spacing, origin = (np.asarray(info.get(key, value), float) for key, value in (("spacing", (1, 1, 1)), ("origin", (0, 0, 0))))
    direction = np.asarray(info.get("direction", np.eye(3)), float)
    world = (marks * spacing) @ direction.T + origin
    is_named = np.array([len(named) > 0 and np.linalg.norm(named - place, axis=1).min() < 1e-3 * spacing.min() for place in world])
    return answer.columns(structure) | {"wrong": int(wrong.sum()), "named": int((is_named & wrong).sum()),
                                        "named right": int((is_named & ~wrong).sum())}


def measure(bench):
    rows = []
    for structure in bench.structures:
        for count in COUNTS:
            for fraction in FRACTIONS:
                for draw in bench.draws_of(structure):
                    what = (structure.name, count, fraction, draw)
                    marks, wrong = with_outliers(structure, annotator.marks_of(structure, count, draw), round(fraction * count),
                                                 annotator.generator(*what))
                    rows.append(dict(zip(("structure", "marks", "fraction", "draw"), what)) |
                                bench.once(what, lambda: run(bench, structure, marks, wrong)))
    return rows


def main():
    bench = Bench("wrong", __doc__, 3)
    words = [w for w in bench.options.only.split(",") if w]
    if not bench.quick:
        bench.structures += [s for s in truth.more_structures(os.environ["COVOL_DATA"])
                             if s.name in MORE and (not words or any(w in s.name for w in words))]
    rows = measure(bench)
    bench.write("wrong_draws", rows)
    reported = [t | {"what": f"{t['marks']} marks, {100 * t['fraction']:.0f} %"} for t in summary(rows, ("structure", "marks", "fraction"))]
    lines = []
    for count in COUNTS:
        right = {(r["structure"], r["draw"]): r["dice"] for r in rows if (r["marks"], r["fraction"]) == (count, 0)}
        for fraction in FRACTIONS:
            of = [r for r in rows if (r["marks"], r["fraction"]) == (count, fraction)]
            lost = [right[r["structure"], r["draw"]] - r["dice"] for r in of]
            lines.append(f"- {count} marks, {100 * fraction:.0f} % wrong: Dice {np.mean([r['dice'] for r in of]):.3f} in the mean, lost "
                         f"{np.median(lost):.3f} in the median, {max(lost):.3f} at most; {sum(r['named'] for r in of)} of "
                         f"{sum(r['wrong'] for r in of)} wrong marks are named, and {sum(r['named right'] for r in of)} right ones.")
    bench.write_text("# Wrong marks: Dice, median / worst of the draws", pivot(reported, ("structure",), "what", dice_cell), "\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
