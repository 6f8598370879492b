"""covol reconstruct compared with other programs: surfaces from points without normals, measured against the surface from which
the points were drawn.

run.sh builds what this needs and calls it; README.md describes the measures. A cloud is drawn from each shape with each number of
points, noise and fraction of outliers. A program with parameters runs with all the values in methods(), and its best result counts
(the smallest sum of both mean distances); covol runs once with its defaults. Writes results.csv and table.md (--scans: scans.csv,
scans.md).
"""
import argparse
import csv
import dataclasses
import hashlib
import itertools
import json
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile

import numpy as np

import clouds
import picture
import ply
import shapes

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from bench import Run  # noqa: E402  (tests/bench/bench.py, which measures speed)
from tables import markdown, provenance  # noqa: E402

METHODS = ("covol", "poissonrecon", "poisson", "scale-space", "advancing-front", "alpha-wrap", "wnnc", "ipsr")


# ---- methods -------------------------------------------------------------------------------------------------------

def methods(options):
    """{method: [variant]}; a variant is a tuple of commands, each from {in} to {out}; the last one writes the mesh."""
    covol, rivals, poisson_recon = (shlex.quote(str(path)) for path in (options.covol, options.rivals, options.poisson_recon))

    def rival(what, **knobs):
        return " ".join([rivals, what, "{in} {out}", *(f"--{knob} {value}" for knob, value in knobs.items())])

    normals = [rival("normals", k=k) for k in options.normals_k]
    screened = [f"{poisson_recon} --in {{in}} --out {{out}} --depth {depth}" for depth in options.depths]
    found = {
        "covol": [(f"{covol} reconstruct {{in}} -o {{out}}.vdb --mesh {{out}} --quiet",)],
        "poissonrecon": itertools.product(normals, screened),
        "poisson": itertools.product(normals, [rival("poisson")]),
        "scale-space": [(rival("scale-space", smoothed=smoothed),) for smoothed in (0, 1)],
        "advancing-front": [(rival("advancing-front"),)],
        "alpha-wrap": [(rival("alpha-wrap", alpha=alpha),) for alpha in (1, 2, 4)],
        "wnnc": itertools.product([options.wnnc], screened),
        "ipsr": [(options.ipsr,)],
    }
    needs = {"poissonrecon": ("poisson_recon",), "wnnc": ("wnnc", "poisson_recon"), "ipsr": ("ipsr",)}
    chosen = {}
    for name in options.methods:
        missing = [f"--{need.replace('_', '-')}" for need in needs.get(name, ()) if not getattr(options, need)]
        if missing:
            print(f"{name}: SKIPPED, {' and '.join(missing)} not given")
        else:
            chosen[name] = list(found[name])
    return chosen


def knobs(steps):
    """The parameters that distinguish a variant from others: options with numbers."""
    words = [word for step in steps for word in shlex.split(step)]
    return " ".join(f"{a[2:]} {b}" for a, b in zip(words, words[1:]) if a.startswith("--") and b.isdigit())


# ---- cases ---------------------------------------------------------------------------------------------------------

@dataclasses.dataclass
class Case:
    columns: dict               # shape, count, noise and outliers; for a scan, its name
    cloud: pathlib.Path
    truth: pathlib.Path | None  # mesh of the true surface; None for a scan, of which it is unknown


def truths(options):
    """{shape: path of its mesh}"""
    given = {path.stem: path for path in sorted(pathlib.Path(options.meshes).glob("*.ply"))} if options.meshes else {}
    if options.meshes and not given:
        raise SystemExit(f"--meshes: {options.meshes}: expected .ply files, found none")
    wanted = options.shapes or [*given, *shapes.OWN]
    missing = [name for name in wanted if name not in given and name not in shapes.OWN]
    if options.meshes and missing:
        raise SystemExit(f"--shapes: expected some of {', '.join([*given, *shapes.OWN])}, got {', '.join(missing)}")
    if not options.meshes and (missing or not options.shapes):
        print(f"{', '.join(missing) or 'meshes of a folder'}: SKIPPED, --meshes is not given and COVOL_DATA is not set")
    return {name: given.get(name) or shapes.truth(name, pathlib.Path(options.work) / "truth") for name in wanted if name not in missing}


def drawn(options):
    """Cases drawn from truth meshes."""
    folder = pathlib.Path(options.work) / "clouds"
    folder.mkdir(parents=True, exist_ok=True)
    for shape, truth in truths(options).items():
        mesh = ply.read(truth)
        for count, noise, outliers in itertools.product(options.counts, options.noise, options.outliers):
            path = folder / f"{shape}_{count}_{noise:g}_{outliers:g}_{options.seed}.ply"
            ply.write(path, clouds.cloud(mesh, count, noise, outliers, options.seed))
            yield Case({"shape": shape, "count": count, "noise": noise, "outliers": outliers}, path, truth)


