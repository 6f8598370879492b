"""Whole jobs, files to files, by two builds of covol in turns: the speed-up, and whether the surface is the same.

    /usr/bin/python3 tests/bench/jobs.py --before OTHER/bin/covol --after BUILD/bin/covol [--data FOLDER] [--repeat 3] [--only a,b]

A, B, A, B, ...: of each build the repetition with the minimum processor time counts. Surfaces are compared as level sets at voxels
where both are within a voxel of zero. Without --data (COVOL_DATA's layout) only the jobs that make their own input run. Standard
library and numpy; `--before-library FOLDER` is the folder of the library if that build was moved.
"""
import argparse
import gzip
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

import numpy as np

from tables import markdown, provenance


# ---- inputs --------------------------------------------------------------------------------------------------------

def read_nifti_mask(path):
    """x y z, bool"""
    data = gzip.open(path).read()
    sizes, (kind,), (first,) = struct.unpack("<3h", data[42:48]), struct.unpack("<h", data[70:72]), struct.unpack("<f", data[108:112])
    values = np.frombuffer(data, {2: "u1", 4: "<i2", 16: "<f4", 512: "<u2"}[kind], math.prod(sizes), int(first))
    return values.reshape(sizes, order="F") > 0


def write_marks_on(mask, count, path):
    """Random marks on the faces between a mask's voxels and others, in voxels of the image."""
    rng = np.random.default_rng(count)
    faces = []
    for axis in range(3):
        change = np.diff(mask.astype(np.int8), axis=axis) != 0
        at = np.argwhere(change[tuple(slice(1, -1) if a != axis else slice(None) for a in range(3))]) + [int(a != axis) for a in range(3)]
        faces.append(at + 0.5 * np.eye(3)[axis])
    faces = np.concatenate(faces)
    chosen = faces[rng.choice(len(faces), count, replace=False)] + rng.uniform(-0.3, 0.3, (count, 3))
    np.savetxt(path, chosen, "%.4f", ",", header="x,y,z", comments="")


def write_noisy_torus(path, count):
    """Points on a knotted tube, with noise of 0.2 % of its size."""
    rng = np.random.default_rng(1)
    t, s = rng.uniform(0, 2 * np.pi, (2, count))
    ring = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], 1)
    along = np.stack([np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -3 * np.cos(3 * t)], 1)
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.cross(along, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side, axis=1)[:, None]
    points = ring + 0.45 * (np.cos(s)[:, None] * side + np.sin(s)[:, None] * np.cross(along, side))
    points += rng.normal(0, 0.002 * 6, points.shape)
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n".encode() +
                   b"".join(f"property float {a}\n".encode() for a in "xyz") + b"end_header\n")
        file.write(points.astype("<f4").tobytes())


def jobs(run, work, data):
    """(name, arguments of the command without its output)"""
    run("phantom", "sphere-round", "--size", 260, "-o", work / "holes.nrrd", "--points", work / "holes.xyz")
    holes = ["segment", work / "holes.nrrd", "--points", work / "holes.xyz", "--init", "sphere:0,0,0,0.95", "--attraction-range", "5vx"]
    yield "six-hole sphere", [*holes, "--delta", "1vx"]
    yield "six-hole sphere, delta 5vx", [*holes, "--delta", "5vx"]
    write_noisy_torus(work / "knot.ply", 500_000)
    yield "cloud of 500,000 points", ["reconstruct", work / "knot.ply"]
    if data is None:
        return
    phantoms, images = data / "phantoms", data / "images"
    for tissue in ("ve", "exe"):
        embryo = ["segment", phantoms / "embryo.tif", "--exterior-seed", "89.6,89.6,28.5"]
        yield f"{tissue} by points", [*embryo, "--points", phantoms / f"embryo_{tissue}_points.ply"]
        yield f"{tissue} by contours", [*embryo, "--contours", phantoms / f"embryo_{tissue}_contours.csv"]
    for name, image, truth in (("brain", "mri_t1_colin27", "mri_t1_colin27_brain"), ("spleen", "ct_spleen", "ct_spleen_gt")):
        write_marks_on(read_nifti_mask(images / f"{truth}.nii.gz"), 300, work / f"{name}.csv")
        marked = ["segment", images / f"{image}.nii.gz", "--points", work / f"{name}.csv", "--points-space", "index"]
        yield f"{name}, 300 marks", marked
        yield f"{name}, 300 marks, paper's model", [*marked, "--model", "paper"]


