#!/usr/bin/env bash
# A microscope's stack: slices four times as far apart as pixels, noise, and a side where the edge has faded. Marks on
# every third slice, as a person clicks them, determine the surface on that side.
#
#     bash houdini_free_examples/03_anisotropic_stack.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/anisotropic_stack
mkdir -p "$out"

echo "== making the stack, its truth and the marks"
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
import numpy as np, tifffile
out, pixel, step = sys.argv[1], 0.5, 2.0
k, j, i = np.meshgrid(np.arange(24), np.arange(90), np.arange(100), indexing="ij")
x, y, z = pixel * i, pixel * j, step * k
center, radii, tilt = np.array((25, 22.5, 23)), np.array((17, 12, 14)), 0.5
def inside(x, y, z):  # an ellipsoid, rotated about z: the value is 1 on its surface
    dx, dy, dz = x - center[0], y - center[1], z - center[2]
    a, b = np.cos(tilt) * dx + np.sin(tilt) * dy, np.cos(tilt) * dy - np.sin(tilt) * dx
    return np.sqrt((a / radii[0]) ** 2 + (b / radii[1]) ** 2 + (dz / radii[2]) ** 2)
level = inside(x, y, z)
random = np.random.default_rng(1)
fade = np.clip((40 - x) / 15, 0, 1)  # for large x, the background is as bright as the structure, so that there is no edge
image = 60 + 120 * np.maximum(np.clip((1 - level) * 10 + 0.5, 0, 1), 1 - fade) + random.normal(0, 15, level.shape)
header = dict(imagej=True, resolution=(1 / pixel, 1 / pixel), metadata={"axes": "ZYX", "spacing": step, "unit": "um"})
tifffile.imwrite(f"{out}/stack.tif", np.clip(image, 0, 255).astype(np.uint8), **header)
tifffile.imwrite(f"{out}/truth.tif", (level < 1).astype(np.uint8), **header)
with open(f"{out}/marks.csv", "w") as marks:
    print("x_px,y_px,slice", file=marks)
    for slice in range(5, 19):
        if slice % 3 and slice not in (5, 18): continue
        for turn in np.arange(0, 2 * np.pi, 0.13):
            direction = np.array((np.cos(turn), np.sin(turn), 0))
            low, high = 0.0, 30.0  # finds the surface in this direction by bisection
            for _ in range(40):
                middle = (low + high) / 2
                at = (center[0] + middle * direction[0], center[1] + middle * direction[1], step * slice)
                low, high = (middle, high) if inside(*at) < 1 else (low, middle)
            px, py = (center[:2] + low * direction[:2]) / pixel + random.normal(0, 0.7, 2)
            print(f"{px:.1f},{py:.1f},{slice}", file=marks)
PYTHON
"$covol" info "$out/stack.tif"

echo "== segmenting"
"$covol" segment "$out/stack.tif" --points "$out/marks.csv" -o "$out/body.vdb" --mask "$out/mask.tif" \
  --mesh "$out/body.ply" --evidence "$out/evidence.csv" --json "$out/report.json"
"$covol" render "$out/body.vdb" --image "$out/stack.tif" --points "$out/marks.csv" -o "$out/body.png"

echo "== results"
"$covol" compare "$out/mask.tif" "$out/truth.tif"
for name in "body.vdb      level set on voxels of 0.5 um" "body.ply      mesh" "mask.tif      label image on the stack's own slices" \
            "evidence.csv  slice by slice: marks and edges" "report.json   report" "body.png      picture"; do
  echo "$out/$name"
done
