"""Measures the effect of halving and doubling each heuristic constant: docs/heuristics.md.

    cmake --preset default -B build-sensitivity -DCOVOL_SENSITIVITY=ON -DCOVOL_BUILD_TESTS=OFF
    cmake --build build-sensitivity
    nice /usr/bin/python3 tests/bench/sensitivity.py build-sensitivity/bin/covol [--only STEP ...] [--minutes N]

Each constant is scaled (COVOL_SCALE="step.name=0.5") in the jobs that exercise its step (sensitivity_jobs.py). Rows are appended
to the CSV at once, and rows that are there are not computed again. `--table` runs no jobs: it writes the page from the CSV.
"""
import argparse
import collections
import concurrent.futures
import csv
import hashlib
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import sensitivity_jobs as jobs
from heuristics import SOURCE, read_heuristics

CSV, PAGE = SOURCE / "tests/bench/results/heuristics.csv", SOURCE / "docs/heuristics.md"
COLUMNS = ["name", "value", "factor", "job", "state", "error", "seconds"]
MAX_SECONDS = 20  # of processor time per job; a job that takes longer fails
# A value of COVOL_SCALE that changes the result of every cloud, unless the build ignores COVOL_SCALE.
CHECK = "local_fit.first_spacings=2"
# Ratings of a constant that is halved or doubled. Sensitive: the error of a job grows by more than the fraction ABOVE
# of itself, and by more than POINTS percentage points. Fails: a job fails, or its error becomes more than FAIL times as
# large and grows by more than 1 percentage point.
ABOVE, POINTS, FAIL = 0.1, 0.1, 3


# ---- running -------------------------------------------------------------------------------------------------------

class Runner:
    def __init__(self, covol, work):
        self.covol, self.work, self.known = pathlib.Path(covol).resolve(), work, {}
        if not self.covol.exists():
            raise SystemExit(f"{covol}: no such file")
        self.environment = os.environ | {"LD_LIBRARY_PATH": str(self.covol.parent.parent / "lib")}
        os.environ["LD_LIBRARY_PATH"] = self.environment["LD_LIBRARY_PATH"]
        jobs.make_inputs(work / "in", self.covol)

    def run(self, job, scale):
        """(state, error, seconds, digest); a result that is identical to the one without scaling is not measured again."""
        out = pathlib.Path(tempfile.mkdtemp(dir=self.work))
        begin = time.monotonic()
        try:
            done = subprocess.run([self.covol, *jobs.arguments_of(job), "--threads", "1", "--quiet"], cwd=out, capture_output=True, text=True,
                                  timeout=10 * MAX_SECONDS, env=self.environment | {"COVOL_SCALE": scale},
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MAX_SECONDS, MAX_SECONDS)))
            code = done.returncode
        except subprocess.TimeoutExpired:
            code = -9
        seconds = time.monotonic() - begin
        try:
            path = jobs.output_of(job, out)
            if code < 0 or not path.exists():
                return "too slow" if code < 0 else "failed", None, seconds, None
            digest = hashlib.sha256(jobs.content_of(job, out)).hexdigest()
            same = self.known.get(job)
            if same and same[3] == digest:
                return "same", same[1], seconds, digest
            return "", jobs.error_of(job, self.work / "in", out), seconds, digest
        finally:
            shutil.rmtree(out)

    def baseline(self, job):
        if job not in self.known:
            self.known[job] = self.run(job, "")
        return self.known[job]


