"""covol reconstruct beside other programs: surfaces from points without normals, measured against the surface they were drawn from.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/reconstruct/bench.py --covol BINARY --rivals BINARY [--poisson-recon BINARY]
        [--only WORD,WORD] [--shapes NAME,NAME] [--counts 5000,50000] [--noise 0,0.25,1] [--outliers 0,3,10] [--methods NAME,NAME]
        [--scans]

Lengths are in % of the diagonal of the truth's bounding box (scans: the cloud's), angles in degrees without regard to orientation,
CPU seconds are user and system of all threads; a rival's include its normals. Where a program has knobs it runs with all the values
in methods() and the best result counts (the smallest sum of both mean distances): its user would have to know which. covol runs once,
as it comes. A program that fails, or needs more CPU seconds than --timeout, is a row "fails". What was measured with the same program,
cloud, truth and measure is not measured again (--work). Writes results.csv and table.md, or scans.csv and scans.md.

A wanted program that takes points and writes points with normals (--wnnc) or a mesh (--ipsr) is given as a command with {in} and {out}.
"""
import argparse
import csv
import dataclasses
import functools
import hashlib
import json
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile

import numpy as np

import clouds
import ply
import shapes

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from bench import Run, markdown, provenance  # noqa: E402  (the benchmarks of speed lie in the folder above)

RIVAL = "poissonrecon"  # the one covol is held against
ACCEPTED = 1.1          # covol's mean distances may be this many times the rival's
QUIET_THREADS = {"OMP_NUM_THREADS": "2", "OMP_WAIT_POLICY": "passive"}  # else threads that wait count as CPU time
SCANS = ("apc_*.ply", "hoppe_distcap.ply", "drosophila_embryo_nuclei.xyz")


# ---- methods -------------------------------------------------------------------------------------------------------

def methods(options):
    """{method: [variant]}; a variant is a list of commands, each from {in} to {out}, the last writes the mesh. None: not here."""
    rivals = options.rivals

    def normals(k):
        return f"{rivals} normals {{in}} {{out}} --k {k}"

    def poisson_recon(depth):
        return f"{options.poisson_recon} --in {{in}} --out {{out}} --depth {depth}"

    ks, depths = options.normals_k.split(","), options.depths.split(",")
    here = options.poisson_recon
    found = {
        "covol": [[f"{options.covol} reconstruct {{in}} -o {{out}}.vdb --mesh {{out}} --json {{out}}.json --threads 2 --quiet"]],
        "poissonrecon": here and [[normals(k), poisson_recon(depth)] for k in ks for depth in depths],
        "poisson": [[normals(k), f"{rivals} poisson {{in}} {{out}}"] for k in ks],
        "scale-space": [[f"{rivals} scale-space {{in}} {{out}} --smoothed {smoothed}"] for smoothed in (0, 1)],
        "advancing-front": [[f"{rivals} advancing-front {{in}} {{out}}"]],
        "alpha-wrap": [[f"{rivals} alpha-wrap {{in}} {{out}} --alpha {alpha}"] for alpha in (1, 2, 4)],
        "wnnc": options.wnnc and here and [[options.wnnc, poisson_recon(depth)] for depth in depths],
        "ipsr": options.ipsr and [[options.ipsr]],
    }
    wanted = options.methods.split(",")
    if unknown := set(wanted) - set(found):
        raise SystemExit(f"--methods: expected some of {', '.join(found)}, got {', '.join(sorted(unknown))}")
    for name in wanted:
        if not found[name]:
            print(f"{name}: SKIPPED, its program was not named (see --help)")
    return {name: found[name] for name in wanted if found[name]}


@functools.cache
def version(program):
    """As it was at the start: of what a command's first word runs, by content: rivals by their sources, covol with its own library."""
    path = pathlib.Path(program)
    if path.name.startswith("bench_reconstruct_rivals") or path.name == "rivals":
        return digest(*(HERE / name for name in ("rivals.cpp", "ply.cpp")))
    if not path.exists():
        return program
    linked = subprocess.run(["ldd", path], capture_output=True, text=True).stdout.splitlines()
    libraries = [line.split("=>")[1].split()[0] for line in linked if "libcovol" in line and "not found" not in line]
    return digest(path, *libraries)


