#!/usr/bin/env bash
# A job's files in Blender: imported without a window, checked for position, size and smoothness, and rendered by
# Cycles, with half of the surface around the stained membranes. If Blender is not installed, only covol's own picture
# is made.
#
#     sudo apt-get install --no-install-recommends blender
#     bash houdini_free_examples/13_blender.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/blender
image=houdini_free_examples/data/celegans_embryo.tif
points=houdini_free_examples/data/celegans_marks.csv
mkdir -p "$out"

echo "== making the job's files"
"$covol" segment "$image" --points "$points" --voxel-size 3 -o "$out/surface.vdb" --density "$out/fog.vdb" \
  --mesh "$out/embryo.ply"
"$covol" mesh "$out/surface.vdb" -o "$out/embryo.glb"
"$covol" convert "$image" "$out/image.vdb" --voxel-size 3
"$covol" render "$out/surface.vdb" --image "$image" --points "$points" -o "$out/embryo.png"

echo "== Blender"
if command -v blender >/dev/null; then
  blender -b --factory-startup --python houdini_free_examples/13_blender.py -- \
    "$out" "$out"/{surface.vdb,fog.vdb,embryo.ply,embryo.glb} "image=$out/image.vdb:30:150" >"$out/blender.log" 2>&1 ||
    { cat "$out/blender.log" >&2; exit 1; }
  grep -E '^(ok|FAIL) ' "$out/blender.log"
else
  echo "Blender is not installed: SKIPPED"
fi

echo "== results"
cat <<TEXT
$out/surface.vdb    level set, fog.vdb the same as a fog volume, image.vdb the image
$out/embryo.ply     mesh, embryo.glb the same
$out/embryo.png     covol's picture
TEXT
if [[ -f $out/blender.png ]]; then
  echo "$out/blender.png    Blender's picture: the surface, and the image inside of it"
  echo "$out/blender.blend  the scene; $out/blender.json what was measured"
fi