def measure(options):
    work = pathlib.Path(tempfile.mkdtemp(prefix="covol_sensitivity_"))
    runner = Runner(options.covol, work)
    if runner.baseline("torus")[3] == runner.run("torus", CHECK)[3]:
        raise SystemExit(f"{options.covol}: COVOL_SCALE changes nothing; expected a build with -DCOVOL_SENSITIVITY=ON")
    there = {(row["name"], float(row["factor"]), row["job"]) for row in read_rows(options.csv)}
    heuristics = collections.defaultdict(list)
    for h in read_heuristics():
        if h.is_limit:
            continue
        heuristics[h.name.split(".")[0]].append(h)
    for step in set(options.only or []) - set(jobs.PLAN):
        raise SystemExit(f"--only {step}: expected one of {', '.join(jobs.PLAN)}")
    tasks = []  # the first jobs of all constants, then the second jobs, so that limited time is used for all constants
    for turn in range(max(len(names) for names in jobs.PLAN.values())):
        for step, names in jobs.PLAN.items():
            if turn < len(names) and (not options.only or step in options.only):
                tasks += [("", "", 1.0, names[turn])]
                tasks += [(h.name, h.text, factor, names[turn]) for h in heuristics[step] for factor in (0.5, 2.0) if h.scaled(factor) != h.value]
    tasks = [task for task in dict.fromkeys(tasks) if (task[0], task[2], task[3]) not in there]
    end = time.monotonic() + 60 * options.minutes
    options.csv.parent.mkdir(exist_ok=True)
    is_new = not options.csv.exists()
    with open(options.csv, "a", newline="") as file, concurrent.futures.ThreadPoolExecutor(options.processes) as pool:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(COLUMNS)

        def work_on(task):
            name, text, factor, job = task
            if time.monotonic() > end:
                return None
            as_is = runner.baseline(job)
            state, error, seconds, _ = as_is if not name else runner.run(job, f"{name}={factor}")
            return [name, text, factor, job, state, "" if error is None else f"{error:.4f}", f"{seconds:.2f}"]

        for n, row in enumerate(pool.map(work_on, tasks)):
            if row:
                writer.writerow(row)
                file.flush()
            if n % 100 == 0:
                print(f"{n} of {len(tasks)}", file=sys.stderr, flush=True)
    shutil.rmtree(work)


# ---- the page ------------------------------------------------------------------------------------------------------

def read_rows(path):
    return list(csv.DictReader(open(path))) if path.exists() else []


def number(error):
    return "fails" if error is None else f"{error:.2f}"