def digest(*paths):
    found = hashlib.sha256()
    for path in paths:
        found.update(pathlib.Path(path).read_bytes())
    return found.hexdigest()[:16]


# ---- cases ---------------------------------------------------------------------------------------------------------

@dataclasses.dataclass
class Case:
    columns: dict               # what names it
    cloud: pathlib.Path
    truth: pathlib.Path | None  # none: a scan

    @property
    def name(self):
        return " ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in self.columns.values())


def drawn(options):
    """Cases drawn from truth meshes."""
    work = pathlib.Path(options.work)
    for shape in options.shapes.split(","):
        truth = shapes.truth(shape, work / "truth")
        if truth is None:
            print(f"{shape}: SKIPPED, COVOL_DATA is not set")
            continue
        mesh = None
        for count in map(int, options.counts.split(",")):
            for noise in map(float, options.noise.split(",")):
                for outliers in map(float, options.outliers.split(",")):
                    if outliers and (noise != 0.25 or count < 50000) and not options.all_outliers:
                        continue
                    name = f"{shape}_{count}_{noise:g}_{outliers:g}_{options.seed}"
                    path = work / "clouds" / f"{name}.ply"
                    if not path.exists():
                        path.parent.mkdir(exist_ok=True)
                        mesh = mesh or ply.read(truth)
                        ply.write(path, clouds.cloud(mesh, count, noise, outliers, options.seed))
                    columns = {"shape": shape, "count": count, "noise": noise, "outliers": outliers}
                    yield Case(columns, path, truth)


def scanned(options):
    if "COVOL_DATA" not in os.environ:
        raise SystemExit("skipped: COVOL_DATA is not set; it names the folder with the scans")
    for pattern in SCANS:
        for given in sorted((pathlib.Path(os.environ["COVOL_DATA"]) / "clouds").glob(pattern)):
            path = pathlib.Path(options.work) / "clouds" / f"{given.stem}.ply"
            if not path.exists():
                path.parent.mkdir(exist_ok=True)
                ply.write(path, np.loadtxt(given) if given.suffix == ".xyz" else ply.read(given)[0])
            yield Case({"scan": given.stem}, path, None)


# ---- measuring -----------------------------------------------------------------------------------------------------

class Measured:
    """Results, on disk by what they depend on."""

    def __init__(self, options):
        self.options = options
        self.folder = pathlib.Path(options.work) / "known"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.measure_version = digest(HERE / "measure.cpp", HERE / "ply.cpp")

    def best(self, case, variants):
        """Of the variants: the one with the smallest sum of both mean distances; {"fails": why} where none gives a mesh."""
        results = [self.once(case, variant) for variant in variants]
        good = [r for r in results if "fails" not in r]
        return min(good, key=lambda r: r["to_mean"] + r["from_mean"]) if good else results[0]

    def once(self, case, variant):
        # The programs' paths do not count, their content does.
        steps = [[version(shlex.split(step)[0]), *shlex.split(step)[1:]] for step in variant]
        depends = [digest(case.cloud), case.truth and digest(case.truth), self.measure_version, steps]
        known = self.folder / (hashlib.sha256(json.dumps(depends).encode()).hexdigest()[:24] + ".json")
        if not known.exists():
            result = {"variant": knobs(variant)} | self._run(case, variant)
            for program in {shlex.split(step)[0] for step in variant}:
                if version.__wrapped__(program) != version(program):
                    raise SystemExit(f"{program} changed while it was measured; run this again")
            known.write_text(json.dumps(result))
        return json.loads(known.read_text())

    def _run(self, case, variant):
        with tempfile.TemporaryDirectory(prefix="covol_reconstruct_") as folder:
            at, cpu, wall, peak = case.cloud, 0, 0, 0
            for n, step in enumerate(variant):
                out = pathlib.Path(folder) / f"{n}.ply"
                command = [word.replace("{in}", str(at)).replace("{out}", str(out)) for word in shlex.split(step)]
                try:
                    run = Run(["prlimit", f"--cpu={self.options.timeout}", *command], **QUIET_THREADS)
                except RuntimeError as error:
                    return {"fails": str(error).split(":")[0]}
                if not out.exists():
                    return {"fails": "wrote nothing"}
                at, cpu, wall, peak = out, cpu + run.cpu, wall + run.wall, max(peak, run.peak)
            if self.options.keep:
                self._keep(case, variant, at)
            try:
                told = Run([self.options.rivals, *(("measure", at, case.truth) if case.truth else ("points", at, case.cloud))]).json()
            except RuntimeError:
                return {"fails": "its mesh cannot be measured"}
        return {"cpu": cpu, "wall": wall, "peak_mib": peak / 2**20} | (against_truth if case.truth else against_points)(told)

    def _keep(self, case, variant, mesh):
        program = pathlib.Path(shlex.split(variant[-1])[0]).name
        target = pathlib.Path(self.options.keep) / f"{case.name} {program} {knobs(variant)}".strip().replace(" ", "_")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.with_name(target.name + ".ply").write_bytes(mesh.read_bytes())


