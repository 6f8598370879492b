#!/usr/bin/env bash
# A job that is split into bricks: planned, solved brick by brick, joined, and compared with the same job in one piece.
#
#     bash houdini_free_examples/40_bricks.sh
#
# On one machine --memory-limit does all of this automatically; for clusters see houdini_free_examples/bricks.
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/bricks
rm -rf "$out"
mkdir -p "$out"

echo "== image and marks"
"$covol" phantom torus --size 128 --count 6000 -o "$out/torus.nrrd" --points "$out/torus.xyz"
job=(segment "$out/torus.nrrd" --points "$out/torus.xyz" --model paper)

echo "== the plan: a coarse solve of the whole, and bricks of about equal parts of the band"
"$covol" brick plan "${job[@]}" --brick-voxels 40000 -o "$out/plan"
echo "== two bricks of the first sweep by their numbers, as a machine of many would; then all that is left"
"$covol" brick run "$out/plan" 0 1
"$covol" brick run "$out/plan"
echo "== joined; the mesh is streamed to the file"
"$covol" brick join "$out/plan" -o "$out/joined.vdb" --mesh "$out/joined.ply" --plain
echo "== in one piece, from the same coarse level"
"$covol" "${job[@]}" --coarse-levels 1 -o "$out/whole.vdb"

echo "== results"
"$covol" compare "$out/joined.vdb" "$out/whole.vdb"
"$covol" render "$out/joined.vdb" --image "$out/torus.nrrd" --points "$out/torus.xyz" -o "$out/joined.png"
echo "$out/joined.vdb, joined.ply, joined.png (picture), plan (the bricks' states)"
