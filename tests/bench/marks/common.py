"""Common to the measurements with few marks: running covol, results that are kept between runs, tables."""
import argparse
import csv
import dataclasses
import functools
import hashlib
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import tifffile

import annotator
import truth

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from tables import markdown, provenance  # noqa: E402  (tests/bench/tables.py)


BELOW_START = 0.003  # decrease of Dice from the start to the result that is tolerated


# ---- covol ---------------------------------------------------------------------------------------------------------

@dataclasses.dataclass
class Answer:
    mask: np.ndarray | None  # None if covol failed
    code: int                # exit code; -1: timeout
    seconds: float
    report: dict

    def columns(self, structure):
        return truth.score(structure, self.mask) | {"code": self.code, "seconds": self.seconds}


class Covol:
    def __init__(self, binary, threads, timeout):
        self.binary, self.threads, self.timeout = pathlib.Path(binary).resolve(), threads, timeout
        if not self.binary.exists():
            raise SystemExit(f"--covol: {binary}: no such file; build covol, or name its binary")
        self.work = pathlib.Path(tempfile.mkdtemp(prefix="covol_marks_"))

    @functools.cached_property
    def version(self):
        """A hash of the program and of its own library."""
        digest = hashlib.sha256(self.binary.read_bytes())
        linked = subprocess.run(["ldd", self.binary], capture_output=True, text=True).stdout
        for line in linked.splitlines():
            if "libcovol" in line:
                digest.update(pathlib.Path(line.split("=>")[1].split()[0]).read_bytes())
        return digest.hexdigest()[:16]

    def run(self, *arguments):
        """(exit code, seconds, report)"""
        report = self.work / "report.json"
        report.unlink(missing_ok=True)
        begin = time.perf_counter()
        command = [self.binary, *arguments, "--threads", self.threads, "--quiet", "--json", report]
        try:
            code = subprocess.run([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                  timeout=self.timeout).returncode
        except subprocess.TimeoutExpired:
            code = -1
        seconds = time.perf_counter() - begin
        return code, seconds, json.loads(report.read_text()) if report.exists() else {}

    def segment(self, structure, *options, marks=None, contours=None):
        given = []
        if marks is not None:
            given += ["--points", write_marks(self.work / "marks.csv", marks)]
        if contours is not None:
            given += ["--contours", write_contours(self.work / "contours.csv", contours)]
        mask = self.work / "mask.tif"
        mask.unlink(missing_ok=True)
        code, seconds, report = self.run("segment", structure.image, *structure.options, *given, "--points-space", "index",
                                         "-o", self.work / "surface.vdb", "--mask", mask, *options)
        solid = tifffile.imread(mask) > 0 if code == 0 else None
        return Answer(solid, code, seconds, report)


def write_marks(path, marks):
    np.savetxt(path, marks, "%.5f", ",", header="x,y,z", comments="")
    return path


def write_contours(path, contours):
    with open(path, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["contour", "x", "y", "z"])
        for n, (_, marks) in enumerate(contours):
            table.writerows([n, *(f"{v:.5f}" for v in mark)] for mark in marks)
    return path


# ---- tables --------------------------------------------------------------------------------------------------------

def summary(rows, keys):
    """One row for each combination of the keys: median and worst over the draws. A failed draw has Dice 0."""
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[k] for k in keys), []).append(row)
    reported = []
    for values, members in groups.items():
        dice = np.array([m["dice"] for m in members])
        p95 = np.array([m["p95"] for m in members])
        reported.append(dict(zip(keys, values)) |
                    {"draws": len(members), "dice_median": float(np.median(dice)), "dice_worst": float(dice.min()),
                     "p95_median": float(np.median(p95)), "p95_worst": float(p95.max()),
                     "failures": int(np.count_nonzero(dice == 0)),
                     "seconds_median": float(np.median([m.get("seconds", math.nan) for m in members]))})
    return reported


def pivot(reported, rows, columns, cell):
    """A table with a row for each value of `rows` (names of keys) and a column for each value of the key `columns`."""
    names = list(dict.fromkeys(t[columns] for t in reported))
    lines = {}
    for t in reported:
        lines.setdefault(tuple(t[k] for k in rows), {})[t[columns]] = cell(t)
    return markdown([dict(zip(rows, key)) | {n: line.get(n, "") for n in names} for key, line in lines.items()])


def dice_cell(t):
    """median / worst, and how many failed"""
    return f"{t['dice_median']:.3f} / {t['dice_worst']:.3f}" + (f" ({t['failures']} fail)" if t["failures"] else "")


def below_start(rows):
    """Lines for the runs whose result is below their own start by more than the tolerance."""
    ends = [row for row in rows if "above_start" in row]
    worse = [row for row in ends if row["above_start"] < -BELOW_START]
    names = [key for key in ends[0] if key in ("structure", "marks", "every", "draw", "method")]
    return worse, "\n".join([f"{len(worse)} of {len(ends)} runs end below their own start by more than {BELOW_START} Dice.", ""] + [
        "- " + ", ".join(f"{key} {row[key]}" for key in names) +
        f": {row['above_start']:+.3f}, ends at {row['dice']:.3f}, exit code {row['code']}" for row in worse])


