#!/usr/bin/env bash
# One surface in the file formats of other programs, and the result of covol check for each.
#
#     bash houdini_free_examples/04_into_blender_and_houdini.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/into_blender_and_houdini
data=houdini_free_examples/data
mkdir -p "$out"

echo "== one run, several files"
# The surface is computed from the marks alone; 00_quickstart.sh uses the image as well.
"$covol" reconstruct "$data/celegans_marks.csv" --voxel-size 4 -o "$out/surface.vdb" --density "$out/fog.vdb" \
  --mesh "$out/embryo.ply"
"$covol" mesh "$out/surface.vdb" -o "$out/embryo.glb" --up y --unit-scale 0.01
"$covol" mesh "$out/surface.vdb" -o "$out/embryo.obj" --target-edge 2vx
"$covol" mesh "$out/surface.vdb" -o "$out/embryo.stl" --isovalue 2vx
"$covol" mask "$out/surface.vdb" --like "$data/celegans_embryo.tif" -o "$out/embryo.nii.gz"
"$covol" render "$out/surface.vdb" --image "$data/celegans_embryo.tif" -o "$out/embryo.png"

echo "== what would go wrong elsewhere"
for file in "$out"/{surface.vdb,fog.vdb,embryo.ply,embryo.obj,embryo.stl}; do
  "$covol" check "$file"
done

echo "== results, and what opens them"
cat <<TEXT
$out/surface.vdb    level set: OpenVDB tools, Houdini (File SOP), ParaView; vdb_print and vdb_view
$out/fog.vdb        fog volume: Blender (Add > Volume > Import OpenVDB), renderers; Volume to Mesh shifts by half a voxel
$out/embryo.ply     mesh with provenance in its comments: MeshLab, Blender, CloudCompare, ParaView
$out/embryo.glb     y up, a hundredth of the size: web viewers, Blender, game engines
$out/embryo.obj     decimated to edges of two voxels: about everything
$out/embryo.stl     grown by two voxels: slicers for 3D printing
$out/embryo.nii.gz  label image on the stack's lattice: ITK-SNAP, 3D Slicer, napari
$out/embryo.png     picture
TEXT
