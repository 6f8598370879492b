#!/usr/bin/env bash
# The paper's figure 4: spheres with six holes of three shapes, segmented by the image alone, by the points alone, which
# lie in the holes, and by both. Rows: round, square and slit holes; columns: image, points, image and points.
#
#     bash houdini_free_examples/14_figure_4.sh
#
# Where the image has no edge, curvature closes a hole by the minimal surface. In the second column, where there are no
# points, curvature alone pulls the surface inwards (points attract at any distance there, as in the paper).
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/figure_4
mkdir -p "$out"

for holes in round square slit; do
  echo "== $holes holes"
  "$covol" phantom "sphere-$holes" --size 48 --count 3000 -o "$out/$holes.nrrd" --points "$out/$holes.xyz" --quiet
  for column in image points both; do
    case $column in
      image) how=(--theta 0 --delta 1vx) ;;
      points) how=(--points "$out/$holes.xyz" --rho 0 --attraction-range 0 --delta 0.25vx) ;;
      both) how=(--points "$out/$holes.xyz" --attraction-range 5vx --delta 1vx) ;;
    esac
    "$covol" segment "$out/$holes.nrrd" --init sphere:0,0,0,0.95 "${how[@]}" -o "$out/${holes}_$column.vdb" --quiet
    "$covol" render "$out/${holes}_$column.vdb" --image "$out/$holes.nrrd" --points "$out/$holes.xyz" --slices 1 \
      --size 600x400 -o "$out/${holes}_$column.png" --quiet
  done
done

echo "== results: distance from the points to each surface; a voxel is 0.05"
for holes in round square slit; do
  for column in image points both; do
    echo "$out/${holes}_$column.vdb: $("$covol" compare "$out/${holes}_$column.vdb" "$out/$holes.xyz")"
  done
done
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
from vtkmodules.vtkFiltersCore import vtkImageAppend
from vtkmodules.vtkIOImage import vtkPNGReader, vtkPNGWriter

def joined(parts, axis):
    append = vtkImageAppend()
    append.SetAppendAxis(axis)
    for part in parts:
        append.AddInputData(part)
    append.Update()
    return append.GetOutput()

def picture(path):
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()

out = sys.argv[1]
rows = [joined([picture(f"{out}/{holes}_{column}.png") for column in ("image", "points", "both")], 0)
        for holes in ("slit", "square", "round")]  # VTK's first row is the bottom one
writer = vtkPNGWriter()
writer.SetInputData(joined(rows, 1))
writer.SetFileName(f"{out}/figure_4.png")
writer.Write()
PYTHON
echo "$out/figure_4.png    all nine"
