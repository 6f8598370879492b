"""Mistakes on purpose: which of them covol refuses, which it warns of, and which pass without a warning.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/silence.py [--covol BINARY] [--quick] [--check]

Marks as in table.py, and the same after a mistake that people make. A result is wrong if its Dice with the truth is below 0.8; a
false alarm is a warning about correct marks and a correct result. silence_draws.csv has each run and the beginnings of its
warnings.
"""
import dataclasses
import re
import sys

import numpy as np
import tifffile

import annotator
from common import Bench, markdown, version_of

COUNTS = (300, 60, 20)
RIGHT = 0.8  # a result with at least this Dice coefficient counts as correct


# ---- mistakes: (structure, marks, rng) -> marks ---------------------------------------------------------------------

def none(structure, marks, rng):
    return marks


def shifted(structure, marks, rng):
    """Shifted by two thirds of the body, along the image's longest axis, to the side with more space."""
    axis = int(np.argmax(structure.sizes * structure.spacing))
    low, high = marks[:, axis].min(), marks[:, axis].max()
    room_above = structure.sizes[axis] - 1 - high > low
    moved = marks.copy()
    moved[:, axis] += (1 if room_above else -1) * 2 / 3 * (high - low)
    return moved


def larger(structure, marks, rng):
    return marks.mean(0) + 1.5 * (marks - marks.mean(0))


def smaller(structure, marks, rng):
    return marks.mean(0) + 0.6 * (marks - marks.mean(0))


def mirrored(structure, marks, rng):
    """Left and right exchanged, as between the conventions LPS and RAS."""
    return np.column_stack([structure.sizes[0] - 1 - marks[:, 0], marks[:, 1:]])


def swapped(structure, marks, rng):
    """z y x instead of x y z."""
    return marks[:, ::-1]


def world(structure, marks, rng):
    """World lengths instead of numbers of voxels."""
    return marks * structure.spacing


def strays(structure, marks, rng):
    """One mark in twenty, and at least one, is moved to a random position in the image."""
    wrong = rng.choice(len(marks), max(1, len(marks) // 20), replace=False)
    strayed = marks.copy()
    strayed[wrong] = rng.uniform(0, structure.sizes - 1, (len(wrong), 3))
    return strayed


def anywhere(structure, marks, rng):
    return rng.uniform(marks.min(0), marks.max(0), marks.shape)


MISTAKES = (none, shifted, larger, smaller, mirrored, swapped, world, strays, anywhere)


def shuffled_image(structure, path):
    """The image's grey values in random order: noise, as if the structure were missing."""
    values = annotator.generator(structure.name, "shuffled").permutation(structure.intensities.ravel()).reshape(structure.truth.shape)
    tifffile.imwrite(path, values.astype(np.float32), imagej=True, metadata={"axes": "ZYX", "spacing": structure.spacing[2]},
                     resolution=tuple(1 / structure.spacing[:2]))
    return dataclasses.replace(structure, image=path, options=("--spacing", ",".join(map(str, structure.spacing))))


def run(bench, structure, marks):
    answer = bench.covol.segment(structure, marks=marks)
    words = [re.sub(r"\W+", " ", warning)[:60] for warning in answer.report.get("warnings", [])]
    return answer.columns(structure) | {"warnings": len(words), "words": "; ".join(words)}


def measure(bench):
    rows, version = [], bench.covol.version + bench.truth_version + version_of(sys.modules[__name__])
    for structure in bench.structures:
        print(structure.name, flush=True)
        noise = shuffled_image(structure, bench.covol.work / "noise.tif")
        for count in COUNTS:
            for draw in bench.draws_of(structure):
                marks = annotator.marks_of(structure, count, draw)
                for mistake, seen in [*((m, structure) for m in MISTAKES), ("noise for the image", noise)]:
                    name = mistake if isinstance(mistake, str) else mistake.__name__
                    given = marks
                    if callable(mistake):
                        given = mistake(structure, marks, annotator.generator(structure.name, count, draw, name))
                    what = (structure.name, count, draw, name)
                    rows.append(dict(zip(("structure", "marks", "draw", "mistake"), what)) |
                                bench.once(what, lambda: run(bench, seen, given), version))
    return rows


def end_of(row):
    if row["code"] != 0:
        return "refused"
    right = row["dice"] >= RIGHT
    return ("warned, " if row["warnings"] else "silent, ") + ("right" if right else "wrong")


ENDS = ("refused", "warned, wrong", "warned, right", "silent, right", "silent, wrong")


def counted(rows, key):
    return [{key: value, "runs": len(members)} | {end: sum(end_of(m) == end for m in members) for end in ENDS}
            for value in dict.fromkeys(row[key] for row in rows) if (members := [row for row in rows if row[key] == value])]


def main():
    bench = Bench("silence", __doc__, 4, arguments=lambda parser: parser.add_argument(
        "--check", action="store_true", help="exit code 1 when a result is wrong in silence"))
    rows = measure(bench)
    bench.write("silence_draws", rows)
    silent = [row for row in rows if end_of(row) == "silent, wrong"]
    bench.write_text("# Mistakes on purpose: how many runs end how", markdown(counted(rows, "mistake")), markdown(counted(rows, "structure")),
                     markdown(counted(rows, "marks")),
                     "\n".join([f"{len(silent)} of {len(rows)} are wrong without a word.", "",
                                *(f"- {r['structure']}, {r['marks']} marks, draw {r['draw']}, {r['mistake']}: Dice {r['dice']:.3f}" for r in silent)]))
    return 1 if silent and bench.options.check else 0


if __name__ == "__main__":
    sys.exit(main())
