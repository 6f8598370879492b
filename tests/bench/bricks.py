"""Cost of jobs in bricks: over the image's size, the band's size, the number of bricks, the number of slots.

    /usr/bin/python3 tests/bench/bricks.py --build build [--quick] [--results tests/bench/results]

A ball in noise, marks on it, `covol segment --model paper`; `covol brick plan`, `run` and `join` against the same job in
one piece. Writes bricks_image.csv, bricks_band.csv, bricks_count.csv, bricks_slots.csv and bricks.png. Needs numpy,
matplotlib, and snakemake for the slots.
"""
import argparse
import json
import pathlib
import shutil
import tempfile

import numpy as np

import plots
from bench import Bench, Run, read_results

NOISE, INSIDE, OUTSIDE = 6, 190, 40
MARKS_A_VOXEL = 0.1  # number of marks per square voxel of the surface


def make_ball(folder, size, radius):
    """Image of bytes, written slice by slice, and marks. @return paths"""
    image, marks = folder / f"ball_{size}_{radius}.nrrd", folder / f"ball_{size}_{radius}.xyz"
    if image.exists():
        return image, marks
    center, random = (size - 1) / 2 + 0.3, np.random.default_rng(1)
    x = np.arange(size) - center
    plane = x[:, None] ** 2 + x[None, :] ** 2
    noise = random.normal(0, NOISE, (size, size)).astype(np.float32)
    with open(image, "wb") as file:
        file.write(f"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: {size} {size} {size}\n"
                   "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\nendian: little\n\n".encode())
        for k in range(size):
            inside = np.clip(radius - np.sqrt(plane + x[k] ** 2) + 0.5, 0, 1)
            values = OUTSIDE + (INSIDE - OUTSIDE) * inside + np.roll(noise, 37 * k % size, axis=0)
            file.write(np.clip(values, 0, 255).astype(np.uint8).tobytes())
    points = random.normal(size=(int(MARKS_A_VOXEL * 4 * np.pi * radius**2), 3))
    np.savetxt(marks, center + radius * points / np.linalg.norm(points, axis=1)[:, None], "%.3f")
    return image, marks


def row_of(runs, voxels, **facts):
    """The sum over commands that run one after the other."""
    return facts | {"seconds": sum(run.wall for run in runs), "cpu_seconds": sum(run.cpu for run in runs),
                    "peak_mib": max(run.peak for run in runs) / 2**20, "active_voxels": voxels}


class Jobs(Bench):
    def whole(self, image, marks, **facts):
        run = self.run_covol("segment", image, "--points", marks, "--model", "paper", "-o", self.work / "whole.vdb")
        return row_of([run], run.report["grid"]["active_voxels"], bricks=1, **facts)

    def plan(self, image, marks, brick_voxels):
        """@return run, number of bricks, number of voxels in their band"""
        folder = self.work / "plan"
        shutil.rmtree(folder, ignore_errors=True)
        run = Run([self.covol, "brick", "plan", "segment", image, "--points", marks, "--model", "paper", "--brick-voxels",
                   brick_voxels, "-o", folder, "--quiet"])
        bricks = json.loads((folder / "plan.json").read_text())["bricks"]
        return run, len(bricks), sum(brick["active_voxels"] for brick in bricks)

    def in_bricks(self, image, marks, brick_voxels, **facts):
        planned, count, voxels = self.plan(image, marks, brick_voxels)
        solved = Run([self.covol, "brick", "run", self.work / "plan", "--quiet", "--threads", 2])
        joined = Run([self.covol, "brick", "join", self.work / "plan", "-o", self.work / "joined.vdb", "--quiet"])
        return row_of([planned, solved, joined], voxels, bricks=count, **facts)

    def in_slots(self, slots):
        """Runs bricks that are already planned by Snakemake, with one thread each. The peak is that of one job."""
        folder, joined = self.work / "run", self.work / "by_slots.vdb"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self.work / "plan", folder)
        joined.unlink(missing_ok=True)
        workflow = pathlib.Path(__file__).resolve().parents[2] / "houdini_free_examples/bricks/Snakefile"
        run = Run(["snakemake", "-s", workflow, "-j", slots, "--directory", self.work, "--config", "plan=run", f"out={joined.name}",
                   f"covol={self.covol}", "threads=1"])
        run.peak = max(json.loads(path.read_text()).get("peak_rss_bytes", 0) for path in folder.glob("sweep-*/*.json"))
        return run


