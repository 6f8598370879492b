"""Few marks: covol and established methods, with the same 300, 60 and 20 marks; median and worst of ten draws.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/table.py [--covol BINARY] [--quick] [--check]

300 and 60 marks are random points of the truth's surface, uniform by area; 20 are spread over its outlines in three planes. Each
is off by up to half a voxel along each axis, and none lies on the image's end faces. "start" is covol's own start, without steps
of the flow. rivals.py describes how the inputs of the other methods are made from the marks. table.csv has a row for each
structure, number and method, table_draws.csv one for each run.
"""
import sys

import numpy as np

import annotator
import rivals
import truth
import variational
from common import Bench, below_start, dice_cell, p95_cell, pivot, summary, version_of

COUNTS = (300, 60, 20)
WITH_IMAGE_GAINS = ("spleen", "ovule", "embryo")  # structures with clear edges, whose results the image must improve
ENOUGH = 0.96


def without_covol(structure, marks):
    """Scores of the other methods."""
    guess = rivals.variational(structure, marks)
    masks = {"variational alone": guess, "convex hull": rivals.convex_hull(structure, marks)}
    given = rivals.seeds(structure, marks, guess)
    for name, method in rivals.FROM_SEEDS.items():
        masks[name] = method(given) if given else None
    return {f"{key} {name}": value for name, mask in masks.items() for key, value in truth.score(structure, mask).items()}


def measure(bench):
    rows = []
    others = version_of(truth, annotator, rivals, variational)
    for structure in bench.structures:
        print(structure.name, flush=True)
        for count in COUNTS:
            for draw in bench.draws_of(structure):
                what = (structure.name, count, draw)
                marks = annotator.marks_of(structure, count, draw)
                one = dict(zip(("structure", "marks", "draw"), what))
                found = bench.once(what, lambda: without_covol(structure, marks), others)
                names = [key.removeprefix("dice ") for key in found if key.startswith("dice ")]
                rows += [one | {"method": name, "dice": found[f"dice {name}"], "p95": found[f"p95 {name}"]} for name in names]
                rows += bench.start_and_end(what, one, structure, marks=marks)
    return rows


# ---- acceptance criteria -----------------------------------------------------------------------------------------

def judge(rows):
    """Lines that state which criteria hold and which do not."""
    dice = {}
    for row in rows:
        dice.setdefault((row["structure"], row["marks"]), {}).setdefault(row["method"], {})[row["draw"]] = row["dice"]
    lines = []
    for (structure, count), methods in dice.items():
        of = {name: np.array([by_draw[d] for d in sorted(by_draw)]) for name, by_draw in methods.items()}
        guess, alone, both = of["variational alone"], of["covol, marks alone"], of["covol, both"]

        def expect(holds, text):
            lines.append((bool(holds), f"{structure}, {count} marks: {text}"))

        for name in ("covol, marks alone", "covol, both"):
            expect((of[name] > 0).all(), f"{name}: no run fails ({np.count_nonzero(of[name] == 0)} of {len(of[name])})")
        for what, of_draws in (("median", np.median), ("worst", np.min)):
            better = of_draws(alone) - of_draws(guess)
            expect(better >= -0.003, f"marks alone at least variational - 0.003, {what} ({better:+.3f})")
        gain = both - alone
        expect(np.median(both) >= np.median(alone), f"the image does no harm in the median ({np.median(both) - np.median(alone):+.3f})")
        expect(gain.min() >= -0.005, f"the image costs no draw more than 0.005 ({gain.min():+.3f})")
        if count == 20 and structure.startswith(WITH_IMAGE_GAINS):
            missing = ENOUGH - np.median(alone)
            expect(np.median(both) - np.median(alone) >= missing / 2,
                   f"the image brings half of what is missing to {ENOUGH} ({np.median(both) - np.median(alone):+.3f} of {missing:.3f})")
    return lines


def main():
    bench = Bench("table", __doc__, 10, arguments=lambda parser: parser.add_argument(
        "--check", action="store_true", help="exit code 1 when something does not hold"))
    rows = measure(bench)
    bench.write("table_draws", rows)
    reported = summary(rows, ("structure", "marks", "method"))
    bench.write("table", reported)
    lines, (worse, starts) = judge(rows), below_start(rows)
    failed = [f"- {text}" for holds, text in lines if not holds]
    keys = ("structure", "marks")
    bench.write_text("# Few marks: Dice, median / worst of the draws", pivot(reported, keys, "method", dice_cell),
                     "95 % distance between the surfaces in voxels, median / worst", pivot(reported, keys, "method", p95_cell),
                     starts, "\n".join([f"{len(failed)} of {len(lines)} expectations do not hold.", "", *failed]))
    return 1 if (failed or worse) and bench.options.check else 0


if __name__ == "__main__":
    sys.exit(main())
