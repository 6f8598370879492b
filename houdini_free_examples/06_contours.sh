#!/usr/bin/env bash
# Outlines drawn on every fifth slice: a core and the layer around it, whose borders are stained membranes. covol fills
# in the slices between them, with and without the image.
#
#     bash houdini_free_examples/06_contours.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/contours
mkdir -p "$out"

echo "== making the stack, its truth and the outlines"
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
import numpy as np, tifffile
out, pixel, step, center = sys.argv[1], 0.5, 1.0, np.array((27.0, 25.0, 22.0))
# For each border: radius in um, height of its bumps divided by the radius, and number of bumps around the z axis.
shapes = {"core": (8, 0.15, 3), "layer": (16, 0.1, 2)}
def radius(name, azimuth, up):  # distance of the border from the centre in a direction; up: cosine of the angle to the z axis
    size, bump, count = shapes[name]
    return size * (1 + bump * np.cos(count * azimuth + 4 * up) * (1 - up ** 2))
k, j, i = np.meshgrid(np.arange(45), np.arange(100), np.arange(108), indexing="ij")
x, y, z = pixel * i - center[0], pixel * j - center[1], step * k - center[2]
r = np.sqrt(x ** 2 + y ** 2 + z ** 2) + 1e-9
off = {name: r - radius(name, np.arctan2(y, x), z / r) for name in shapes}
random = np.random.default_rng(1)
image = 50 + 110 * sum(np.exp(-0.5 * (d / 0.7) ** 2) for d in off.values()) + random.normal(0, 20, r.shape)
truth = np.where(off["core"] < 0, 1, np.where(off["layer"] < 0, 2, 0))
for name, values in (("stack", image), ("truth", truth)):
    tifffile.imwrite(f"{out}/{name}.tif", np.clip(values, 0, 255).astype(np.uint8), imagej=True,
                     resolution=(1 / pixel, 1 / pixel), metadata={"axes": "ZYX", "spacing": step, "unit": "um"})
def outline(name, slice):
    """Marks 15 degrees apart, as a hand draws them: where rays from the axis leave the shape."""
    azimuth, s = np.meshgrid(np.arange(0, 2 * np.pi, np.pi / 12), np.arange(0.01, 25, 0.01), indexing="ij")
    r = np.hypot(s, step * slice - center[2])
    inside = r < radius(name, azimuth, (step * slice - center[2]) / r)
    if not inside[:, 0].all(): return []  # the slice passes above or below the border: no outline
    turn, s = azimuth[:, 0], 0.01 * inside.sum(axis=1)
    return (np.stack([np.cos(turn), np.sin(turn)], 1) * s[:, None] + center[:2]) / pixel + random.normal(0, 0.4, (24, 2))
for name, borders in (("core", ["core"]), ("layer", ["layer", "core"])):  # the outline of the core is the inner border of the layer, a hole
    rows = [(slice, n, *mark) for slice in range(2, 45, 5) for n, border in enumerate(borders) for mark in outline(border, slice)]
    np.savetxt(f"{out}/{name}.csv", rows, "%.5g", ",", header="slice,contour,x_px,y_px", comments="")
PYTHON

for image in without with; do
  echo "== segmenting $image the image"
  "$covol" segment "$out/stack.tif" --contours "core=$out/core.csv" "layer=$out/layer.csv" -o "$out/$image.vdb" \
    --mask "$out/$image.seg.nrrd" --mesh "$out/$image.glb" --contour-curve spline \
    $([[ $image == without ]] && echo --rho 0) --quiet --json "$out/$image.json"
done
"$covol" render "$out/with.vdb:layer" --image "$out/stack.tif" -o "$out/layer.png"

for image in without with; do
  echo "== results $image the image"
  for label in 1 2; do "$covol" compare "$out/$image.seg.nrrd" "$out/truth.tif" --label $label; done
done
for name in "with.vdb       a level set for each, 'core' and 'layer'" "with.seg.nrrd  label image with names (3D Slicer)" \
            "with.glb       both meshes" "with.json      report; edge_feature says what the marks lie on" "layer.png      picture of the layer"; do
  echo "$out/$name"
done