def measure(jobs):
    unit = 1 if jobs.quick else 2
    images = [jobs.whole(*make_ball(jobs.work, size, 50 * unit), image_size=size) for size in (128 * unit, 256 * unit, 512 * unit)]
    jobs.write("bricks_image", images)

    bands = []
    for radius in (25 * unit, 50 * unit, 100 * unit):
        ball = make_ball(jobs.work, 256 * unit, radius)
        planned_voxels = jobs.plan(*ball, 10**9)[2]
        bands += [jobs.whole(*ball, radius=radius), jobs.in_bricks(*ball, planned_voxels // 6, radius=radius)]
    jobs.write("bricks_band", bands)

    ball = make_ball(jobs.work, 256 * unit, 100 * unit)
    _, _, voxels = jobs.plan(*ball, 10**9)
    jobs.write("bricks_count", [jobs.whole(*ball)] + [jobs.in_bricks(*ball, voxels // parts) for parts in (2, 4, 8, 16, 32)])

    _, count, voxels = jobs.plan(*ball, voxels // 12)
    jobs.write("bricks_slots", [{"slots": slots} | row_of([jobs.in_slots(slots)], voxels, bricks=count) for slots in (1, 2)])


def draw(results):
    panels = {"bricks_image": ("image_size", "voxels of the image's side"), "bricks_band": ("active_voxels", "voxels of the band"),
              "bricks_count": ("bricks", "bricks"), "bricks_slots": ("slots", "slots of a thread each")}
    plt = plots.plt
    figure, all_axes = plt.subplots(1, len(panels), figsize=(4 * len(panels), 3.4))
    for axes, (part, (column, label)) in zip(all_axes, panels.items()):
        machine, rows = read_results(results, part)
        memory = axes.twinx()
        groups = [("", "-", rows)]
        if part == "bricks_band":
            groups = [("in one piece, ", "-", [r for r in rows if r["bricks"] == "1"]), ("in bricks, ", ":", [r for r in rows if r["bricks"] != "1"])]
        for name, style, group in groups:
            x = plots.numbers(group, column)
            seconds = "seconds" if part == "bricks_slots" else "cpu_seconds"
            axes.plot(x, plots.numbers(group, seconds), "o" + style, color=plots.OURS, label=name + seconds.replace("_", " "))
            memory.plot(x, plots.numbers(group, "peak_mib"), "s" + style, color=plots.MEMORY, label=name + "peak MiB")
        axes.set_xscale("log", base=2)
        for side in (axes, memory):
            side.set_ylim(0, 1.4 * max(max(line.get_ydata()) for line in side.get_lines()))
            side.tick_params(labelsize=7)
        lines = axes.get_lines() + memory.get_lines()
        axes.legend(lines, [line.get_label() for line in lines], fontsize=7, loc="upper left")
        axes.set_xlabel(label, fontsize=8)
    figure.suptitle(machine, fontsize=8)
    figure.tight_layout()
    figure.savefig(results / "bricks.png", dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--results", default=str(pathlib.Path(__file__).resolve().parent / "results"))
    parser.add_argument("--quick", action="store_true", help="half the size")
    parser.add_argument("--plot", action="store_true", help="draw what is in the results, measure nothing")
    options = parser.parse_args()
    if not options.plot:
        with tempfile.TemporaryDirectory(prefix="covol_bench_") as work:
            options.work = work
            measure(Jobs(options))
    draw(pathlib.Path(options.results))


if __name__ == "__main__":
    main()
