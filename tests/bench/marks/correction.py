"""Masks of another program that are wrong on one side, corrected by marks there: the improvement, and the number of masks that get
worse.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/correction.py [--covol BINARY] [--quick] [--check]

A mask is the truth without a quarter of it on one side of a plane, or without a fifth of it in a ball around a point of its
surface; marks lie on the part of the true surface that the mask misses. correction_draws.csv has each run.
"""
import os
import sys

import numpy as np
import tifffile
from scipy import ndimage

import annotator
import truth
from common import Bench, markdown, version_of

COUNTS = (5, 10, 30)
MORE = ("hippocampus", "left atrium", "ventricle, left", "caudate", "putamen", "hippocampus 2", "brain stem")


# ---- mistakes: (structure, rng) -> mask ----------------------------------------------------------------------------

def quarter(structure, rng):
    """Removes a quarter, beyond a plane."""
    normal = rng.normal(size=3)
    height = np.argwhere(structure.truth)[:, ::-1] * structure.spacing @ normal
    mask = structure.truth.copy()
    mask[mask] = height <= np.quantile(height, 0.75)
    return mask


def bite(structure, rng):
    """Removes a fifth, within a ball."""
    places = np.argwhere(structure.truth)[:, ::-1] * structure.spacing
    vertices = structure.surface[0] * structure.spacing
    distance = np.linalg.norm(places - vertices[rng.integers(len(vertices))], axis=1)
    mask = structure.truth.copy()
    mask[mask] = distance > np.quantile(distance, 0.2)
    return mask


def marks_where_wrong(structure, mask, count, rng):
    """Marks on the truth's surface that are farther from the mask than a voxel's longest edge."""
    many = annotator.draw_by_area(structure, 200 * count, rng)
    outside = ndimage.distance_transform_edt(~mask, sampling=structure.spacing[::-1])
    index = np.rint(many).astype(int)
    wrong = many[outside[index[:, 2], index[:, 1], index[:, 0]] > structure.spacing.max()]
    return wrong[:count] if len(wrong) >= count else None


def run(bench, structure, mask, marks):
    path = bench.covol.work / "guess.tif"
    tifffile.imwrite(path, mask.astype(np.uint8))
    answer = bench.covol.segment(structure, "--guess", path, marks=marks)
    output = [w for w in answer.report.get("warnings", []) if "from the guess" in w]
    return answer.columns(structure) | {"given": truth.dice(structure.truth, mask), "warned": len(output)}


def measure(bench):
    version = bench.covol.version + bench.truth_version + version_of(sys.modules[__name__])
    rows = []
    for structure in bench.structures:
        for mistake in (quarter, bite):
            for draw in bench.draws_of(structure):
                mask = mistake(structure, annotator.generator(structure.name, mistake.__name__, draw))
                for count in COUNTS:
                    marks = marks_where_wrong(structure, mask, count, annotator.generator(structure.name, mistake.__name__, draw, count))
                    if marks is None:
                        continue
                    what = (structure.name, mistake.__name__, count, draw)
                    rows.append(dict(zip(("structure", "mistake", "marks", "draw"), what)) |
                                bench.once(what, lambda: run(bench, structure, mask, marks), version))
    return rows


def counted(rows, keys):
    for key in dict.fromkeys(tuple(row[k] for k in keys) for row in rows):
        members = [row for row in rows if tuple(row[k] for k in keys) == key]
        dice, given = (np.array([m[k] for m in members]) for k in ("dice", "given"))
        worse = dice < given
        warned = np.array([m["warned"] > 0 for m in members])
        yield dict(zip(keys, key)) | {
            "runs": len(members), "given": f"{np.median(given):.3f}", "corrected, mean": f"{dice.mean():.3f}",
            "median": f"{np.median(dice):.3f}", "worst": f"{dice.min():.3f}", "worse than given": int(worse.sum()),
            "of these silent": int((worse & ~warned).sum()), "warned, and better": int((warned & ~worse).sum())}


def main():
    bench = Bench("correction", __doc__, 5, arguments=lambda parser: parser.add_argument(
        "--check", action="store_true", help="exit code 1 when a mask becomes worse in silence"))
    words = [w for w in bench.options.only.split(",") if w]
    bench.structures += [s for s in truth.more_structures(os.environ["COVOL_DATA"])
                         if s.name in MORE and (not words or any(w in s.name for w in words))]
    rows = measure(bench)
    bench.write("correction_draws", rows)
    silent = [row for row in rows if row["dice"] < row["given"] and not row["warned"]]
    bench.write_text("# Masks that lack a part, corrected by marks", markdown(list(counted(rows, ("mistake", "marks")))),
                     markdown(list(counted(rows, ("structure",)))),
                     "\n".join([f"{len(silent)} of {len(rows)} become worse without a word.", "",
                                *(f"- {r['structure']}, {r['mistake']}, {r['marks']} marks, draw {r['draw']}: {r['given']:.3f} to {r['dice']:.3f}"
                                  for r in silent)]))
    return 1 if silent and bench.options.check else 0


if __name__ == "__main__":
    sys.exit(main())
