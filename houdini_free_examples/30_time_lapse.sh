#!/usr/bin/env bash
# A cell that moves and grows over eight frames: only the first frame has marks, and each other frame starts from the
# one before.
#
#     bash houdini_free_examples/30_time_lapse.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/time_lapse
mkdir -p "$out"

echo "== making the movie and the marks of its first frame"
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
import numpy as np, tifffile
out, size, h, frames = sys.argv[1], 64, 0.5, 8
z, y, x = np.meshgrid(*[h * np.arange(size)] * 3, indexing="ij")
at = lambda t: ((11 + 1.2 * t, 13 + 0.6 * t, 16), 6 + 0.25 * t)
random, movie = np.random.default_rng(1), []
for t in range(frames):
    center, radius = at(t)
    r = np.sqrt(sum((a - c) ** 2 for a, c in zip((x, y, z), center)))
    movie.append(20 + 180 * np.clip((radius - r) / h + 0.5, 0, 1) + random.normal(0, 8, r.shape))
tifffile.imwrite(f"{out}/movie.tif", np.clip(movie, 0, 255).astype(np.uint8), imagej=True, resolution=(1 / h, 1 / h),
                 metadata={"axes": "TZYX", "spacing": h, "unit": "um", "finterval": 60})
n = 1500
turn, up = np.pi * (3 - 5 ** 0.5) * np.arange(n), 1 - (2 * np.arange(n) + 1) / n
sphere = np.stack([np.sqrt(1 - up ** 2) * np.cos(turn), np.sqrt(1 - up ** 2) * np.sin(turn), up], axis=1)
np.savetxt(f"{out}/marks.csv", np.array(at(0)[0]) + at(0)[1] * sphere, "%.3f", ",", header="x,y,z", comments="")
PYTHON

echo "== segmenting all frames"
"$covol" segment "$out/movie.tif" --frame all --points "$out/marks.csv" -o "$out/cell.vdb" --mesh "$out/cell.ply" \
  --table "$out/cell.csv" --json "$out/report.json"
"$covol" render "$out/cell_t007.vdb" --image "$out/movie.tif" --frame 7 -o "$out/cell_t007.png"

echo "== results: volume and area over time; the true radius grows from 6 to 7.75 um"
/usr/bin/python3 - "$out/cell.csv" <<'PYTHON'
import csv, math, sys
for row in csv.DictReader(open(sys.argv[1])):
    radius = (3 * float(row["volume (um^3)"]) / (4 * math.pi)) ** (1 / 3)
    truth = 6 + 0.25 * int(row["frame"])
    print(f"frame {row['frame']}: radius {radius:.2f} um (true {truth:.2f}), area {float(row['area (um^2)']):.0f} um^2, "
          f"{row['steps']} steps, {float(row['seconds']):.2f} s, {row['status']}")
PYTHON
echo "$out/cell_t000.vdb ... cell_t007.vdb, cell_t000.ply ..., cell.csv, cell_t007.png (picture of the last)"
