"""The time that `covol mark` takes from a click to the first and to the refined surface, on images with truth.

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/latency.py [--covol BINARY] [--only WORDS]

All marks but six are set and solved; then each of the six is timed, from the action to the message with the surface.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cli"))
import annotator  # noqa: E402
import truth  # noqa: E402
from live_client import Live, Page  # noqa: E402

JOBS = (("embryo nucleus 2", 20), ("hippocampus", 60), ("ventricle", 60), ("spleen", 60), ("brain", 300))
TIMED = 6


def measure(covol, structure, count):
    with tempfile.TemporaryDirectory() as folder:
        program = subprocess.Popen([covol, "mark", structure.image, folder + "/study", "--no-browser", *map(str, structure.options)],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            page = Page(program.stdout.readline().split()[1])
            facts, live = page.json("/image"), Live(page)
            to_world = np.array(facts["direction"]) * np.array(facts["spacing"])
            places = [(facts["origin"] + to_world @ mark).tolist() for mark in annotator.marks_of(structure, count, 0)]
            one = live.add_structure("structure")
            for place in places[:-TIMED]:
                live.add_mark(one, place)
            live.wait_for(one, "refined", count - TIMED + 1)
            first, refined = [], []
            for n, place in enumerate(places[-TIMED:]):
                begin = time.perf_counter()
                live.add_mark(one, place)
                sequence = count - TIMED + 2 + n
                live.wait_for(one, "first", sequence)
                first.append(time.perf_counter() - begin)
                live.wait_for(one, "refined", sequence)
                refined.append(time.perf_counter() - begin)
            return first, refined
        finally:
            program.kill()
            program.wait()
            program.stdout.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", default="build/bin/covol")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    structures = truth.by_name()
    print("| structure | marks | first, median (max) | refined, median (max) |\n|---|---|---|---|")
    for name, count in JOBS:
        if options.only and options.only not in name:
            continue
        times = [f"{np.median(t):.2f} ({max(t):.2f}) s" for t in measure(options.covol, structures[name], count)]
        print(f"| {name} | {count} | {times[0]} | {times[1]} |", flush=True)


if __name__ == "__main__":
    main()
