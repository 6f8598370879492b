#!/usr/bin/env bash
# A shell with six holes in an image, closed twice: by the image alone, and with points in the holes.
#
#     bash houdini_free_examples/02_hole_closing.sh
#
# Without an edge, curvature closes a hole by the minimal surface, a flat disc. The points show the true shape, a
# sphere.
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/hole_closing
mkdir -p "$out"

echo "== making the image and the points"
"$covol" phantom sphere-round --size 130 --count 1500 -o "$out/shell.nrrd" --points "$out/holes.xyz"

echo "== the image alone"
"$covol" segment "$out/shell.nrrd" --theta 0 --init sphere:0,0,0,0.95 --delta 1vx --tau 4vx -o "$out/image_alone.vdb"
"$covol" render "$out/image_alone.vdb" --image "$out/shell.nrrd" --points "$out/holes.xyz" -o "$out/image_alone.png"

echo "== image and points"
"$covol" segment "$out/shell.nrrd" --points "$out/holes.xyz" --init sphere:0,0,0,0.95 --delta 1vx \
  --attraction-range 5vx -o "$out/with_points.vdb"
"$covol" render "$out/with_points.vdb" --image "$out/shell.nrrd" --points "$out/holes.xyz" -o "$out/with_points.png"

echo "== results (voxels are 0.02; the sphere's cap is 0.054 higher than the disc)"
for name in image_alone with_points; do
  echo "$out/$name.vdb, $name.png: $("$covol" compare "$out/$name.vdb" "$out/holes.xyz")"
done
