"""Compares covol with independent results: closed forms, convergence orders, the paper's shapes; writes docs/verification.md.

    /usr/bin/python3 tests/verification.py --build build [--update-docs]

Five minutes on two cores. If COVOL_DATA is set to the folder of the larger phantoms, the embryo is included. Needs numpy and
pyopenvdb, and tifffile for the embryo.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
import pyopenvdb

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "bench"))
from quality import read_vertices, shell_errors  # noqa: E402
from tables import markdown, provenance  # noqa: E402

SIDE = 2.6  # side of the cube that the phantoms fill, in units of length
# Radius of the sphere, radii of the torus, half sides of the box, as in lib/src/analysis/phantom.cpp.
R, MAJOR, MINOR, BOX = 0.8, 0.75, 0.3, np.array((0.9, 0.7, 0.5))


def off_box(p):
    q = np.abs(p) - BOX
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


SHAPES = {  # {name: (signed distance, volume, area)}
    "sphere": (lambda p: np.linalg.norm(p, axis=1) - R, 4 / 3 * np.pi * R**3, 4 * np.pi * R**2),
    "torus": (lambda p: np.hypot(np.hypot(p[:, 0], p[:, 1]) - MAJOR, p[:, 2]) - MINOR, 2 * np.pi**2 * MAJOR * MINOR**2,
              4 * np.pi**2 * MAJOR * MINOR),
    "box": (off_box, 8 * BOX.prod(), 8 * (BOX * np.roll(BOX, 1)).sum()),
}


def passed(holds):
    return "pass" if holds else "FAIL"


class Verification:
    def __init__(self, build, work):
        self.covol, self.tests, self.work = build / "bin/covol", build / "tests", pathlib.Path(work)

    def run(self, *words):
        done = subprocess.run([self.covol, *map(str, words), "--quiet", "--json", "-"], cwd=self.work, check=True, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        return json.loads(done.stdout)

    def orders(self):
        """Manufactured flows: a sphere that shrinks by its curvature, planes and spheres that move at unit speed. Passes: the error is at most 0.6 voxels at every h, so that it vanishes with first order; the one-sided differences of an advection alone cause up to half a voxel for a plane and 0.6 for the sphere (convergence/advection_test.cpp)."""
        rows = []
        for program in ("sphere_curvature_test", "advection_test"):
            output = subprocess.run([self.tests / program], check=True, text=True, stdout=subprocess.PIPE).stdout
            for line in output.splitlines():
                match = re.match(r"(.*?): .*? = ([\d.]+) h", line)
                if not match:
                    continue
                order = re.search(r"observed order ([\d.-]+)", line)
                h = re.search(r"h = ([\d.]+)", line)[1]
                flow = re.sub(r" = [\d.]+$", "", line.split(":")[0])
                rows.append({"flow": flow, "h": h, "error in voxels": match[2], "observed order": order[1] if order else "",
                             "result": passed(float(match[2]) <= 0.6)})
        return rows

    def distances(self):
        """The distance of step 1 against brute force. Sweeps propagate points from voxel to voxel, so that few voxels miss their nearest point. Passes: a mean error of at most 0.01 voxels, and nowhere half a voxel."""
        self.run("phantom", "torus", "--size", 16, "-o", "t.nrrd", "--points", "t.xyz", "--count", 3000)
        points, rows = np.loadtxt(self.work / "t.xyz"), []
        for size in (32, 64):
            h = SIDE / size
            self.run("distance", "t.xyz", "--voxel-size", h, "--max-distance", "6vx", "-o", "d.vdb")
            grid = pyopenvdb.read(str(self.work / "d.vdb"), "distance")
            places = [(item.min, item.value) for item in grid.citerOnValues()]
            chosen = np.random.default_rng(1).choice(len(places), 4000, replace=False)
            errors = []
            for n in chosen:
                place = np.array(grid.transform.indexToWorld(places[n][0]))
                errors.append(abs(np.linalg.norm(points - place, axis=1).min() - places[n][1]) / h)
            rows.append({"voxels across": size, "places": len(chosen), "mean error in voxels": f"{np.mean(errors):.1e}",
                         "largest": f"{max(errors):.1e}", "result": passed(np.mean(errors) <= 0.01 and max(errors) <= 0.5)})
        return rows

    def shapes(self):
        """Closed forms: points on a surface, and image and points, at three voxel sizes. Passes: one closed piece of the right genus, with a mean distance of at most a fifth of a voxel."""
        rows = []
        for kind, (off, volume, area) in SHAPES.items():
            for size in (32, 64, 128):
                h, files = SIDE / size, (f"{kind}.nrrd", f"{kind}.xyz")
                self.run("phantom", kind, "--size", size, "--count", 2 * size**2, "-o", files[0], "--points", files[1])
                for job, words in {"points": ("reconstruct", files[1], "--voxel-size", h),
                                   "image and points": ("segment", files[0], "--points", files[1])}.items():
                    report = self.run(*words, "-o", "s.vdb", "--mesh", "s.ply")
                    away = np.abs(off(read_vertices(self.work / "s.ply"))) / h
                    surface = report["surface"]
                    rows.append({"shape": kind, "of": job, "voxels across": size, "mean distance": f"{away.mean():.4f}",
                                 "largest": f"{away.max():.3f}", "volume": f"{100 * (surface['volume'] / volume - 1):+.3f} %",
                                 "area": f"{100 * (surface['area'] / area - 1):+.3f} %",
                                 "result": passed(surface["closed"] and surface["components"] == 1 and
                                                  surface["genus"] == (kind == "torus") and away.mean() <= 0.2)})
        return rows

    def equivariance(self):
        """Equivariance: 3,000 points of the torus, moved, reconstructed at 32 voxels across, and the surface moved back. Passes: the mean distance to the torus differs from that of the first row by at most 0.02 voxels."""
        self.run("phantom", "torus", "--size", 16, "-o", "t.nrrd", "--points", "t.xyz", "--count", 3000)
        points, h, rows = np.loadtxt(self.work / "t.xyz"), SIDE / 32, []
        turned = np.linalg.qr([[2, -1, 0.5], [1, 2, -1], [0, 1, 3]])[0]  # a rotation about no axis of the lattice
        for motion, (matrix, offset) in {
            "none": (np.eye(3), 0), "axes exchanged": (np.eye(3)[[1, 2, 0]], 0), "mirrored": (np.diag((-1, 1, 1)), 0),
            "turned": (turned, 0), "shifted by 0.3 voxels": (np.eye(3), 0.3 * h), "in micrometres instead of millimetres": (1000 * np.eye(3), 0),
        }.items():
            np.savetxt(self.work / "moved.xyz", points @ matrix.T + offset, fmt="%.9g")
            report = self.run("reconstruct", "moved.xyz", "--voxel-size", h * np.cbrt(abs(np.linalg.det(matrix))), "-o", "s.vdb", "--mesh", "s.ply")
            back = np.linalg.solve(matrix, (read_vertices(self.work / "s.ply") - offset).T).T
            mean = np.abs(SHAPES["torus"][0](back)).mean() / h
            first = rows[0]["mean distance"] if rows else mean
            rows.append({"motion": motion, "mean distance": mean, "genus": report["surface"]["genus"],
                         "result": passed(abs(mean - first) <= 0.02 and report["surface"]["genus"] == 1)})
        return [{**row, "mean distance": f"{row['mean distance']:.4f}"} for row in rows]

    def holes(self):
        """The paper's figure 4: spheres with six holes of three shapes, and points in the holes. Passes: at most 0.2 voxels on the shell wherever the image acts, and at most 0.1 in the holes wherever the points act; alone, each misses what only the other shows."""
        rows, size = [], 260
        for kind in ("sphere-round", "sphere-square", "sphere-slit"):
            self.run("phantom", kind, "--size", size, "--count", 3000, "-o", "h.nrrd", "--points", "h.xyz")
            for column, words in {"image": ("--theta", 0), "points": ("--points", "h.xyz", "--rho", 0, "--attraction-range", 0, "--delta", "0.25vx"),
                                  "image and points": ("--points", "h.xyz", "--attraction-range", "5vx")}.items():
                self.run("segment", "h.nrrd", "--init", "sphere:0,0,0,0.95", *words, "-o", "h.vdb", "--mesh", "h.ply")
                shell, hole = shell_errors(self.work / "h.ply", kind, SIDE / size)
                rows.append({"holes": kind[7:], "by": column, "error on the shell": f"{shell:.3f}", "in the holes": f"{hole:.3f}",
                             "result": passed((shell <= 0.2 or column == "points") and (hole <= 0.1 or column == "image"))})
        return rows

    def embryo(self):
        """The paper's two tissues in the embryo phantom, each in a run of its own; overlap with the truth. Passes: a Dice coefficient of at least 0.98."""
        import tifffile
        data, rows = pathlib.Path(os.environ["COVOL_DATA"]) / "phantoms", []
        truth = tifffile.imread(data / "embryo_labels.tif")
        for label, (name, seed) in enumerate({"ve": ("--exterior-seed", "89.6,89.6,28.5"), "exe": ()}.items(), 1):
            for of, words in {"points": ("--points", data / f"embryo_{name}_points.ply", *seed),
                              "contours": ("--contours", data / f"embryo_{name}_contours.csv")}.items():
                self.run("segment", data / "embryo.tif", *words, "--voxel-size", 0.35, "-o", "e.vdb", "--mask", "e.tif")
                inside = tifffile.imread(self.work / "e.tif") > 0
                dice = 2 * (inside & (truth == label)).sum() / (inside.sum() + (truth == label).sum())
                rows.append({"tissue": name.upper(), "marks": of, "Dice": f"{dice:.4f}", "result": passed(dice >= 0.98)})
        return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--update-docs", action="store_true", help="put the tables into docs/verification.md")
    options = parser.parse_args()
    text = [f"Measured {provenance()}.", ""]
    with tempfile.TemporaryDirectory(prefix="covol_verification_") as work:
        made = Verification(pathlib.Path(options.build).resolve(), work)
        for part in (made.orders, made.distances, made.shapes, made.equivariance, made.holes, made.embryo):
            if part == made.embryo and "COVOL_DATA" not in os.environ:
                print("embryo: SKIPPED: COVOL_DATA is not set")
                continue
            text += [f"**{part.__doc__}**", "", markdown(part()), ""]
            print("\n".join(text[-4:]), flush=True)
    failed = sum(line.endswith("| FAIL |") for block in text for line in block.splitlines())
    text[0] += f" {failed} rows fail." if failed else " All rows pass."
    print(text[0])
    if options.update_docs:
        page = HERE.parent / "docs/verification.md"
        begin, end = "<!-- tables: written by tests/verification.py --update-docs -->\n", "<!-- tables: end -->"
        head, rest = page.read_text().split(begin)
        page.write_text(head + begin + "\n".join(["", *text]) + end + rest.split(end)[1])
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