def knobs(variant):
    """What tells a variant from others: its options with numbers."""
    words = [word for step in variant for word in shlex.split(step)]
    pairs = zip(words, words[1:])
    return " ".join(f"{a.lstrip('-')} {b}" for a, b in pairs if a.startswith("--") and b.isdigit() and a != "--threads")


def against_truth(told):
    to, back = told["to_truth"], told["from_truth"]
    return {"to_mean": to["mean"], "from_mean": back["mean"], "to_max": to["max"], "from_max": back["max"],
            "angle": told["angle"]} | topology(told)


def against_points(told):
    to, back = told["mesh_to_points"], told["points_to_mesh"]
    return {"to_mean": to["mean"], "from_mean": back["mean"], "to_p95": to["p95"], "from_p95": back["p95"],
            "spacing": told["spacing"], "share_beyond_3_spacings": told["share_beyond_3_spacings"]} | topology(told)


def topology(told):
    found = told["topology"]
    return {"genus": found.get("genus", "no manifold"), "components": found["components"], "closed": found["closed"],
            "triangles": found["triangles"]}


# ---- tables --------------------------------------------------------------------------------------------------------

def verdicts(rows):
    """Lines "holds" or "misses", one for each case: covol beside the rival; and the whole."""
    cases = {}
    for row in rows:
        key = f"{row['shape']} {row['count']}, noise {row['noise']:g} %, outliers {row['outliers']:g} %"
        cases.setdefault(key, {})[row["method"]] = row
    lines, ratios, genera, held = [], [], [], 0
    for name, found in cases.items():
        own, other = found.get("covol"), found.get(RIVAL)
        if own is None:
            continue
        if other is None or "fails" in other or "fails" in own:
            why = ", ".join(f"{m} {'fails' if row else 'is not here'}" for m, row in (("covol", own), (RIVAL, other))
                            if row is None or "fails" in row)
            lines.append(f"{'misses' if 'fails' in own else 'alone '}  {name}: {why}")
            continue
        to, back, far, cpu = (own[key] / max(other[key], 1e-12) for key in ("to_mean", "from_mean", "from_max", "cpu"))
        right = own["genus"] == own["genus_truth"] and own["components"] == 1
        reasons = [text for wrong, text in ((to > ACCEPTED, "to truth"), (back > ACCEPTED, "from truth"), (not right, "topology"),
                                            (not own["closed"], "open")) if wrong]
        ratios.append((to, back))
        genera.append((right, other["genus"] == own["genus_truth"] and other["components"] == 1))
        held += not reasons
        lines.append(
            f"{'misses' if reasons else 'holds '}  {name}: mean to truth x{to:.2f}, from truth x{back:.2f}, "
            f"farthest from truth {own['from_max']:.2f} % (x{far:.2f}), genus {own['genus']} in {own['components']} "
            f"(truth {own['genus_truth']} in 1, {RIVAL} {other['genus']} in {other['components']}), "
            f"{'closed' if own['closed'] else 'open'}, CPU {own['cpu']:.1f} s (x{cpu:.2f})" +
            (f"  <- {', '.join(reasons)}" if reasons else ""))
    if ratios:
        ratios, genera = np.array(ratios), np.array(genera)
        lines.append(f"{held} of {len(ratios)} cases hold.")
        for title, ratio in zip(("to truth", "from truth"), ratios.T):
            lines.append(f"Mean {title}: at most x{ACCEPTED} in {(ratio <= ACCEPTED).sum()}, better in {(ratio < 1).sum()} of {len(ratio)} "
                         f"(median x{np.median(ratio):.2f}, worst x{ratio.max():.2f}).")
        lines.append(f"Genus right and in one piece: covol {genera[:, 0].sum()}, {RIVAL} {genera[:, 1].sum()} of {len(genera)}.")
    return lines


