#!/usr/bin/env bash
# A cloud of points without normals becomes a closed surface.
#
#     bash houdini_free_examples/01_points_alone.sh
#
# The cloud is 4,000 random points on a torus. The voxel size, the tag distance, which closes the gaps between points,
# and all other options are chosen from the cloud and printed.
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/points_alone
mkdir -p "$out"

echo "== making the cloud"
"$covol" phantom torus --size 64 --count 4000 -o "$out/torus.nrrd" --points "$out/cloud.xyz"

echo "== reconstructing"
"$covol" reconstruct "$out/cloud.xyz" -o "$out/torus.vdb" --mesh "$out/torus.ply" --json "$out/report.json"
"$covol" render "$out/torus.vdb" -o "$out/torus.png"

echo "== results (true volume 1.3324, area 8.8826, genus 1)"
"$covol" info "$out/torus.ply"
"$covol" compare "$out/torus.ply" "$out/cloud.xyz"
for name in "torus.vdb    level set" "torus.ply    mesh" "report.json  what was chosen, and how well it fits" \
            "torus.png    picture, from two sides"; do
  echo "$out/$name"
done