def p95_cell(t):
    return f"{t['p95_median']:.2f} / {t['p95_worst']:.2f}"


# ---- a measurement's frame -----------------------------------------------------------------------------------------

class Bench:
    """The options common to all measurements, and the results of previous runs."""

    def __init__(self, name, description, draws, structures_needed=True, arguments=lambda parser: None):
        parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument("--covol", default="build/bin/covol", help="the binary to measure [%(default)s]")
        parser.add_argument("--results", help="where tables and plots go [results beside this script; quick: WORK/quick]")
        parser.add_argument("--work", default="build/marks", help="what was measured before is kept here [%(default)s]")
        parser.add_argument("--draws", type=int, help=f"how many draws of marks [{draws}; large structures 3]")
        parser.add_argument("--quick", action="store_true", help="2 draws, large structures left out: a test of the machinery")
        parser.add_argument("--only", default="", help="words; only structures whose name has one of them, separated by commas")
        parser.add_argument("--threads", type=int, default=2, help="of covol [%(default)s]")
        parser.add_argument("--timeout", type=float, default=300, help="seconds after which a run of covol has failed [%(default)s]")
        arguments(parser)
        self.options = parser.parse_args()
        self.name, self.quick = name, self.options.quick
        self.draws = self.options.draws or (2 if self.quick else draws)
        self.covol = Covol(self.options.covol, self.options.threads, self.options.timeout)
        work = pathlib.Path(self.options.work)
        work.mkdir(parents=True, exist_ok=True)
        self.results = pathlib.Path(self.options.results or (work / "quick" if self.quick else HERE / "results"))
        self.results.mkdir(parents=True, exist_ok=True)
        self.kept = work / f"{name}.jsonl"
        self.known = {}
        if self.kept.exists():
            for line in self.kept.read_text().splitlines():
                key, value = json.loads(line)
                self.known[key] = value
        self.truth_version = version_of(truth, annotator)
        self.provenance = provenance()  # includes the load of the machine before the measurements
        self.begin = time.perf_counter()
        if structures_needed:
            self.structures = list(self._structures())

    def _structures(self):
        data = os.environ.get("COVOL_DATA")
        if not data:
            raise SystemExit("skipped: COVOL_DATA is not set; it names the folder with the images and their truth")
        words = [w for w in self.options.only.split(",") if w]
        for structure in truth.structures(data):
            if words:
                if any(w in structure.name for w in words):
                    yield structure
            elif not (self.quick and structure.large):
                yield structure

    def draws_of(self, structure):
        return range(min(self.draws, 3) if structure.large else self.draws)

    def once(self, what, function, version=None):
        """function(), which returns a dictionary, unless its result is already known. @param what  its name; version: of what it depends on"""
        key = json.dumps([*map(str, what), version or self.covol.version + self.truth_version])
        if key not in self.known:
            value = function()
            self.known[key] = value
            with open(self.kept, "a") as file:
                file.write(json.dumps([key, value]) + "\n")
            print(f"  {', '.join(map(str, what))}: " + one_line(value), flush=True)
        return dict(self.known[key])

    def start_and_end(self, what, one, structure, **given):
        """Rows of covol with the marks alone and with the image: its own start (no steps and no image), and its result.
        @param what name of the marks; one: the columns of all rows; given: marks or contours"""
        rows = []
        for name, options in (("covol, marks alone", ("--rho", 0)), ("covol, both", ())):
            # --rho 0 as well as --max-steps 0, because the image moves a guess even before the first step of the flow.
            start = self.once((*what, "start"),
                              lambda: self.covol.segment(structure, "--rho", 0, "--max-steps", 0, **given).columns(structure))
            end = self.once((*what, name), lambda: self.covol.segment(structure, *options, **given).columns(structure))
            rows.append(one | {"method": f"{name}: start"} | start)
            rows.append(one | {"method": name, "above_start": end["dice"] - start["dice"]} | end)
        return rows

    def write(self, name, rows):
        columns = list(dict.fromkeys(key for row in rows for key in row))
        with open(self.results / f"{name}.csv", "w", newline="") as file:
            file.write(f"# {self.head()}\n")
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)

    def write_text(self, *blocks):
        """Blocks of the .md file; printed too."""
        text = "\n\n".join([*blocks, self.head()]) + "\n"
        (self.results / f"{self.name}.md").write_text(text)
        print(text)
        print(f"wrote {self.results}/{self.name}.md and .csv; {time.perf_counter() - self.begin:.0f} s")

    def head(self):
        quick = " (--quick: a test of the machinery, no result)" if self.quick else ""
        return f"{self.provenance}, binary {self.covol.version}{quick}"


def one_line(value):
    """The results on one line; for nested results (of a count or a method) only the Dice."""
    text = {k: v.get("dice") if isinstance(v, dict) else v for k, v in value.items()}
    return ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in text.items())


def version_of(*modules):
    """A hash of Python modules on which results depend."""
    digest = hashlib.sha256()
    for module in modules:
        digest.update(pathlib.Path(module.__file__).read_bytes())
    return digest.hexdigest()[:16]