class Measured:
    """Of one constant: {factor: {job: error, None if it failed}}, and the errors without scaling."""
    def __init__(self, rows, as_is, constant):
        self.constant, self.same = constant, True
        self.errors = collections.defaultdict(dict)
        for row in rows:
            if row["job"] in as_is:  # only jobs that succeeded without scaling, which have an error to compare with
                self.errors[float(row["factor"])][row["job"]] = float(row["error"]) if row["error"] else None
                self.same &= row["state"] == "same"
        self.as_is = {job: as_is[job] for found in self.errors.values() for job in found}

    def median(self, factor):
        found = self.as_is if factor == 1 else self.errors.get(factor)
        return number(statistics.median([float("inf") if e is None else e for e in found.values()])).replace("inf", "fails") if found else "="

    def worst(self):
        """(growth in percentage points, job, factor, error)"""
        grown = [(float("inf") if error is None else error - self.as_is[job], job, factor, error)
                 for factor, found in self.errors.items() for job, error in found.items()]
        return max(grown, key=lambda g: g[0]) if grown else None

    def rating(self):
        if self.constant.is_limit:
            return "limit"
        if not self.errors:
            return "not run"
        if self.same:
            return "no effect"
        worst, text = self.worst(), "flat"
        for factor, found in self.errors.items():
            for job, error in found.items():
                before = self.as_is[job]
                if error is None or (error > FAIL * before and error > before + 1):
                    return "**fails**"
                if error > before * (1 + ABOVE) and error > before + POINTS:
                    text = "**sensitive**"
        return text if worst else "not run"

    def better(self):
        """The factor with which the median error is lower by more than a tenth of itself, and by more than POINTS; 1 if there is none."""
        medians = {factor: statistics.median(float("inf") if e is None else e for e in found.values()) for factor, found in [(1, self.as_is), *self.errors.items()] if found}
        best = min(medians, key=medians.get, default=1)
        return best if best != 1 and medians[best] < min(medians[1] * (1 - ABOVE), medians[1] - POINTS) else 1

    def row(self):
        h, worst = self.constant, self.worst()
        where = "" if self.same or not worst or worst[0] < 0.005 else f"{worst[1]}, {'half' if worst[2] < 1 else 'twice'}: {number(self.as_is[worst[1]])} → {number(worst[3])}"
        cells = [f"`{h.name}`", h.text, h.unit, h.meaning, str(len(self.as_is) or "")] + ([self.median(1), self.median(0.5), self.median(2)] if self.errors else ["", "", ""]) + [where, self.rating() + {0.5: ", better half", 2.0: ", better twice"}.get(self.better(), "")]
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def write_page(path, rows):
    as_is = {row["job"]: float(row["error"]) for row in rows if not row["name"] and row["error"]}
    by_name = collections.defaultdict(list)
    for row in rows:
        by_name[row["name"]].append(row)
    found = [Measured([row for row in by_name[h.name] if row["value"] == h.text], as_is, h) for h in read_heuristics()]
    ratings = collections.Counter(m.rating().strip("*") for m in found)
    summary = ", ".join(f"{ratings[rating]} {rating}" for rating in ("fails", "sensitive", "flat", "no effect", "not run", "limit") if ratings[rating])
    text = f"""# Heuristic constants

Thresholds, factors and counts that were chosen by judgement or measurement and that affect results. Each constant is defined in the `heuristics.h` of its folder of `lib/src`, in one struct for each step, with its unit and meaning. This page is generated from these files and from measurements by [`tests/bench/sensitivity.py`](../tests/bench/sensitivity.py):

```
cmake --preset default -B build-sensitivity -DCOVOL_SENSITIVITY=ON -DCOVOL_BUILD_TESTS=OFF
cmake --build build-sensitivity
nice /usr/bin/python3 tests/bench/sensitivity.py build-sensitivity/bin/covol
```

Such a build multiplies constants by the factors in the environment variable `COVOL_SCALE`, for example `COVOL_SCALE="stray.far=2"`. Every constant is halved and doubled in the jobs that exercise its step ([`sensitivity_jobs.py`](../tests/bench/sensitivity_jobs.py)): clouds of 3,000 points of a ball with spikes, a torus, a thin plate and two balls close to each other, with noise, outliers and holes; scans from one side; and phantoms of 44³ voxels with marks. The error of a cloud is the mean distance between surface and truth, in both directions, in % of the shape's half length; the error of a phantom or of a structure of a real image is 1 − Dice in %. The error of an expected Dice coefficient is the interval score of its interval in octaves of 1 − Dice; that of warnings is their number for right marks, and 10 for wrong marks without a warning. The columns give the number of jobs and the median errors with the constant as it is, halved and doubled; `=` means that a count does not change. They are followed by the job whose error grows most, and by a rating:

- **fails**: a job ends with an error or takes more than {MAX_SECONDS} s of processor time, or its error grows to more than three times its value and by more than one percentage point;
- **sensitive**: an error grows by more than a tenth of its value, and by more than {POINTS} percentage points;
- flat: none of these; no effect: all meshes of clouds and masks of phantoms are identical, bit by bit, in the jobs that were run; not run: run the command again, which continues where it ended; limit: of time or memory, which only larger inputs reach.

{len(found)} constants: {summary}; {sum(m.better() != 1 for m in found)} with a lower error if halved or doubled ("better": the median error is lower by more than a tenth, and by more than {POINTS} percentage points). A cosine or a fraction that is doubled to more than 1 makes its condition hold always or never. Sizes, formats and tolerances of solvers are not heuristics and are defined where they are used.
"""
    folder = step = None
    for m in found:
        if m.constant.folder != folder:
            folder = m.constant.folder
            text += f"\n## {folder}\n"
        if m.constant.step != step:
            step = m.constant.step
            text += f"\n{step}\n\n| constant | value | unit | meaning | jobs | as is | half | twice | worst | |\n|---|---|---|---|---|---|---|---|---|---|\n"
        text += m.row() + "\n"
    path.write_text(text)
    for rating in ("**fails**", "**sensitive**", "no effect"):
        print(rating.strip("*") + ":", ", ".join(m.constant.name for m in found if m.rating() == rating))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("covol", nargs="?", help="of a build with -DCOVOL_SENSITIVITY=ON")
    parser.add_argument("--only", nargs="+", metavar="STEP", help="of sensitivity_jobs.PLAN [all]")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=1e6, help="no job starts later [no limit]")
    parser.add_argument("--csv", type=pathlib.Path, default=CSV)
    parser.add_argument("--table", action="store_true", help="write the page from the CSV alone")
    options = parser.parse_args()
    if not options.table:
        if not options.covol:
            parser.error("COVOL is missing")
        measure(options)
    write_page(PAGE, read_rows(options.csv))


if __name__ == "__main__":
    main()
