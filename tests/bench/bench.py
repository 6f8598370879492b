"""Runs covol's benchmarks; tests/bench/run.sh builds what it needs and calls it. Standard library, numpy, matplotlib.

Programs that are compared run in turns (A B A B), the best of the repetitions counts, and CPU time (user and system, all threads)
is given beside the wall clock time, so that a busy machine does not affect the comparison. Each part writes results/PART.csv;
table.md and speed.png are made from all existing .csv files.
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np

import plots
from quality import shell_errors
from tables import markdown, provenance

HERE = pathlib.Path(__file__).resolve().parent
START_RADIUS = 0.95
THREADS = (1, 2)


# ---- running programs --------------------------------------------------------------------------------------------

class Run:
    """A finished process: wall and cpu seconds, peak bytes, stdout."""

    def __init__(self, command, **environment):
        print("  " + " ".join(map(str, command)), flush=True)
        begin = time.perf_counter()
        with tempfile.TemporaryFile() as out:
            child = subprocess.Popen([str(c) for c in command], stdout=out, stderr=subprocess.DEVNULL,
                                     env=os.environ | environment)
            self.peak = 0
            watcher = threading.Thread(target=self._watch_memory, args=(child.pid,))
            watcher.start()
            _, status, usage = os.wait4(child.pid, 0)
            watcher.join()
            child.returncode = os.waitstatus_to_exitcode(status)
            self.wall = time.perf_counter() - begin
            out.seek(0)
            self.stdout = out.read().decode()
        if child.returncode != 0:
            raise RuntimeError(f"exit code {child.returncode}: {' '.join(map(str, command))}")
        self.cpu = usage.ru_utime + usage.ru_stime

    def _watch_memory(self, pid):
        """The kernel's high-water mark. Not ru_maxrss, which starts from the size of this process."""
        try:
            while True:
                status = pathlib.Path(f"/proc/{pid}/status").read_text()
                if "VmHWM:" not in status:
                    return  # the process has ended
                if os.readlink(f"/proc/{pid}/exe") != os.readlink("/proc/self/exe"):
                    self.peak = int(status.split("VmHWM:")[1].split()[0]) * 1024
                time.sleep(0.01)
        except (OSError, IndexError):
            return

    def json(self):
        return json.loads(self.stdout)


def best(runs):
    return min(runs, key=lambda run: run.wall)