def scanned(options):
    for path in map(pathlib.Path, options.scans):
        yield Case({"scan": path.stem}, path, None)


# ---- measuring -----------------------------------------------------------------------------------------------------

@dataclasses.dataclass
class Made:
    path: pathlib.Path
    cpu: float = 0
    wall: float = 0
    peak: int = 0  # memory in bytes; the maximum over the programs that were run one after the other


class Trial:
    """The results for one cloud. A step that several variants have in common runs once."""

    def __init__(self, options, case, folder):
        self.options, self.case, self.folder = options, case, pathlib.Path(folder)
        self.made = {(): Made(case.cloud)}

    def make(self, steps):
        """@throws RuntimeError  a program fails or takes too long"""
        if steps not in self.made:
            before = self.make(steps[:-1])
            out = self.folder / f"{len(self.made)}.ply"
            command = [word.replace("{in}", str(before.path)).replace("{out}", str(out)) for word in shlex.split(steps[-1])]
            # passive: OpenMP's threads otherwise wait in busy loops, which would count as CPU time.
            run = Run(["prlimit", f"--cpu={self.options.timeout}", *command], OMP_WAIT_POLICY="passive")
            if not out.exists():
                raise RuntimeError("wrote nothing")
            self.made[steps] = Made(out, before.cpu + run.cpu, before.wall + run.wall, max(before.peak, run.peak))
        return self.made[steps]

    def measure(self, steps):
        try:
            made = self.make(steps)
            what = ("measure", made.path, self.case.truth) if self.case.truth else ("points", made.path, self.case.cloud)
            found = Run([self.options.rivals, *what]).json()
        except RuntimeError as error:
            return {"fails": str(error).split(":")[0]}
        return found | {"cpu": made.cpu, "wall": made.wall, "peak_mib": made.peak / 2**20}


def digest(*paths):
    found = hashlib.sha256()
    for path in paths:
        found.update(pathlib.Path(path).read_bytes())
    return found.hexdigest()


def version(program):
    """A hash of the programs, covol's with its own library; programs on PATH are identified by their name."""
    if not pathlib.Path(program).exists():
        return program
    linked = subprocess.run(["ldd", program], capture_output=True, text=True).stdout.splitlines()
    return digest(program, *(line.split("=>")[1].split()[0] for line in linked if "libcovol" in line))


def measured(options, case, trial, steps):
    """A row of the table. Results for the same programs, cloud and truth are read from a previous run."""
    reported = [[version(shlex.split(step)[0]), *shlex.split(step)[1:]] for step in steps]
    depends = [reported, version(options.rivals), digest(case.cloud), case.truth and digest(case.truth), options.timeout]
    known = pathlib.Path(options.work) / "known" / f"{hashlib.sha256(json.dumps(depends).encode()).hexdigest()[:24]}.json"
    if not known.exists():
        known.parent.mkdir(parents=True, exist_ok=True)
        known.write_text(json.dumps({"variant": knobs(steps)} | trial.measure(steps)))
    return json.loads(known.read_text())


def rank(result):
    return np.inf if "fails" in result else result["mean_to"] + result["mean_from"]


def best(results):
    """The variant with the smallest sum of both mean distances; a failed one if all fail."""
    return min(results, key=rank)


# ---- tables --------------------------------------------------------------------------------------------------------

def summary(rows):
    """A row for each method, over all cases; its errors and CPU time relative to covol's, case by case."""
    by_method, cases = {}, {}
    for row in rows:
        case = tuple(row.get(column) for column in ("scan", "shape", "count", "noise", "outliers"))
        by_method.setdefault(row["method"], {})[case] = cases.setdefault(case, {})[row["method"]] = row
    for method, found in by_method.items():
        good = {case: row for case, row in found.items() if "fails" not in row}
        whole = [row for row in good.values() if row["closed"] == "yes" and row["components"] == 1]
        reported = {"method": method, "cases": len(found), "fail": len(found) - len(good), "closed in one piece": len(whole)}
        if "shape" in rows[0]:
            reported["these of the right genus"] = sum(row["genus"] == row["genus_truth"] for row in whole)
        for column in ("mean_to", "mean_from", "hausdorff", "normals", "cpu"):
            ratios = [row[column] / cases[case]["covol"][column] for case, row in good.items()
                      if column in row and cases[case].get("covol", {}).get(column)]
            reported[f"{column} / covol's, median"] = float(np.median(ratios)) if ratios else ""
        yield reported


def write(options, name, rows, head):
    results = pathlib.Path(options.results)
    results.mkdir(parents=True, exist_ok=True)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with open(results / f"{name}.csv", "w", newline="") as file:
        file.write(f"# {head}\n")
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)
    table = results / ("scans.md" if name == "scans" else "table.md")
    table.write_text("\n\n".join([head, markdown([dict.fromkeys(columns, "") | row for row in rows]), markdown(list(summary(rows)))]) + "\n")
    print(table.read_text() + f"wrote {results / name}.csv and {table}")


