#!/usr/bin/env bash
# covol's files in OpenVDB's own programs: vdb_print, vdb_lod, python3-openvdb, NanoVDB, and a sequence with a USD scene
# that refers to it. Programs that are not installed are skipped and listed.
#
#     bash houdini_free_examples/16_openvdb_pipeline.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/openvdb_pipeline
mkdir -p "$out"
has() { command -v "$1" >/dev/null || { echo "$1 is not installed: SKIPPED"; return 1; }; }

echo "== level set and fog volume in one file, unpacked"
"$covol" reconstruct houdini_free_examples/data/celegans_marks.csv --voxel-size 4 -o "$out/embryo.vdb" \
  --density "$out/embryo.vdb" --compression none --usda "$out/embryo.usda"
"$covol" check "$out/embryo.vdb" --for blender
if has vdb_print; then vdb_print "$out/embryo.vdb"; fi

echo "== half and quarter of the resolution"
if has vdb_lod; then
  vdb_lod "$out/embryo.vdb" "$out/levels.vdb" -name density -range 0-2
  vdb_print "$out/levels.vdb"
fi

echo "== python3-openvdb: a shell of 8 units, from the level set's own values"
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
try:
    import pyopenvdb as vdb
except ImportError:
    sys.exit("python3-openvdb is not installed")
out = sys.argv[1]
solid = vdb.read(f"{out}/embryo.vdb", "surface")
h = solid.transform.voxelSize()[0]
points, quads = solid.convertToQuads(isovalue=0)
print(f"surface: {solid.activeVoxelCount()} active voxels of {h:g}, {len(quads)} quadrilaterals")
shell = solid.deepCopy()
shell.name = "shell"
# The level set of a shell: all positions up to 4 units from the surface are inside. The values are known there, because
# the narrow band reaches three voxels of 4 units from the surface.
shell.mapAll(lambda d: abs(d) - 4.0)
shell.background = solid.background - 4.0
vdb.write(f"{out}/shell.vdb", [shell])
PYTHON
"$covol" info "$out/shell.vdb"

echo "== NanoVDB, for viewers on the GPU; no archive format"
"$covol" convert "$out/embryo.vdb" "$out/embryo.nvdb"
if has nanovdb_print; then nanovdb_print "$out/embryo.nvdb"; fi

"$covol" render "$out/embryo.vdb" --image houdini_free_examples/data/celegans_embryo.tif -o "$out/embryo.png"

echo "== results"
cat <<TEXT
$out/embryo.vdb   surface and density
$out/embryo.usda  a scene that refers to it
$out/shell.vdb    made by python3-openvdb
$out/embryo.nvdb  the grids for viewers
$out/embryo.png   picture
TEXT
if [[ -f $out/levels.vdb ]]; then echo "$out/levels.vdb  levels of resolution"; fi
