"""Contours on every third and sixth slice: covol, its own start, and shape-based interpolation.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/contours.py [--covol BINARY] [--quick] [--check]

Marks lie on the truth's outlines in slices across the structure's usual axis, four voxels apart and off by up to half a voxel
within the slice. The draws differ in the marks and in the first marked slice. "start" is covol's own start, from the marks alone
and without steps of the flow.
"""
import sys

import annotator
import rivals
import truth
from common import Bench, below_start, dice_cell, p95_cell, pivot, summary, version_of

STEPS = (3, 6)


def measure(bench):
    rows = []
    others = version_of(truth, annotator, rivals)
    for structure in bench.structures:
        print(structure.name, flush=True)
        for step in STEPS:
            for draw in bench.draws_of(structure):
                contours = annotator.contours_of(structure, step, draw)
                what = (structure.name, step, draw)
                one = dict(zip(("structure", "every", "draw"), what)) | \
                    {"slices": len({k for k, _ in contours}), "marks": sum(len(marks) for _, marks in contours)}
                shape = bench.once((*what, "shape-based"), lambda: truth.score(
                    structure, rivals.shape_based(structure, structure.contour_axis, contours)), others)
                rows.append(one | {"method": "shape-based"} | shape)
                rows += bench.start_and_end(what, one, structure, contours=contours)
    return rows


def main():
    bench = Bench("contours", __doc__, 6, arguments=lambda parser: parser.add_argument(
        "--check", action="store_true", help="exit code 1 when a run ends below its start by more than 0.003"))
    rows = measure(bench)
    bench.write("contours_draws", rows)
    reported = summary(rows, ("structure", "every", "method"))
    bench.write("contours", reported)
    keys = ("structure", "every")
    worse, starts = below_start(rows)
    bench.write_text("# Contours on every third and sixth slice: Dice, median / worst of the draws",
                     pivot(reported, keys, "method", dice_cell),
                     "95 % distance between the surfaces in voxels, median / worst", pivot(reported, keys, "method", p95_cell),
                     starts)
    return 1 if worse and bench.options.check else 0


if __name__ == "__main__":
    sys.exit(main())
