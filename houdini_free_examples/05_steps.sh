#!/usr/bin/env bash
# The steps of covol segment, one by one; each writes a .vdb that vdb_print, vdb_view and OpenVDB's other tools read.
#
#     bash houdini_free_examples/05_steps.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/steps
mkdir -p "$out"

echo "== image and points: two balls, noise"
"$covol" phantom two-spheres --size 96 --count 3000 --noise 0.1 -o "$out/image.nrrd" --points "$out/points.xyz" \
  --labels "$out/truth.nrrd"

echo "== distance to the points, in a tube around them"
"$covol" distance "$out/points.xyz" --like "$out/image.nrrd" --max-distance 8vx -o "$out/distance.vdb"
echo "== band: what a flood from outside cannot reach through gaps of 2 x 3 voxels is inside"
"$covol" band "$out/distance.vdb" --tag-distance 3vx -o "$out/band.vdb"
echo "== edge: g, small where the image has an edge, only in the band"
"$covol" edge "$out/image.nrrd" --band "$out/band.vdb" -o "$out/edge.vdb"
echo "== evolve: points, edges and curvature move the level set u"
"$covol" evolve "$out/band.vdb" --distance "$out/distance.vdb" --edge "$out/edge.vdb" -o "$out/u.vdb"
echo "== surface: the zero level set as a true distance"
"$covol" surface "$out/u.vdb" -o "$out/surface.vdb"
"$covol" mesh "$out/surface.vdb" -o "$out/surface.ply"
"$covol" mask "$out/surface.vdb" --like "$out/image.nrrd" -o "$out/mask.nrrd"
"$covol" render "$out/surface.vdb" --image "$out/image.nrrd" --points "$out/points.xyz" -o "$out/surface.png"

echo "== results"
"$covol" compare "$out/mask.nrrd" "$out/truth.nrrd"
for name in distance band edge u surface; do
  echo "$out/$name.vdb: $("$covol" info "$out/$name.vdb" | grep -o '[0-9]* active voxels')"
done
echo "$out/surface.ply, mask.nrrd, surface.png (picture)"
