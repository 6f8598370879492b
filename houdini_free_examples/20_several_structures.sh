#!/usr/bin/env bash
# Two cells that touch, from one image in one run: they have a common interface, and no voxel belongs to both.
#
#     bash houdini_free_examples/20_several_structures.sh
#
# Two bright balls overlap in the image; each has marks on its own surface.
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
out=$results/several_structures
mkdir -p "$out"

echo "== making the image and the marks"
/usr/bin/python3 - "$out" <<'PYTHON'
import sys
import numpy as np, tifffile
out, size, h = sys.argv[1], 80, 0.5
z, y, x = np.meshgrid(*[h * np.arange(size)] * 3, indexing="ij")
image = np.full((size,) * 3, 20.0)
turn = np.pi * (3 - 5 ** 0.5) * np.arange(2500)
up = 1 - (2 * np.arange(2500) + 1) / 2500
sphere = np.stack([np.sqrt(1 - up ** 2) * np.cos(turn), np.sqrt(1 - up ** 2) * np.sin(turn), up], axis=1)
for name, center, radius in (("left", (14, 20, 20), 8), ("right", (26, 20, 21), 7.5)):
    r = np.sqrt(sum((a - c) ** 2 for a, c in zip((x, y, z), center)))
    image = np.maximum(image, 20 + 180 * np.clip((radius - r) / h + 0.5, 0, 1))
    np.savetxt(f"{out}/{name}.csv", center + radius * sphere, "%.3f", ",", header="x,y,z", comments="")
noise = np.random.default_rng(1).normal(0, 8, image.shape)
tifffile.imwrite(f"{out}/cells.tif", np.clip(image + noise, 0, 255).astype(np.uint8), imagej=True,
                 resolution=(1 / h, 1 / h), metadata={"axes": "ZYX", "spacing": h, "unit": "um"})
PYTHON

echo "== segmenting both"
"$covol" segment "$out/cells.tif" --points "left=$out/left.csv" "right=$out/right.csv" -o "$out/cells.vdb" \
  --mask "$out/cells.seg.nrrd" --mesh "$out/cells.glb" --table "$out/cells.csv" --evidence "$out/evidence.csv" \
  --json "$out/report.json"
"$covol" render "$out/cells.vdb" --image "$out/cells.tif" --points "left=$out/left.csv" "right=$out/right.csv" -o "$out/cells.png"

echo "== results"
cat "$out/cells.csv"
for name in "cells.vdb        a level set for each, 'left' and 'right'" "cells.seg.nrrd   label image with names and colours (3D Slicer)" \
            "cells.glb        both meshes" "cells.csv        volumes and areas" "evidence.csv     slice by slice: marks and edges" \
            "cells.png        picture of both"; do
  echo "$out/$name"
done
