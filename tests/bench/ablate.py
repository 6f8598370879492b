"""Switches mechanisms off, one at a time, and measures what is lost on data that they were not made for: docs/history/constants.md.

    cmake --preset default -B build-sensitivity -DCOVOL_SENSITIVITY=ON -DCOVOL_BUILD_TESTS=OFF
    cmake --build build-sensitivity
    nice /usr/bin/python3 tests/bench/ablate.py build-sensitivity/bin/covol --rivals BENCH_RECONSTRUCT_RIVALS [--only NAME ...]

A mechanism is switched off by COVOL_SCALE (base/heuristics.h), which makes its condition hold never or always. The panels:

- clouds: 16 shapes of reconstruct/compare.py, 5,000 points each, without noise and with 0.25 and 1 %; the error is the sum of both
  mean distances between mesh and truth in % of the diagonal (--rivals measures it). Needs COVOL_DATA for nine of the shapes.
- marks: the jobs of sensitivity_real.py on structures of real images whose error is 1 - Dice. Needs COVOL_DATA.
- scans: the scenes of reconstruct/scenes.py (rooms, fronts of houses, terrain, bodies with edges) from points alone, from points with
  noise, and from points with normals; the error is the mean distance to the true surface and back in % of the spacing, plus the % of
  the area that faces the wrong side. With COVOL_DATA also four scanned objects, of which the genus is known; their error is the mean
  distance from the points to the surface, or, for a ball, from the surface to the sphere.
- jobs: all small jobs of sensitivity_jobs.JOBS: clouds, scans of one side, given normals, contours, painted slices, guesses, growth.

`--scale "join_pieces.max_gap=0"` tries what is not in the list; `--against BINARY` compares two programs instead.
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

import numpy as np
from scipy.spatial import cKDTree

import sensitivity_jobs as jobs
from tables import markdown

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "reconstruct"))
import clouds  # noqa: E402
import ply  # noqa: E402
import scenes  # noqa: E402
import shapes  # noqa: E402

MAX_SECONDS = 120   # of processor time per job; a job that takes longer fails
# A case counts as better or worse if its error changes by more than this fraction of itself, and by more than
# MINIMUM[panel].
NOTICEABLE = 0.05
MINIMUM = {"clouds": 0, "scans": 1, "marks": 0.2, "jobs": 0.1}  # in percentage points
NOISES = (0, 0.25, 1)
SCENE_FRACTION = 0.4  # fraction of the numbers of points in scenes.SCENES that is used, to save time
# The cases of the panel `scans`: {name of the scan: genus of the true surface}.
SCANNED = {"apc_rawlings_baseball": 0, "apc_scotch_duct_tape": 1, "apc_fitness_gear_3lb_dumbbell": 0, "apc_cloud_b_plush_bear": 0}
BALL = "apc_rawlings_baseball", (-0.0003, -0.0014, 0.0049), 0.0355  # name, centre and radius of the ball, in metres
# Mechanisms of covol, each of which is switched off in turn: {name for --only: (description, value of COVOL_SCALE that
# switches it off, panels with jobs that may use it)}.
MECHANISMS = {
    "redraw": ("a guess is redrawn by the image", "inference.redraw_bits=1000", ("jobs",)),
    "iterations": ("the second iteration of guidance", "guidance.iterations=0.5", ("marks", "jobs")),
    "level_blur": ("blur over levels of intensity", "guidance.level_blur=0.001", ("marks", "jobs")),
    "sagitta": ("error of the guess by the sagitta", "guidance.fraction_of_sagitta=0", ("marks",)),
    "layers": ("layers of a scan below others", "layers.max_patches=0", ("jobs",)),
    "patches": ("turning of patches", "iteration.patch_off=100", ("clouds", "jobs")),
    "joining": ("joining of torn pieces", "join_pieces.max_gap=0", ("clouds", "jobs")),
    "creases": ("sheets that meet", "crease.radius=0", ("clouds",)),
    "folds": ("folds by the indicator", "local_fit.off_indicator=1e9", ("clouds",)),
    "clear": ("growth: a clear edge", "grow.clear=0", ("jobs",)),
    "snapping": ("vertices beside a cut are moved onto it", "cut.close=0", ("jobs",)),
}


class Jobs:
    """All small jobs, or those on structures of real images.

    A panel has cases, {name: arguments of covol}, and output() and error() of the result in a folder.
    """

    def __init__(self, options, folder, kinds=("cloud", "open", "mask", "lapse")):
        self.inputs = folder / "in"
        self.cases = {job: jobs.arguments_of(job) for job, (_, kind, *_) in jobs.JOBS.items() if kind in kinds}

    def output(self, case, out):
        return jobs.output_of(case, out)

    def error(self, case, out):
        """(error in percent, whether the topology is right; None if it is not known)"""
        return jobs.error_of(case, self.inputs, out), None


class Marks(Jobs):
    def __init__(self, options, folder):
        super().__init__(options, folder, kinds=("real",))


class Clouds:
    def __init__(self, options, folder):
        self.rivals, self.cases, self.truths = options.rivals, {}, {}
        given = {path.stem: path for path in sorted(pathlib.Path(os.environ.get("COVOL_DATA", "/nonexistent")).glob("meshes/*.ply"))}
        folder = folder / "clouds"
        folder.mkdir()
        for name in [*given, *shapes.OWN]:
            truth = given.get(name) or shapes.truth(name, options.work / "truth")
            for noise in NOISES:
                case = f"{name} {noise:g} %"
                path = folder / f"{name}_{noise:g}.ply"
                ply.write(path, clouds.cloud(ply.read(truth), 5000, noise, 0, options.seed))
                self.cases[case] = ["reconstruct", str(path), "-o", "s.vdb", "--mesh", "s.ply"]
                self.truths[case] = truth

    def output(self, case, out):
        return out / "s.ply"

    def error(self, case, out):
        found = json.loads(subprocess.run([self.rivals, "measure", str(out / "s.ply"), str(self.truths[case])], check=True, capture_output=True, text=True).stdout)
        whole = found["components"] == 1 and found["closed"] == "yes"
        return found["mean_to"] + found["mean_from"], bool(whole and found["genus"] == found["genus_truth"])


class Scans:
    def __init__(self, options, folder):
        self.cases, self.truths = {}, {}
        folder = folder / "scans"
        folder.mkdir()
        for name, (make, count) in scenes.SCENES.items():
            for kind, noise, given in (("", 0, False), ("noisy", 0.2, False), ("with normals", 0, True)):
                scene = scenes.Scene(options.seed)
                make(scene)
                points, normals = scene.points(int(SCENE_FRACTION * count))
                apart = np.sqrt(sum(face[0] for face in scene.faces) / len(points))
                case = f"{name} {kind}".strip()
                path = folder / f"{case.replace(' ', '_')}.ply"
                points = points + scene.random.normal(0, noise * apart, points.shape)
                scenes.write_points(path, points, normals if given else None)
                self._add(case, path, (points, scene.points(300_000)))
        for path in sorted(pathlib.Path(os.environ.get("COVOL_DATA", "/nonexistent")).glob("clouds/*.ply")):
            if path.stem in SCANNED:
                self._add(path.stem, path, (ply.read(path)[0], None))

    def _add(self, case, path, truth):
        self.cases[case] = ["reconstruct", str(path), "-o", "s.vdb", "--mesh", "s.ply", "--json", "s.json"]
        self.truths[case] = truth

    def output(self, case, out):
        return out / "s.ply"

    def error(self, case, out):
        cloud, truth = self.truths[case]
        random = np.random.default_rng(3)
        measured = scenes.measure(out / "s.ply", cloud, truth, (), random)
        found, normals = clouds.sample_with_normals(*ply.read(out / "s.ply"), 100_000, random)
        if truth is None:
            surface = json.loads((out / "s.json").read_text())["surface"]
            right = surface["components"] == 1 and surface["genus"] == SCANNED[case]
            if case == BALL[0]:
                return 100 * float(np.abs(np.linalg.norm(found - BALL[1], axis=1) - BALL[2]).mean()) / BALL[2], right
            return 100 * measured["mean_from"], right
        away, nearest = cKDTree(truth[0]).query(found)
        near = away < 3 * measured["spacing"]
        against = float((np.einsum("ij,ij->i", normals, truth[1][nearest])[near] < 0).mean()) if near.any() else 1
        return 100 * (measured["mean_to"] + measured["mean_from"] + against), None


PANELS = {"clouds": Clouds, "scans": Scans, "marks": Marks, "jobs": Jobs}


class Runner:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        jobs.make_inputs(folder / "in", pathlib.Path(options.covol).resolve())
        self.panels = {name: PANELS[name](options, folder) for name in options.panels}

    def run(self, binary, scale, panel, case):
        """{digest, error, right, cpu}; error is None if the job fails."""
        out = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        binary = pathlib.Path(binary).resolve()
        environment = os.environ | {"LD_LIBRARY_PATH": str(binary.parent.parent / "lib"), "COVOL_SCALE": scale}
        try:
            done = subprocess.run([binary, *panel.cases[case], "--threads", "1", "--quiet"], cwd=out, capture_output=True, env=environment,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MAX_SECONDS, MAX_SECONDS)))
            path = panel.output(case, out)
            if done.returncode < 0 or not path.exists():
                return {"digest": "", "error": None, "right": None}
            error, right = panel.error(case, out)
            return {"digest": hashlib.sha256(path.read_bytes()).hexdigest(), "error": error, "right": right}
        finally:
            shutil.rmtree(out)

    def all(self, binary, scale, panel):
        with concurrent.futures.ThreadPoolExecutor(self.options.processes) as pool:
            return dict(zip(panel.cases, pool.map(lambda case: self.run(binary, scale, panel, case), panel.cases)))


def compared(panel, before, after):
    """A row: how many cases are unchanged, better and worse, and by how much."""
    changed = {case for case in before if before[case]["digest"] != after[case]["digest"]}
    better, worse, ratios = [], [], []
    for case in before:
        old, new = before[case]["error"], after[case]["error"]
        if old is None or new is None:
            if (old is None) != (new is None):
                (better if old is None else worse).append((np.inf, case))
            continue
        ratios.append(max(new, 1e-6) / max(old, 1e-6) if case in changed else 1)
        if abs(new - old) > NOTICEABLE * old and abs(new - old) > MINIMUM[panel]:
            (worse if new > old else better).append((abs(new - old), case))
    median_old, median_new = (np.median([r["error"] for r in results.values() if r["error"] is not None]) for results in (before, after))
    has_topology = any(r["right"] is not None for r in before.values())
    right = [sum(bool(r["right"]) for r in results.values()) for results in (before, after)] if has_topology else None

    def text(case):
        return f"{case}: " + " → ".join("fails" if results[case]["error"] is None else f"{results[case]['error']:.3g}" for results in (before, after))

    for title, cases in (("worse", worse), ("better", better)):
        print(f"{title}: " + "; ".join(text(case) for _, case in sorted(cases, reverse=True)), file=sys.stderr)
    return {"panel": panel, "cases": len(before), "same bits": len(before) - len(changed), "median error": f"{median_old:.3f} → {median_new:.3f}",
            "mean ratio": f"{np.exp(np.mean(np.log(ratios))):.3f}", "better": len(better), "worse": len(worse),
            "right topology": f"{right[0]} → {right[1]}" if right else "", "largest loss": text(max(worse)[1]) if worse else "", "largest gain": text(max(better)[1]) if better else ""}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("covol", help="of a build with -DCOVOL_SENSITIVITY=ON")
    parser.add_argument("--rivals", help="bench_reconstruct_rivals of tests/bench/reconstruct: for the clouds")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="mechanisms [all]")
    parser.add_argument("--scale", nargs="+", default=[], metavar="NAME=FACTOR", help="other settings of COVOL_SCALE, instead of the mechanisms")
    parser.add_argument("--against", metavar="BINARY", help="a program to compare with, instead of the mechanisms")
    parser.add_argument("--panels", nargs="+", choices=list(PANELS), default=list(PANELS), help="[all]")
    parser.add_argument("--seed", type=int, default=7, help="of the clouds [%(default)s]")
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/reconstruct"), help="folder for the meshes of shapes made here [%(default)s]")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--baseline", type=pathlib.Path, metavar="FILE.json", help="keeps the results without a change, for the next call")
    parser.add_argument("--output", type=pathlib.Path, metavar="FILE.md", help="the table")
    options = parser.parse_args()
    if "clouds" in options.panels and not options.rivals:
        parser.error("--rivals: expected the program that measures meshes, for the panel of clouds")
    with tempfile.TemporaryDirectory(prefix="covol_ablate_") as name:
        runner = Runner(options, pathlib.Path(name))
        known = json.loads(options.baseline.read_text()) if options.baseline and options.baseline.exists() else {}
        if options.against:
            variants = [(options.against, options.against, "", options.panels)]
        elif options.scale:
            variants = [(scale, options.covol, scale, options.panels) for scale in options.scale]
        else:
            variants = [(what, options.covol, scale, [p for p in panels if p in options.panels])
                        for mechanism, (what, scale, panels) in MECHANISMS.items() if not options.only or mechanism in options.only]
        rows = []
        for what, binary, scale, panels in variants:
            for panel in panels:
                if panel not in known:
                    known[panel] = runner.all(options.covol, "", runner.panels[panel])
                    if options.baseline:
                        options.baseline.write_text(json.dumps(known))
                rows.append({"switched off": what} | compared(panel, known[panel], runner.all(binary, scale, runner.panels[panel])))
                print(json.dumps(rows[-1], ensure_ascii=False), flush=True)
        table = markdown(rows)
        if options.output:
            options.output.write_text(table + "\n")


if __name__ == "__main__":
    main()
