"""The jobs of sensitivity.py on structures of real images, in the folder COVOL_DATA: marks, contours and guesses, and the error of their results."""
import json
import os
import pathlib
import shlex
import sys

import numpy as np
import tifffile

sys.path.insert(0, str(pathlib.Path(__file__).parent / "marks"))
import annotator  # noqa: E402
import common  # noqa: E402
import correction  # noqa: E402
import truth  # noqa: E402

# The structures of the second row were not used to choose constants. The marks are of the draw REAL_DRAW, which was
# not used for this purpose either.
REAL = ("spinal cord", "ventricle", "left atrium", "hippocampus", "worm nucleus 59", "embryo nucleus 2",
        "caudate, right", "vertebra", "hippocampus, posterior", "mouse nucleus 395", "hippocampus 2", "thalamus")
REAL_COUNTS = (60, 20)
REAL_DRAW = 11
OUTLINED, OUTLINED_STEP = ("spinal cord", "caudate, right", "hippocampus 2", "thalamus"), 4  # contours on every fourth slice
# For the jobs that compare right with wrong marks: number of marks, and shift of the wrong marks along each axis as a
# fraction of the extent of the marks.
DOUBT_COUNT, DOUBT_SHIFT = 60, 0.4
ASTRAY = 0.25  # shift of single wrong marks, in the same unit
CORRECTED, CORRECTED_COUNT = ("spinal cord", "ventricle", "caudate, right", "hippocampus 2", "thalamus"), 10  # guesses without a quarter, and marks there

# Jobs by the kind of their input, for the lists of sensitivity_jobs.py.
OF_OUTLINES = [f"{name} outlines" for name in OUTLINED]
FEW_MARKS = [f"{name} 20" for name in REAL[::2]] + [f"{name} 60" for name in REAL[1::2]]
MARKS_ALONE = [f"{name} 20 alone" for name in ("spinal cord", "left atrium", "thalamus")]
ASTRAY_MARKS = [f"{name} {DOUBT_COUNT} astray" for name in REAL[::4]]
EXPECTED_DICE = [f"{name} expected" for name in FEW_MARKS]
DOUBTED = [f"{name} {kind}" for name in REAL[::2] for kind in ("right", "wrong")]
OF_GUESSES = [f"{name} corrected" for name in CORRECTED]


def moved_within(marks, shift, last):
    """Marks that are moved along each axis in the direction in which there is more space, but not beyond the image."""
    forward = last - marks.max(0) >= marks.min(0)
    return np.clip(marks + np.where(forward, shift, -shift), 0, last)


class Inputs:
    """Writes the inputs of one structure into the folder, and collects the jobs, as in sensitivity_jobs.JOBS."""
    def __init__(self, folder, structure):
        self.folder, self.structure, self.jobs = folder, structure, {}
        np.save(folder / f"{structure.name}.npy", structure.truth)

    def add(self, job, kind, file, *options, error=("real",)):
        """@param kind  of the file of marks: --points or --contours; @param error  kind of error, and what it is compared with [the structure]"""
        command = ["segment", str(self.structure.image), *self.structure.options, kind, f"../in/{file}.csv", "--points-space", "index",
                   "-o", "s.vdb", "--mask", "m.nrrd", *options]
        self.jobs[f"{self.structure.name} {job}"] = (shlex.join(command), *error, *([self.structure.name] if len(error) == 1 else []))

    def write_marks(self, what, marks):
        """@return the file's name, without extension"""
        name = f"{self.structure.name} {what}"
        np.savetxt(self.folder / f"{name}.csv", marks, "%.5f", ",", header="x,y,z", comments="")
        return name

    def add_outlines(self):
        file = f"{self.structure.name} outlines"
        common.write_contours(self.folder / f"{file}.csv", annotator.contours_of(self.structure, OUTLINED_STEP, REAL_DRAW))
        self.add("outlines", "--contours", file)

    def add_marks(self, count):
        file = self.write_marks(count, annotator.marks_of(self.structure, count, REAL_DRAW))
        self.add(f"{count}", "--points", file)
        self.add(f"{count} expected", "--points", file, "--json", "r.json", error=("expected",))
        self.add(f"{count} alone", "--points", file, "--rho", "0")

    def add_wrong_marks(self):
        marks = annotator.marks_of(self.structure, DOUBT_COUNT, REAL_DRAW)
        last = np.array(self.structure.truth.shape[::-1]) - 1
        astray = marks.copy()
        astray[::10] = moved_within(marks[::10], ASTRAY * np.ptp(marks, 0), last)  # a tenth of the marks is wrong
        self.add(f"{DOUBT_COUNT} astray", "--points", self.write_marks("astray", astray))
        wrong = self.write_marks("wrong", moved_within(marks, DOUBT_SHIFT * np.ptp(marks, 0), last))
        for kind, file in (("right", f"{self.structure.name} {DOUBT_COUNT}"), ("wrong", wrong)):
            self.add(kind, "--points", file, "--json", "r.json", error=("doubt", kind))

    def add_guess(self):
        random = annotator.generator(self.structure.name, "guess", REAL_DRAW)
        guess = correction.quarter(self.structure, random)
        path = f"{self.structure.name} guess.tif"
        tifffile.imwrite(self.folder / path, guess.astype(np.uint8))
        file = self.write_marks("missed", correction.marks_where_wrong(self.structure, guess, CORRECTED_COUNT, random))
        self.add("corrected", "--points", file, "--guess", f"../in/{path}")


def make_real(folder):
    """Writes marks, guesses and truths into the folder. @return the jobs, as in sensitivity_jobs.JOBS"""
    made = {}
    data = os.environ["COVOL_DATA"]
    for structure in [*truth.structures(data), *truth.more_structures(data)]:
        if structure.name not in REAL:
            continue
        inputs = Inputs(folder, structure)
        for count in REAL_COUNTS:
            inputs.add_marks(count)
        inputs.add_wrong_marks()
        if structure.name in OUTLINED:
            inputs.add_outlines()
        if structure.name in CORRECTED:
            inputs.add_guess()
        made |= inputs.jobs
    return made


def real_error(folder, out, structure):
    """1 - Dice, in %."""
    return 100 * (1 - truth.dice(truth.read_nrrd(out / "m.nrrd") > 0, np.load(folder / f"{structure}.npy")))


def expected_error(folder, out, structure):
    """The interval score (Gneiting and Raftery 2007, eq. 43) of the expected 1 - Dice, whose interval has a probability of 90 %, in octaves: the width of the interval, and 20 times the distance of the actual value from the interval."""
    expected = json.loads((out / "r.json").read_text())["expected_dice"]
    low, high, actual = np.log2([1 - expected["high"], 1 - expected["low"], real_error(folder, out, structure) / 100])
    return float(high - low + 20 * max(0, low - actual, actual - high))