# ---- options -------------------------------------------------------------------------------------------------------

def some(kind):
    """A type of options: values separated by commas."""
    def values(text):
        return [kind(word) for word in text.split(",") if word]
    values.__name__ = f"{kind.__name__}s"  # argparse shows this name if a value is invalid
    return values


def parsed():
    data = os.environ.get("COVOL_DATA")
    parser = argparse.ArgumentParser(prog="tests/bench/reconstruct/run.sh", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", type=some(str), help="of the meshes' names and "
                        f"{', '.join(shapes.OWN)}, which are made here [all]")
    parser.add_argument("--counts", type=some(int), default="5000,50000", help="points [%(default)s]")
    parser.add_argument("--noise", type=some(float), default="0,0.25,1", help="standard deviations along each axis, in %% of the diagonal [%(default)s]")
    parser.add_argument("--outliers", type=some(float), default="0", help="in %% of the points, on top of them [%(default)s]")
    parser.add_argument("--seed", type=int, default=1, help="of the clouds [%(default)s]")
    parser.add_argument("--methods", type=some(str), default=",".join(METHODS), help="[%(default)s]")
    parser.add_argument("--meshes", default=data and f"{data}/meshes", help="folder of closed truth meshes, .ply [meshes in COVOL_DATA]")
    parser.add_argument("--scans", nargs="+", metavar="FILE.ply", help="clouds without a truth, instead of shapes")
    parser.add_argument("--results", default=str(HERE / "results"), help="folder for the tables [results beside run.sh]")
    parser.add_argument("--picture", metavar="FILE.png", help="each cloud and each method's best surface, coloured by its distance to the truth")
    parser.add_argument("--poisson-recon", metavar="BINARY", help="PoissonRecon (github.com/mkazhdan/PoissonRecon)")
    parser.add_argument("--wnnc", metavar="COMMAND", help="with {in} and {out}; writes points with normals, PLY, which PoissonRecon gets")
    parser.add_argument("--ipsr", metavar="COMMAND", help="with {in} and {out}; writes a mesh, PLY")
    parser.add_argument("--normals-k", type=some(int), default="18,48", help="neighbours for the normals of the Poisson methods [%(default)s]")
    parser.add_argument("--depths", type=some(int), default="7,8,9", help="of PoissonRecon [%(default)s]")
    parser.add_argument("--timeout", type=int, default=300, help="CPU seconds that one program may take [%(default)s]")
    parser.add_argument("--covol", default="build/bin/covol", metavar="BINARY", help="[%(default)s]")
    parser.add_argument("--rivals", default="build/reconstruct/bench_reconstruct_rivals", metavar="BINARY", help="[%(default)s]")
    parser.add_argument("--work", default="build/reconstruct", help="folder for clouds, made meshes and what was measured [%(default)s]")
    options = parser.parse_args()
    for program in (options.covol, options.rivals, options.poisson_recon):
        if program and not pathlib.Path(program).exists():
            parser.error(f"{program}: no such file")
    if unknown := [name for name in options.methods if name not in METHODS]:
        parser.error(f"--methods: expected some of {', '.join(METHODS)}, got {', '.join(unknown)}")
    return options


def drawn_in(panels, case, trial, found):
    """Adds a case to the panels: its cloud and each method's best surface."""
    chosen = {method: min(results, key=lambda steps: rank(results[steps])) for method, results in found.items()}
    surfaces = [(method, *ply.read(trial.make(steps).path)) for method, steps in chosen.items() if "fails" not in found[method][steps]]
    shape, count, noise, outliers = case.columns.values()
    panels.add(f"{shape}, {count} points, noise {noise:g} %" + (f", {outliers:g} % outliers" if outliers else ""),
               ply.read(case.cloud)[0], ply.read(case.truth), surfaces)


def main():
    options = parsed()
    head = provenance()  # includes the load of the machine before the measurements
    chosen, rows = methods(options), []
    panels = picture.Panels()
    for case in (scanned if options.scans else drawn)(options):
        print(*case.columns.values(), flush=True)
        with tempfile.TemporaryDirectory(prefix="covol_reconstruct_") as folder:
            trial = Trial(options, case, folder)
            found = {method: {steps: measured(options, case, trial, steps) for steps in variants} for method, variants in chosen.items()}
            rows += [case.columns | {"method": method} | best(results.values()) for method, results in found.items()]
            if options.picture and case.truth:
                drawn_in(panels, case, trial, found)
    if not rows:
        raise SystemExit("nothing to measure: see --shapes, --counts, --noise, --outliers, --methods")
    write(options, "scans" if options.scans else "results", rows, head)
    if options.picture and not options.scans:
        panels.write(options.picture)
        print(f"wrote {options.picture}")


if __name__ == "__main__":
    main()