def write(options, name, rows, lines, head):
    results = pathlib.Path(options.results)
    results.mkdir(parents=True, exist_ok=True)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with open(results / f"{name}.csv", "w", newline="") as file:
        file.write(f"# {head}\n")
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)
    shown = [{c: str(v) if isinstance(v := row.get(c, ""), bool) else v for c in columns} for row in rows]
    text = "\n\n".join([head, markdown(shown), "\n".join(f"- {line}" for line in lines)]) + "\n"
    told = results / ("scans.md" if name == "scans" else "table.md")
    told.write_text(text)
    print("\n".join(lines))
    print(f"wrote {results}/{name}.csv and {told}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", default="build/bin/covol", help="[%(default)s]")
    parser.add_argument("--rivals", default="build/reconstruct/bench_reconstruct_rivals", help="built from rivals.cpp [%(default)s]")
    parser.add_argument("--poisson-recon", help="PoissonRecon's binary (github.com/mkazhdan/PoissonRecon); without: skipped")
    parser.add_argument("--wnnc", help="command with {in} and {out} that writes points with normals")
    parser.add_argument("--ipsr", help="command with {in} and {out} that writes a mesh")
    parser.add_argument("--only", default="", help="words; only cases whose name (shape count noise outliers) has one of them")
    parser.add_argument("--shapes", default=",".join(shapes.NAMES), help="[%(default)s]")
    parser.add_argument("--counts", default="5000,50000", help="points [%(default)s]")
    parser.add_argument("--noise", default="0,0.25,1", help="standard deviations, in %% of the diagonal [%(default)s]")
    parser.add_argument("--outliers", default="0,3,10", help="in %% of the points; at noise 0.25 and 50000 points [%(default)s]")
    parser.add_argument("--all-outliers", action="store_true", help="outliers at all noises and counts")
    parser.add_argument("--seed", type=int, default=1, help="of the clouds [%(default)s]")
    parser.add_argument("--methods", default="covol,poissonrecon,poisson,scale-space,advancing-front,alpha-wrap", help="[%(default)s]")
    parser.add_argument("--normals-k", default="18,48", help="neighbours for the rivals' normals [%(default)s]")
    parser.add_argument("--depths", default="7,8,9", help="of PoissonRecon [%(default)s]")
    parser.add_argument("--scans", action="store_true", help="the scans of COVOL_DATA instead, without a truth")
    parser.add_argument("--timeout", type=int, default=300, help="CPU seconds a program may take [%(default)s]")
    parser.add_argument("--work", default="build/reconstruct", help="clouds, truth meshes and results are kept here [%(default)s]")
    parser.add_argument("--keep", help="a folder for the meshes of what is measured now")
    parser.add_argument("--results", default=str(HERE / "results"), help="[%(default)s]")
    options = parser.parse_args()
    for program in (options.covol, options.rivals, options.poisson_recon):
        if program and not pathlib.Path(program).exists():
            raise SystemExit(f"{program}: no such file; build it, or name it by --covol, --rivals, --poisson-recon")
    if unknown := set(options.shapes.split(",")) - set(shapes.NAMES):
        raise SystemExit(f"--shapes: expected some of {', '.join(shapes.NAMES)}, got {', '.join(sorted(unknown))}")

    head = provenance()  # with the load before
    measured, chosen, rows = Measured(options), methods(options), []
    words = [word for word in options.only.split(",") if word]
    for case in (scanned if options.scans else drawn)(options):
        if words and not any(word in case.name for word in words):
            continue
        print(case.name, flush=True)
        for method, variants in chosen.items():
            result = measured.best(case, variants)
            truth = {} if options.scans else {"genus_truth": shapes.GENUS[case.columns["shape"]]}
            rows.append(case.columns | {"method": method} | truth | result)
    if not rows:
        raise SystemExit("no case is left: see --only, --shapes, --methods")
    write(options, "scans" if options.scans else "results", rows, [] if options.scans else verdicts(rows), head)


if __name__ == "__main__":
    main()
