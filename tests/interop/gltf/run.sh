#!/usr/bin/env bash
# Checks covol's .glb files with the glTF validator of Khronos: of one structure and of several, y up and z up. It is
# run by hand, because it needs node and, the first time, a download from npm:
#
#     COVOL=build/bin/covol bash tests/interop/gltf/run.sh
set -euo pipefail
covol=$(realpath "${COVOL:-build/bin/covol}")
cd "$(dirname "$0")"
[[ -d node_modules ]] || npm ci --no-audit --no-fund
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
data=../../../houdini_free_examples/data
"$covol" reconstruct "$data/celegans_marks.csv" --voxel-size 6 -o "$out/s.vdb" --mesh "$out/one.glb" --quiet
"$covol" mesh "$out/s.vdb" -o "$out/z_up.glb" --up z --quiet
"$covol" mesh "$out/s.vdb" -o "$out/adaptive.glb" --adaptive 0.5vx --quiet
for kind in sphere torus; do
  "$covol" phantom $kind --size 40 -o "$out/$kind.nrrd" --points "$out/$kind.xyz" --quiet
done
"$covol" segment "$out/sphere.nrrd" --points "ball=$out/sphere.xyz" "ring=$out/torus.xyz" -o "$out/two.vdb" \
  --mesh "$out/several.glb" --quiet
node validate.mjs "$out"/*.glb
