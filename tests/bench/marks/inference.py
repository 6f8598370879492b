"""Marks and image together, on thin, curved and branched structures as well as on blobs: Dice with the truth, and whether a run's
own prediction of its quality is correct.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/inference.py [--covol BINARY] [--only WORDS] [--draws N]

300 and 60 marks are random points of the truth's surface, uniform by area; 20 are spread over its outlines in three planes. Each
is off by up to half a voxel along each axis. inference_draws.csv has each run, inference.md the medians and worst ones, and three
figures: the number of runs whose true Dice lies in the interval that `expected_dice` states, and the numbers of results below 0.8,
and above 0.9, that have a warning.
"""
import os
import sys

import numpy as np

import annotator
import truth
from common import Bench, dice_cell, pivot, summary

COUNTS = (20, 60, 300)
BAD, GOOD = 0.8, 0.9
WARNING = "the body is probably inaccurate"
# Structures that were not used while covol's inference (lib/src/inference) was developed.
KEPT_ASIDE = {"caudate, right", "ventricle, left", "thalamus", "liver", "aorta", "worm nucleus 81", "hippocampus 2", "vertebra",
              "mouse nucleus 395", "embryo nucleus 6", "hippocampus, posterior"}


def run(bench, structure, marks, *options):
    answer = bench.covol.segment(structure, *options, marks=marks)
    expected = answer.report.get("expected_dice") or {}
    return answer.columns(structure) | {
        "low": expected.get("low"), "expected": expected.get("value"), "high": expected.get("high"),
        "inferred": answer.report.get("inference", {}).get("used"),
        "warned": any(WARNING in line for line in answer.report.get("warnings", []))}


def measure(bench):
    rows = []
    for structure in bench.structures:
        for count in COUNTS:
            for draw in bench.draws_of(structure):
                what = (structure.name, count, draw)
                marks = annotator.marks_of(structure, count, draw)
                one = dict(zip(("structure", "marks", "draw"), what))
                for name, options in (("marks alone", ("--rho", 0)), ("marks and image", ())):
                    rows.append(one | {"method": name} | bench.once((*what, name), lambda: run(bench, structure, marks, *options)))
    return rows


def calibration(rows, name):
    reported = [r for r in rows if r.get("expected") is not None and r["code"] == 0]
    if not reported:
        return f"{name}: no run states what it expects."
    inside = [r["low"] <= r["dice"] <= r["high"] for r in reported]
    bad, good = ([r["warned"] for r in reported if keep(r["dice"])] for keep in (lambda d: d < BAD, lambda d: d > GOOD))
    return (f"{name}: of {len(reported)} runs {100 * np.mean(inside):.0f} % lie in their interval; {sum(bad)} of {len(bad)} below {BAD} "
            f"are warned of, {sum(good)} of {len(good)} above {GOOD}.")


def main():
    bench = Bench("inference", __doc__, 3)
    words = [w for w in bench.options.only.split(",") if w]
    if not bench.quick:
        bench.structures += [s for s in truth.more_structures(os.environ["COVOL_DATA"])
                             if not words or any(w in s.name for w in words)]
    rows = measure(bench)
    bench.write("inference_draws", rows)
    both = [r for r in rows if r["method"] == "marks and image"]
    alone = {(r["structure"], r["marks"], r["draw"]): r["dice"] for r in rows if r["method"] == "marks alone"}
    worse = [r for r in both if r["dice"] < alone[r["structure"], r["marks"], r["draw"]] - 0.005]
    reported = [t | {"what": f"{t['marks']} marks, {t['method']}"} for t in summary(rows, ("structure", "marks", "method"))]
    aside = [r for r in both if r["structure"] in KEPT_ASIDE]
    bench.write_text("# Marks and image: Dice, median / worst of the draws", pivot(reported, ("structure",), "what", dice_cell),
                     f"The image makes {len(worse)} of {len(both)} runs worse than the marks alone by more than 0.005.",
                     calibration(both, "All structures"), calibration(aside, "Structures kept aside"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