class Bench:
    def __init__(self, options):
        self.quick = options.quick
        build = pathlib.Path(options.build).resolve()
        self.covol = build / "bin" / "covol"
        self.programs = build / "tests" / "bench"
        self.results = pathlib.Path(options.results)
        self.work = pathlib.Path(options.work)
        self.results.mkdir(parents=True, exist_ok=True)

    def write(self, part, rows):
        columns = list(dict.fromkeys(key for row in rows for key in row))
        with open(self.results / f"{part}.csv", "w", newline="") as file:
            file.write(f"# {provenance()}{' (--quick: a test of the machinery, no result)' if self.quick else ''}\n")
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows({k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)

    def run_covol(self, *arguments, threads=2):
        report = self.work / "report.json"
        run = Run([self.covol, *arguments, "--threads", threads, "--quiet", "--json", report])
        run.report = json.loads(report.read_text())
        return run

    def phantom(self, kind, size, count=3000):
        """Image and points, made once."""
        image, points = self.work / f"{kind}_{size}_{count}.nrrd", self.work / f"{kind}_{size}_{count}.xyz"
        if not image.exists():
            Run([self.covol, "phantom", kind, "--size", size, "--count", count, "-o", image, "--points", points, "--quiet"])
        return image, points


# ---- parts -------------------------------------------------------------------------------------------------------

def google_benchmark(bench, pattern, repetitions, min_time, **environment):
    """Best repetition of each benchmark, by name."""
    out = bench.work / "benchmark.json"
    Run([bench.programs / "bench_stages", f"--benchmark_filter={pattern}", f"--benchmark_repetitions={repetitions}",
         f"--benchmark_min_time={min_time}", "--benchmark_enable_random_interleaving=true",
         f"--benchmark_out={out}", "--benchmark_out_format=json"], **environment)
    runs = {}
    for run in json.loads(out.read_text())["benchmarks"]:
        if run["run_type"] == "iteration":
            name = run["run_name"].split("/iterations")[0].split("/process_time")[0]
            if name not in runs or run["real_time"] < runs[name]["real_time"]:
                runs[name] = run
    return runs


def benchmark_row(run, bandwidth, threads):
    cpu = run.get("cpu_per_voxel", run["per_voxel"] * run["cpu_time"] / run["real_time"])
    row = {"ns_per_voxel": 1e9 * run["per_voxel"], "cpu_ns_per_voxel": 1e9 * cpu}
    if "bytes_per_voxel" in run:
        row["bytes_per_voxel"] = run["bytes_per_voxel"]
        row["fraction_of_bandwidth"] = run["bytes_per_second"] / bandwidth[threads]
    return row


def measure_bandwidth(runs):
    return {threads: runs[f"stream/triad/{threads}"]["bytes_per_second"] for threads in THREADS}


def part_kernels(bench):
    """scheme kernels on every instruction set, in cache and out of it"""
    runs = google_benchmark(bench, "kernel/|stream/", 2 if bench.quick else 5, 0.02 if bench.quick else 0.05)
    bandwidth = measure_bandwidth(runs)
    rows = [{"kernel": "stream triad", "set": "", "where": "memory", "threads": threads,
             "ns_per_voxel": 12e9 / bandwidth[threads], "bytes_per_voxel": 12, "fraction_of_bandwidth": 1.0,
             "gigabytes_per_second": 1e-9 * bandwidth[threads]} for threads in THREADS]
    for name, run in runs.items():
        if not name.startswith("kernel/"):
            continue
        _, kernel, simd, where, threads = name.split("/")
        row = benchmark_row(run, bandwidth, int(threads))
        if where == "cache":
            row.pop("fraction_of_bandwidth")
        rows.append({"kernel": kernel, "set": simd, "where": where, "threads": int(threads)} | row)
    rows[len(THREADS):] = sorted(rows[len(THREADS):], key=lambda r: (r["kernel"], r["where"], r["threads"], r["set"]))
    bench.write("kernels", rows)


def part_stages(bench):
    """one time step on 7 million voxels (each instruction set), and every other stage, per active voxel"""
    repetitions = 1 if bench.quick else 3
    rows = []
    flags = pathlib.Path("/proc/cpuinfo").read_text()
    known = {"baseline": "", "avx2": "avx2", "avx512": "avx512f"}
    for simd in [name for name, flag in known.items() if flag in flags] + [""]:
        pattern = "stage/time_step|stream/" if simd else "stage/[^t]|stage/tag|stream/"
        # The stage time_step is not repeated here (simd not empty), because it takes the fastest of several runs
        # itself.
        runs = google_benchmark(bench, pattern, 1 if simd else repetitions, 0.05, **({"COVOL_SIMD": simd} if simd else {}))
        bandwidth = measure_bandwidth(runs)
        for name in sorted((n for n in runs if n.startswith("stage/")), key=lambda n: (n.split("/")[1], n)):
            _, stage, threads = name.split("/")[:3]
            run, threads = runs[name], int(threads)
            row = {"stage": stage, "set": simd or "best", "threads": threads} | benchmark_row(run, bandwidth, threads)
            if threads > 1:
                row["speedup"] = runs[f"stage/{stage}/1"]["per_voxel"] / run["per_voxel"]
            for key in ("visits", "leaf_fill", "ns_assembly", "ns_sweeps"):
                if key in run:
                    row[key] = run[key]
            rows.append(row)
    bench.write("stages", rows)


SPHERE_OPTIONS = ("--init", f"sphere:0,0,0,{START_RADIUS}", "--attraction-range", "5vx")


def sphere_job(bench, image, points, *extra, threads):
    out = bench.work / "sphere.vdb"
    run = bench.run_covol("segment", image, "--points", points, "-o", out, "--mesh", out.with_suffix(".ply"),
                          *SPHERE_OPTIONS, *extra, threads=threads)
    run.mesh = out.with_suffix(".ply")
    return run


def part_sphere(bench):
    """the sphere with six holes, files to files: covol, the dense solver, ITK"""
    kind, size = "sphere-round", 100 if bench.quick else 260
    image, points = bench.phantom(kind, size)
    voxel = 2.6 / size
    single_level = ("--tau", "1vx", "--coarse-levels", "0")
    kinds = [("covol", "1vx", (), threads) for threads in THREADS]
    kinds += [("covol, delta 0.2 voxel", "0.2vx", (), threads) for threads in THREADS]
    kinds += [("covol, one level, tau = h", "1vx", single_level, 1), ("covol, image alone", "1vx", ("--theta", "0"), 2)]
    runs = {(name, threads): [] for name, _, _, threads in kinds}
    errors = {}

    def covol_round(chosen):
        for name, delta, extra, threads in chosen:
            run = sphere_job(bench, image, points, "--delta", delta, *extra, threads=threads)
            runs[name, threads].append(run)
            errors[name] = shell_errors(run.mesh, kind, voxel)

    covol_round(kinds)
    # The constant K of the edge detector that covol computed. The other programs use the same value.
    k = runs["covol, one level, tau = h", 1][0].report["edge"]["edge_k"]
    common = ("--image", image, "--radius", START_RADIUS, "--edge-k", k)

    # The dense solver runs until it is steady in one octant only. In the whole cube it makes 3 steps, which measure the
    # time per step.
    dense = [bench.programs / "bench_dense", *common, "--points", points]
    octant_mesh = bench.work / "octant.ply"
    octant = Run([*dense, "--octant", 1, "--mesh", octant_mesh, "--max-steps", 20 if bench.quick else 500]).json()
    covol_round(kinds[:len(THREADS)])
    whole = Run([*dense, "--steps", 3])
    covol_round(kinds[:len(THREADS)])

    itk = [bench.programs / "bench_itk", *common, "--propagation", ITK["propagation"], "--curvature", ITK["curvature"],
           "--advection", ITK["advection"]]
    itk_mesh, iterations, few = bench.work / "itk.ply", 100 if bench.quick else 800, 50 if bench.quick else 100
    itk_one = Run([*itk, "--iterations", iterations, "--threads", 1, "--mesh", itk_mesh])
    itk_few = {threads: Run([*itk, "--iterations", few, "--threads", threads]).json() for threads in THREADS}

    rows = []
    for name, _, _, threads in kinds:
        run = best(runs[name, threads])
        solve = run.report["solve"]
        rows.append({"solver": name, "threads": threads, "seconds": run.wall, "cpu_seconds": run.cpu,
                     "seconds_solve": run.report["seconds"]["solve"], "steps": solve["steps"], "steady": solve["stop_reason"],
                     "extrapolated": "no", "peak_mib": run.peak / 2**20, "error_shell": errors[name][0],
                     "error_holes": errors[name][1], "active_voxels": run.report["grid"]["active_voxels"]})
    dense_run = whole.json()
    per_step, cpu_per_step = dense_run["seconds_solve"] / 3, dense_run["cpu_solve"] / 3
    dense_errors = shell_errors(octant_mesh, kind, voxel, octant=True)
    stopped = "steady" if octant["steady"] else "max_steps"
    rows.append({"solver": "dense, one octant (an eighth of the voxels)", "threads": 1, "seconds": octant["seconds_solve"],
                 "cpu_seconds": octant["cpu_solve"], "seconds_solve": octant["seconds_solve"], "steps": octant["steps"],
                 "steady": stopped, "extrapolated": "no", "error_shell": dense_errors[0], "error_holes": dense_errors[1],
                 "active_voxels": octant["voxels"]})
    rows.append({"solver": "dense, to its own end", "threads": 1, "seconds": per_step * octant["steps"],
                 "cpu_seconds": cpu_per_step * octant["steps"], "seconds_solve": per_step * octant["steps"],
                 "steps": octant["steps"], "steady": stopped, "extrapolated": "from 3 steps",
                 "peak_mib": whole.peak / 2**20, "error_shell": dense_errors[0], "error_holes": dense_errors[1],
                 "active_voxels": dense_run["voxels"]})
    ours = best(runs["covol, one level, tau = h", 1]).report["solve"]["steps"]
    rows.append({"solver": "dense, covol's steps on one level", "threads": 1, "seconds": per_step * ours,
                 "cpu_seconds": cpu_per_step * ours, "seconds_solve": per_step * ours, "steps": ours,
                 "extrapolated": "from 3 steps", "peak_mib": whole.peak / 2**20,
                 "active_voxels": dense_run["voxels"]})
    itk_errors = shell_errors(itk_mesh, kind, voxel)
    result = itk_one.json()
    rows.append({"solver": "ITK", "threads": 1, "seconds": result["seconds_without_mesh"],
                 "cpu_seconds": itk_one.cpu * result["seconds_without_mesh"] / itk_one.wall,
                 "seconds_solve": result["seconds_solve"], "steps": result["steps"], "extrapolated": "no",
                 "peak_mib": itk_one.peak / 2**20, "error_shell": itk_errors[0], "error_holes": itk_errors[1]})
    faster = itk_few[2]["seconds_solve"] / itk_few[1]["seconds_solve"]
    rows.append(rows[-1] | {"threads": 2, "seconds": result["seconds_without_mesh"] * faster,
                            "cpu_seconds": rows[-1]["cpu_seconds"] * itk_few[2]["cpu_solve"] / itk_few[1]["cpu_solve"],
                            "seconds_solve": result["seconds_solve"] * faster, "extrapolated": f"from {few} iterations"})
    reference = {threads: next(r["seconds"] for r in rows if r["solver"] == "covol" and r["threads"] == threads)
                 for threads in THREADS}
    for row in rows:
        row["times_covol"] = row["seconds"] / reference[row["threads"]]
    bench.write("sphere", [{"image": f"{size}^3"} | row for row in rows])


# Weights of ITK's filter: of all that were tried on the sphere phantom with 260^3 voxels, those with the smallest error
# of the surface between the holes (shell_errors()).
ITK = {"propagation": -0.03, "curvature": 1, "advection": 1}


def part_curvature(bench):
    """mean curvature of a sphere per voxel and step: covol against OpenVDB's LevelSetFilter"""
    rows = []
    for threads in THREADS:
        steps, repetitions = (6, 1) if bench.quick else (12, 3)
        result = Run([bench.programs / "bench_curvature", "--threads", threads, "--steps", steps,
                      "--repetitions", repetitions]).json()
        for solver in ("covol", "openvdb"):
            rows.append({"solver": solver, "threads": threads} | result[solver] |
                        {"times_covol": result[solver]["ns_per_voxel_step"] / result["covol"]["ns_per_voxel_step"],
                         "times_covol_same_motion": result[solver]["seconds_per_unit"] / result["covol"]["seconds_per_unit"]})
    bench.write("curvature", rows)


def part_growth_h(bench):
    """time and memory over h: points on a torus, h to h/8, as many points for each voxel of the surface"""
    size, count = (48, 2700) if bench.quick else (128, 20000)
    rows = []
    for level in range(4):
        _, points = bench.phantom("torus", 16, count * 4**level)
        h = 2.6 / (size * 2**level)
        runs = [bench.run_covol("reconstruct", points, "-o", bench.work / "torus.vdb", "--voxel-size", h)
                for _ in range(3 if level < 3 and not bench.quick else 1)]
        run = best(runs)
        rows.append({"voxels_across": size * 2**level, "voxel_size": h, "points": count * 4**level, "seconds": run.wall,
                     "cpu_seconds": run.cpu, "seconds_solve": run.report["seconds"]["solve"],
                     "steps": run.report["solve"]["steps"], "peak_mib": run.peak / 2**20,
                     "active_voxels": run.report["grid"]["active_voxels"]})
    for row in rows:
        row["times_first"] = row["seconds"] / rows[0]["seconds"]
        row["voxels_times_first"] = row["active_voxels"] / rows[0]["active_voxels"]
        row["dense_times_first"] = (row["voxels_across"] / size) ** 3
    bench.write("growth_h", rows)


def write_nrrd(path, values, spacing, origin):
    header = (f"NRRD0005\ntype: uint8\ndimension: 3\nspace dimension: 3\nsizes: {' '.join(map(str, values.shape[::-1]))}\n"
              f"space directions: ({spacing},0,0) (0,{spacing},0) (0,0,{spacing})\n"
              f"space origin: ({origin},{origin},{origin})\nendian: little\nencoding: raw\n\n")
    path.write_bytes(header.encode() + values.tobytes())


def torus_image(size):
    """The torus of covol phantom, with values from 0 to 255."""
    h = 2.6 / size
    x = h * (np.arange(size) + 0.5) - 1.3
    k, j, i = np.meshgrid(x, x, x, indexing="ij")
    distance = np.hypot(np.hypot(i, j) - 0.75, k) - 0.3
    return np.round(255 * np.clip(0.5 - distance / h, 0, 1)).astype(np.uint8)


def part_growth_image(bench):
    """time and memory over the size of the image around one structure (the rest of the image: more of the same)"""
    size = 64 if bench.quick else 128
    _, points = bench.phantom("torus", 16, 4000 if bench.quick else 12000)
    rows = []
    images = []
    for tiles in (1, 2, 4):
        image = bench.work / f"tiles_{tiles}.nrrd"
        write_nrrd(image, np.tile(torus_image(size), (tiles, tiles, tiles)), 2.6 / size, 1.3 / size - 1.3)
        images.append((tiles, image))
    runs = {tiles: [] for tiles, _ in images}
    for _ in range(1 if bench.quick else 3):
        for tiles, image in images:
            runs[tiles].append(bench.run_covol("segment", image, "--points", points, "-o", bench.work / "tile.vdb"))
    for tiles, image in images:
        run = best(runs[tiles])
        seconds = run.report["seconds"]
        rows.append({"image_size": size * tiles, "seconds": run.wall, "cpu_seconds": run.cpu,
                     "seconds_read": seconds["read"], "seconds_without_read": run.wall - seconds["read"],
                     "peak_mib": run.peak / 2**20, "image_mib": (size * tiles) ** 3 / 2**20,
                     "peak_without_image_mib": run.peak / 2**20 - (size * tiles) ** 3 / 2**20,
                     "active_voxels": run.report["grid"]["active_voxels"]})
        image.unlink()
    bench.write("growth_image", rows)


def part_embryo(bench):
    """the VE tissue of the embryo phantom, files to files (needs COVOL_DATA)"""
    if "COVOL_DATA" not in os.environ:
        print("  SKIPPED: COVOL_DATA is not set")
        return
    data = pathlib.Path(os.environ["COVOL_DATA"]) / "phantoms"
    image, points, surface, mask = data / "embryo.tif", data / "embryo_ve_points.ply", bench.work / "embryo.vdb", bench.work / "embryo_mask.tif"
    options = ("--exterior-seed", "89.6,89.6,28.5", "--voxel-size", "0.35", "-o", surface)
    jobs = {"points alone": ("reconstruct", points, *options), "image and points": ("segment", image, "--points", points, *options)}
    runs = {(job, threads): [] for job in jobs for threads in THREADS}
    dices = {}
    import tifffile
    truth = tifffile.imread(data / "embryo_labels.tif") == 1
    for _ in range(1 if bench.quick else 3):
        for (job, threads), done in runs.items():
            done.append(bench.run_covol(*jobs[job], threads=threads))
            if job not in dices:
                Run([bench.covol, "mask", surface, "--like", image, "-o", mask, "--quiet"])
                inside = tifffile.imread(mask) > 0
                dices[job] = 2 * float((inside & truth).sum()) / float(inside.sum() + truth.sum())
    idle = Run([bench.covol, "--help"]).peak
    rows = []
    for (job, threads), done in runs.items():
        run = best(done)
        voxels = run.report["grid"]["active_voxels"]
        # Peak memory in bytes, without the program's libraries (`idle`) and the image, which has one byte per voxel.
        held = run.peak - idle - (truth.size if image in jobs[job] else 0)
        rows.append({"job": job, "threads": threads, "seconds": run.wall, "cpu_seconds": run.cpu, "dice": dices[job],
                     "active_voxels": voxels, "peak_mib": run.peak / 2**20,
                     "bytes_per_active_voxel_without_image_and_libraries": held / voxels} |
                    {f"seconds_{stage}": value for stage, value in run.report["seconds"].items()
                     if stage != "total" and isinstance(value, float)})
    bench.write("embryo", rows)


PARTS = {"kernels": part_kernels, "stages": part_stages, "sphere": part_sphere, "curvature": part_curvature,
         "growth_h": part_growth_h, "growth_image": part_growth_image, "embryo": part_embryo}


# ---- tables ------------------------------------------------------------------------------------------------------

TITLES = {
    "sphere": "The sphere with six holes, files to files",
    "curvature": "Mean curvature flow of a sphere with a radius of 100 voxels",
    "embryo": "VE tissue of the embryo phantom (512 x 512 x 58), files to files",
    "growth_h": "Cost over h: points on a torus, files to files, 2 threads",
    "growth_image": "Cost over the size of the image around one structure, 2 threads",
    "stages": "Stages, per active voxel",
    "kernels": "Kernels, per voxel",
}


def read_results(folder, part):
    """(provenance, rows) or None"""
    path = folder / f"{part}.csv"
    if not path.exists():
        return None
    with open(path, newline="") as file:
        return file.readline().lstrip("# ").strip(), list(csv.DictReader(file))


def write_tables(results):
    text = ["# Measured by tests/bench/run.sh", ""]
    for part, title in TITLES.items():
        found = read_results(results, part)
        if found:
            text += [f"## {title}", "", found[0], "", markdown(found[1]), ""]
    (results / "table.md").write_text("\n".join(text))


def summary(results):
    """The tables of docs/benchmarks_speed.md."""
    blocks = []
    if found := read_results(results, "sphere"):
        machine, rows = found
        columns = {"solver": "solver", "threads": "threads", "seconds": "seconds", "times_covol": "times covol",
                   "cpu_seconds": "CPU seconds", "peak_mib": "peak MiB", "error_shell": "error on the shell, voxels",
                   "error_holes": "error in the holes, voxels", "extrapolated": "extrapolated"}
        shown = [r for r in rows if "octant" not in r["solver"]]
        blocks += [f"Sphere with six holes at 260^3, files to files ({machine}):", "",
                   markdown([{new: r[old] for old, new in columns.items()} for r in shown]), ""]
    if found := read_results(results, "stages"):
        machine, rows = found
        steps = [r for r in rows if r["stage"] == "time_step"]
        columns = {"set": "instruction set", "threads": "threads", "ns_per_voxel": "ns per active voxel",
                   "cpu_ns_per_voxel": "CPU ns", "speedup": "speedup", "fraction_of_bandwidth": "fraction of bandwidth"}
        blocks += [f"One time step at delta/h = 5, tau = h, solved to 1e-3, 7 million active voxels ({machine}):", "",
                   markdown([{new: r[old] for old, new in columns.items()} for r in steps]), ""]
    if found := read_results(results, "curvature"):
        machine, rows = found
        columns = {"solver": "solver", "threads": "threads", "ns_per_voxel_step": "ns per active voxel and step",
                   "times_covol": "times covol", "times_covol_same_motion": "times covol for the same motion",
                   "radius_error": "error of the radius, voxels", "radius_moved": "of a way of, voxels"}
        blocks += [f"Mean curvature of a sphere, OpenVDB's LevelSetFilter and covol ({machine}):", "",
                   markdown([{new: r[old] for old, new in columns.items()} for r in rows]), ""]
    return "\n".join(blocks)


def update_docs(results):
    page = HERE.parent.parent / "docs/benchmarks_speed.md"
    begin, end = "<!-- bench: written by tests/bench/run.sh --update-docs -->\n", "<!-- bench: end -->"
    text = page.read_text()
    head, rest = text.split(begin)
    _, tail = rest.split(end)
    page.write_text(head + begin + summary(results) + end + tail)


def main():
    parser = argparse.ArgumentParser(prog="tests/bench/run.sh", formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="parts:\n" + "\n".join(f"  {n:14}{p.__doc__}" for n, p in PARTS.items()))
    parser.add_argument("--build", default="build-bench", help="the build folder (preset bench)")
    parser.add_argument("--results", help="where tables and plot go [tests/bench/results; quick: build folder/quick]")
    parser.add_argument("--only", default=",".join(PARTS), help="parts to run, separated by commas; '' makes tables and plot again")
    parser.add_argument("--quick", action="store_true", help="small sizes, one repetition")
    parser.add_argument("--update-docs", action="store_true", help="put the main tables into docs/benchmarks_speed.md")
    options = parser.parse_args()
    if options.results is None:
        options.results = pathlib.Path(options.build) / "quick" if options.quick else HERE / "results"
    provenance()  # first call: records the load of the machine before the measurements
    chosen = [part for part in options.only.split(",") if part]
    for part in chosen:
        if part not in PARTS:
            parser.error(f"--only: expected some of {', '.join(PARTS)}, got {part}")
    failed = []
    with tempfile.TemporaryDirectory(prefix="covol_bench_") as work:
        options.work = work
        bench = Bench(options)
        for part in chosen:
            begin = time.perf_counter()
            print(f"{part}: {PARTS[part].__doc__}", flush=True)
            try:
                PARTS[part](bench)
            except (RuntimeError, OSError, KeyError, ValueError) as error:  # a part that fails does not end the others
                failed.append(part)
                print(f"{part}: FAILED: {type(error).__name__}: {error}", flush=True)
            print(f"{part}: {time.perf_counter() - begin:.0f} s", flush=True)
    results = pathlib.Path(options.results)
    write_tables(results)
    plots.draw(results / "speed.png", {part: read_results(results, part) for part in TITLES})
    if options.update_docs:
        update_docs(results)
    print(f"wrote {results}/table.md and {results}/speed.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