# ---- measuring -----------------------------------------------------------------------------------------------------

class Program:
    def __init__(self, path, library):
        self.path = path.resolve()
        self.environment = os.environ | ({"LD_LIBRARY_PATH": str(library.resolve())} if library else {})

    def run(self, *words):
        """@return CPU seconds, report"""
        with tempfile.NamedTemporaryFile(suffix=".json") as report:
            child = subprocess.Popen([self.path, *map(str, words), "--quiet", *(["--json", report.name] if words[0] != "phantom" else [])],
                                     env=self.environment, stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            if child.returncode not in (0, 5):
                sys.exit(f"exit code {child.returncode}: {' '.join(map(str, words))}")
            text = pathlib.Path(report.name).read_text()
        return usage.ru_utime + usage.ru_stime, json.loads(text) if text else {}, usage.ru_maxrss * 1024


def apart(first, second):
    """Mean and largest difference of the values of two level sets within a voxel of zero, in voxels."""
    import pyopenvdb
    grids = [pyopenvdb.read(str(path), "surface") for path in (first, second)]
    h = grids[0].transform.voxelSize()[0]
    other, sum_, count, largest = grids[1].getConstAccessor(), 0.0, 0, 0.0
    for item in grids[0].citerOnValues():
        if abs(item.value) > 0.5 * h:
            continue
        lo, hi = item.min, item.max
        if lo != hi:
            continue
        difference = abs(item.value - other.getValue(lo)) / h
        sum_, count, largest = sum_ + difference, count + 1, max(largest, difference)
    return sum_ / max(count, 1), largest


def stages(report):
    return {name: seconds for name, seconds in report.get("seconds", {}).items() if name != "total" and seconds > 0}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--before", type=pathlib.Path, required=True)
    parser.add_argument("--before-library", type=pathlib.Path)
    parser.add_argument("--after", type=pathlib.Path, required=True)
    parser.add_argument("--data", type=pathlib.Path, default=os.environ.get("COVOL_DATA"))
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    programs = {"before": Program(options.before, options.before_library), "after": Program(options.after, None)}
    rows, ratios = [], []
    with tempfile.TemporaryDirectory(prefix="covol-jobs-") as name:
        work = pathlib.Path(name)
        for job, words in jobs(programs["before"].run, work, options.data):
            if options.only and not any(part in job for part in options.only.split(",")):
                continue
            best = {}
            for _ in range(options.repeat):
                for which, program in programs.items():
                    measured = program.run(*words, "-o", work / f"{which}.vdb", "--threads", options.threads)
                    if which not in best or measured[0] < best[which][0]:
                        best[which] = measured
            mean, largest = apart(work / "before.vdb", work / "after.vdb")
            (cpu0, before, peak0), (cpu1, after, peak1) = best["before"], best["after"]
            wall0, wall1 = before["seconds"]["total"], after["seconds"]["total"]
            ratios.append((wall0 / wall1, cpu0 / cpu1))
            rows.append({"job": job, "s before": round(wall0, 2), "s": round(wall1, 2), "times faster": round(wall0 / wall1, 2),
                         "CPU s before": round(cpu0, 2), "CPU s": round(cpu1, 2), "times less": round(cpu0 / cpu1, 2),
                         "MiB before": peak0 >> 20, "MiB": peak1 >> 20,
                         "steps": f"{before['solve']['steps']} / {after['solve']['steps']}", "mean apart, voxels": f"{mean:.4f}",
                         "largest": f"{largest:.3f}"})
            print(f"{job}: {rows[-1]}\n  before {fmt(stages(before))}\n  after  {fmt(stages(after))}", flush=True)
    print("\n" + markdown(rows))
    for n, what in enumerate(("wall clock", "processor")):
        print(f"{what}: {math.exp(sum(math.log(r[n]) for r in ratios) / len(ratios)):.2f} times faster in the geometric mean, "
              f"{min(r[n] for r in ratios):.2f} at least")
    print(provenance())


def fmt(seconds):
    return ", ".join(f"{name} {value:.2f}" for name, value in seconds.items())


if __name__ == "__main__":
    main()
