#!/usr/bin/env bash
# Installs what is needed, builds covol, segments a real image with the help of marked points, and prints where the
# results are and how accurate they are.
#
#     bash houdini_free_examples/00_quickstart.sh
#
# The image is a C. elegans embryo with stained membranes (houdini_free_examples/data/README.md): its far side has faded
# and has no edge left, so that the marks alone determine the surface there.
set -euo pipefail
cd "$(dirname "$0")/.."

image=houdini_free_examples/data/celegans_embryo.tif
# $points are marks for the program. $check are other marks, which the program does not get: their distances from the
# surface measure the accuracy of the result.
points=houdini_free_examples/data/celegans_marks.csv
check=houdini_free_examples/data/celegans_check.csv
out=${COVOL_OUT:-out}/quickstart
source houdini_free_examples/build.sh

echo "== segmenting"
mkdir -p "$out"
# Slices are 3.5 pixels apart, and marks about 30 pixels. Voxels of 3 pixels are therefore fine enough for both; the run
# takes two seconds.
"$covol" segment "$image" --points "$points" --voxel-size 3 -o "$out/embryo.vdb" \
  --mesh "$out/embryo.ply" --mask "$out/embryo_mask.tif" --json "$out/report.json" \
  --report "$out/embryo.html"
"$covol" compare "$out/embryo.vdb" "$check" --json "$out/check.json"
"$covol" render "$out/embryo.vdb" --image "$image" --points "$points" -o "$out/embryo.png"

echo "== results"
python3 - "$out" <<'PYTHON'
import json, sys
out = sys.argv[1]
r = json.load(open(out + "/report.json"))
fit, surface, unit = r["fit"]["points_to_surface"], r["surface"], r["input"]["image"]["unit"] or "units"
h = r["grid"]["voxel_size"]
held_out = json.load(open(out + "/check.json"))["fit"]["points_to_surface"]
print(f"marks to surface   mean {fit['mean'] / h:.2f}, 95 % {fit['p95'] / h:.2f} voxels of {h:g} {unit}")
print(f"marks held out     mean {held_out['mean'] / h:.2f}, 95 % {held_out['p95'] / h:.2f} voxels")
print(f"surface            {'closed' if surface['closed'] else 'NOT CLOSED'}, genus {surface['genus']}, "
      f"{surface['components']} component(s), volume {surface['volume']:.5g} {unit}^3")
print(f"solve              {r['solve']['steps']} steps, {r['solve']['stop_reason']}")
print(f"time and memory    {r['seconds']['total']:.1f} s, {r['peak_rss_bytes'] / 2**20:.0f} MiB")
for name, what in [("embryo.vdb", "level set"), ("embryo.ply", "mesh"), ("embryo_mask.tif", "label image"),
                   ("report.json", "report"), ("embryo.png", "picture"),
                   ("embryo.html", "page for the browser: look at this one first")]:
    print(f"{out}/{name:18} {what}")
PYTHON
