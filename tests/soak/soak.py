"""Many jobs: in one process without growth of memory, eight at once, five kinds killed at random times while they replace old
outputs, and random ones that are killed or interrupted.

    COVOL=build/bin/covol PYTHONPATH=build/python /usr/bin/python3 tests/soak/soak.py [--jobs 2000] [--kills 100]
        [--minutes 20] [--seed 1] [--only one_process|eight_at_once|old_or_new|random_kills]

Prints a line for each part, and ends with exit code 1 if anything went wrong. Needs numpy, and for the first part the Python
module (otherwise that part is left out, with a message).
"""
import argparse
import gc
import hashlib
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time
import warnings

COVOL = os.environ.get("COVOL", "build/bin/covol")
ALLOWED = {0, 3, 130}  # accepted exit codes: success, input refused, interrupted
LOADING = 0.4          # seconds that the program may take to load its libraries on a busy machine
# Bytes by which memory may grow over all jobs after the first tenth, in which thread pools are created.
GROWTH = 24 << 20


def resident():
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def one_process(jobs, seed):
    try:
        import covol
    except ImportError:
        return "the Python module is not on the path: left out", []
    warnings.simplefilter("ignore")
    generator = random.Random(seed)
    image, points, _ = covol.phantom("sphere", 32, 400)
    held = []
    for n in range(jobs):
        try:
            if n % 3 == 0:
                covol.reconstruct(points, voxel_size=0.15 + 0.05 * generator.random())
            elif n % 3 == 1:
                covol.segment(image, points, init="tag", max_steps=5)
            else:
                covol.segment(image, points[:3 if n % 2 else 200])
        except covol.Error:
            pass  # jobs with refused marks must not leak memory either
        if n % max(1, jobs // 20) == 0:
            gc.collect()
            held.append(resident())
    begin, end = held[len(held) // 10 + 1], held[-1]
    shown = ", ".join(str(bytes >> 20) for bytes in held)
    return f"{jobs} jobs in one process, MiB held along the way: {shown}", [] if end - begin < GROWTH else ["GREW"]


class Folder:
    """A few inputs, and random jobs that use them."""

    def __init__(self, folder, seed):
        self.path, self.generator = pathlib.Path(folder), random.Random(seed)
        for shape in ("sphere", "torus"):
            self.run("phantom", shape, "--size", "48", "--count", "3000", "-o", f"{shape}.nrrd", "--points", f"{shape}.xyz").wait()
        self.run("segment", "sphere.nrrd", "--points", "sphere.xyz", "-o", "start.vdb", "--mesh", "start.ply").wait()

    def run(self, *words):
        with open(self.path / "errors.txt", "ab") as errors:
            return subprocess.Popen([str(pathlib.Path(COVOL).resolve()), *map(str, words), "--quiet"], cwd=self.path, stdout=subprocess.DEVNULL,
                                    stderr=errors)

    def job(self, n):
        """@return arguments, outputs"""
        r, shape = self.generator, self.generator.choice(("sphere", "torus"))
        out = f"o{n}"
        marks = ["--points", f"{shape}.xyz"]
        kinds = [
            (["segment", f"{shape}.nrrd", *marks, "-o", f"{out}.vdb", "--mesh", f"{out}.ply", "--mask", f"{out}.nrrd", "--json",
              f"{out}.json", "--report", f"{out}.html"], [".vdb", ".ply", ".nrrd", ".json", ".html"]),
            (["segment", f"{shape}.nrrd", *marks, "--init", "tag", "--tolerance", "0", "--max-steps", r.randint(1, 60), "-o",
              f"{out}.vdb", "--mask", f"{out}.tif"], [".vdb", ".tif"]),
            (["reconstruct", f"{shape}.xyz", "-o", f"{out}.vdb", "--mesh", f"{out}.stl"], [".vdb", ".stl"]),
            (["mesh", "start.vdb", "-o", f"{out}.ply", "--target-edge", "2vx"], [".ply"]),
            (["render", "start.vdb", "-o", f"{out}.png", "--size", "400x300"], [".png"]),
            (["convert", f"{shape}.nrrd", f"{out}.vdb"], [".vdb"]),
            (["segment", f"{shape}.nrrd", "--init", "sphere:0,0,0,0.4", "-o", f"{out}.vdb", "--mesh", f"{out}.obj"], [".vdb", ".obj"]),
            (["compare", "start.vdb", "start.ply", "--json", f"{out}.json"], [".json"]),
        ]
        words, endings = r.choice(kinds)
        return words, [f"{out}{ending}" for ending in endings]

    def problems(self, code, words, outputs):
        """Problems after a job that has ended."""
        there = [name for name in outputs if (self.path / name).exists()]
        if code not in ALLOWED | {-signal.SIGKILL}:
            return [f"exit code {code}: covol {' '.join(map(str, words))}"]
        if code == 0 and there != outputs:
            return [f"done without {set(outputs) - set(there)}: {words}"]
        if code in (3, 130) and there:
            return [f"exit code {code} left {there}: {words}"]
        return []

    def sweep(self, outputs):
        for name in outputs:
            (self.path / name).unlink(missing_ok=True)


def eight_at_once(seed):
    with tempfile.TemporaryDirectory(prefix="covol_soak_") as path:
        folder, wrong = Folder(path, seed), []
        for batch in range(4):
            jobs = [folder.job(8 * batch + n) for n in range(8)]
            runs = [folder.run(*words, "--threads", "2") for words, _ in jobs]
            for run, (words, outputs) in zip(runs, jobs):
                wrong += folder.problems(run.wait(), words, outputs)
                if run.returncode not in (0, 3):
                    wrong.append(f"exit code {run.returncode} of eight at once: {words}")
        return f"32 jobs, eight at once: {len(wrong)} went wrong", wrong


class Kind:
    """One kind of job, with two choices of options that replace each other's outputs by different ones."""

    def __init__(self, folder, words, choices, outputs):
        self.folder, self.words, self.choices, self.outputs = folder, words, choices, outputs
        self.sets, self.seconds = [], 0.0
        for choice in (0, 1):
            begin = time.monotonic()
            code = self.start(choice).wait()
            assert code == 0, f"exit code {code}: {words}"
            self.seconds = max(self.seconds, time.monotonic() - begin)
            self.sets.append(self.state())
        assert all(self.sets[0][name] != self.sets[1][name] for name in outputs), self.sets

    def start(self, choice):
        return self.folder.run(*self.words, *self.choices[choice])

    def state(self):
        """A digest of each output, including folders; of a report only the surface, because a report contains times."""
        def digest(path):
            if path.suffix == ".json" and path.parent == self.folder.path:
                return json.dumps(json.loads(path.read_bytes())["surface"], sort_keys=True)
            return hashlib.sha256(path.read_bytes()).hexdigest()
        found = {}
        for name in self.outputs:
            path = self.folder.path / name
            files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path] if path.exists() else []
            found[name] = [(str(file.relative_to(self.folder.path)), digest(file)) for file in files]
        return found


def old_or_new(kills, seed):
    """Each job is killed at a random time within its duration, and then starts again over what it left."""
    with tempfile.TemporaryDirectory(prefix="covol_soak_") as path:
        folder, wrong, lines = Folder(path, seed), [], []
        for words, choices, outputs in (
            (["segment", "sphere.nrrd", "--points", "sphere.xyz", "--init", "tag", "--max-steps", "4", "-o", "s.vdb", "--mesh", "s.ply",
              "--mask", "s.ome.zarr", "--json", "s.json"], (["--delta", "1vx"], ["--delta", "3vx"]), ["s.vdb", "s.ply", "s.ome.zarr", "s.json"]),
            (["reconstruct", "torus.xyz", "-o", "r.vdb", "--mesh", "r.stl", "--json", "r.json"],
             (["--voxel-size", "0.04"], ["--voxel-size", "0.05"]), ["r.vdb", "r.stl", "r.json"]),
            (["mesh", "start.vdb", "-o", "m.ply"], (["--target-edge", "2vx"], ["--target-edge", "3vx"]), ["m.ply"]),
            (["convert"], (["sphere.nrrd", "c.vdb"], ["torus.nrrd", "c.vdb"]), ["c.vdb"]),
            (["render", "start.vdb", "-o", "p.png"], (["--size", "1600x1200"], ["--size", "1200x1600"]), ["p.png"]),
        ):
            kind = Kind(folder, words, choices, outputs)
            last, killed, new = 1, 0, 0
            while killed < kills:
                run = kind.start(1 - last)
                time.sleep(folder.generator.uniform(0, kind.seconds))
                run.kill()
                code = run.wait()
                # This run removes the temporary files of the killed one.
                folder.run("phantom", "sphere", "--size", "16", "-o", "next.nrrd").wait()
                hidden = [entry.name for entry in folder.path.iterdir() if entry.name.startswith(".covol")]
                state = kind.state()
                if hidden or state not in kind.sets:
                    wrong.append(f"{words[0]}, kill {killed}: left {hidden}, {state}")
                    kind.start(last).wait()  # writes the previous set of outputs again
                    state = kind.state()
                killed += code != 0
                new += state == kind.sets[1 - last] and code != 0
                last = kind.sets.index(state)
            lines.append(f"{words[0]}: {killed} kills within {kind.seconds:.2f} s, {new} of them with the new outputs in place")
        return "\n".join(lines), wrong


def random_kills(minutes, seed):
    with tempfile.TemporaryDirectory(prefix="covol_soak_") as path:
        folder, wrong, ended = Folder(path, seed), [], {}
        deadline, n = time.monotonic() + 60 * minutes, 0
        while time.monotonic() < deadline:
            words, outputs = folder.job(n)
            run = folder.run(*words)
            waited = 0.0
            how = folder.generator.choice((None, signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP))
            if how is not None:
                waited = folder.generator.expovariate(4)
                time.sleep(waited)
                run.send_signal(how)
            begin = time.monotonic()
            code = run.wait()
            if how not in (None, signal.SIGKILL) and time.monotonic() - begin > 10:
                wrong.append(f"{how.name} took {time.monotonic() - begin:.1f} s: {words}")
            ended[code] = ended.get(code, 0) + 1
            # The next run in the folder removes the temporary files of a killed run, and completes the set of outputs
            # if the killed run had begun to put them in place.
            folder.run("phantom", "sphere", "--size", "16", "-o", "next.nrrd").wait()
            (folder.path / "next.nrrd").unlink()
            there = [name for name in outputs if (folder.path / name).exists()]
            if code == -signal.SIGKILL and there not in ([], outputs):
                wrong.append(f"killed, and left {there} of {outputs}")
            # A signal that arrives while libraries are loaded, before main(), ends the process without a message. This
            # is accepted if there are no outputs.
            early = how is not None and code == -how and waited < LOADING and not there
            if not early:
                wrong += folder.problems(code, words, outputs)
            hidden = [entry.name for entry in folder.path.iterdir() if entry.name.startswith(".covol")]
            if hidden:
                wrong.append(f"left {hidden}: {words}")
            folder.sweep(outputs)
            n += 1
        errors = (folder.path / "errors.txt").read_text()
        if "internal error" in errors:
            wrong.append(next(line for line in errors.splitlines() if "internal error" in line))
        counts = ", ".join(f"{count} with exit code {code}" for code, count in sorted(ended.items()))
        return f"{n} jobs with kills in {minutes:g} minutes ({counts}): {len(wrong)} went wrong", wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parts = {
        "one_process": lambda o: one_process(o.jobs, o.seed),
        "eight_at_once": lambda o: eight_at_once(o.seed),
        "old_or_new": lambda o: old_or_new(o.kills, o.seed),
        "random_kills": lambda o: random_kills(o.minutes, o.seed),
    }
    parser.add_argument("--only", choices=parts)
    options = parser.parse_args()
    failed = False
    for name in [options.only] if options.only else parts:
        text, wrong = parts[name](options)
        print("\n".join([text, *wrong]), flush=True)
        failed |= bool(wrong)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
