#!/usr/bin/env bash
# From a structure in a stack in millimetres to a mesh for a 3D printer and to a segmentation for 3D Slicer: marks on
# some slices, a mesh three times as large, and the results of covol check for both.
#
#     bash houdini_free_examples/15_printable.sh
#
# The stack is synthetic, because the sample data contains no scan of a patient: a bent vessel, bright as in
# contrast-enhanced CT, with noise and slices twice as far apart as pixels.
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/printable
mkdir -p "$out"

echo "== making the stack and the marks"
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
import nibabel, numpy as np
out, size, spacing = sys.argv[1], (72, 72, 30), np.array([0.5, 0.5, 1.0])
i, j, k = np.meshgrid(*(np.arange(n) for n in size), indexing="ij")
x, y, z = (spacing[a] * n for a, n in enumerate((i, j, k)))
# The vessel's centre line bends along x with z; its radius is 7 mm.
off = np.hypot(x - 18 - 3 * np.sin(z / 8), y - 18)
ends = np.maximum(4 - z, z - 25)
distance = np.maximum(off - 7, ends)
random = np.random.default_rng(2)
ct = 40 + 300 * np.clip(0.5 - distance / 0.6, 0, 1) + random.normal(0, 25, size)
affine = np.diag([-spacing[0], -spacing[1], spacing[2], 1])  # NIfTI is in RAS: x and y of the LPS coordinates change their signs
image = nibabel.Nifti1Image(ct.astype(np.int16), affine)
image.header.set_xyzt_units("mm")
nibabel.save(image, f"{out}/ct.nii.gz")
turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
marks = [np.stack([18 + 3 * np.sin(h / 8) + r * np.cos(turn), 18 + r * np.sin(turn), np.full(24, h)], 1)
         for h, r in [(4.0, 3.5), *((h, 7.0) for h in (5.0, 8.0, 11.0, 14.0, 17.0, 20.0, 24.0)), (25.0, 3.5)]]
np.savetxt(f"{out}/marks.csv", np.concatenate(marks), "%.3f", ",", header="x,y,z", comments="")
PYTHON

echo "== the structure"
"$covol" segment "$out/ct.nii.gz" --points "$out/marks.csv" -o "$out/vessel.vdb" --mask "$out/vessel.seg.nrrd"
echo "== a mesh for the printer: three times as large, decimated where it is flat, without self-intersections"
"$covol" mesh "$out/vessel.vdb" -o "$out/vessel.stl" --unit-scale 3 --adaptive 0.2vx --repair
"$covol" mesh "$out/vessel.vdb" -o "$out/vessel.ply" --unit-scale 3 --adaptive 0.2vx --repair --quiet
"$covol" check "$out/vessel.ply" --for print
"$covol" check "$out/vessel.seg.nrrd" --for slicer
"$covol" render "$out/vessel.vdb" --image "$out/ct.nii.gz" --points "$out/marks.csv" -o "$out/vessel.png"

echo "== results"
cat <<TEXT
$out/vessel.stl       for the printer's program; vessel.ply the same, with the unit in its comments
$out/vessel.seg.nrrd  for 3D Slicer
$out/vessel.png       picture
TEXT
