#!/usr/bin/env bash
# The paper's figures 5 to 7, with the stack and the outlines of 06_contours.sh in place of the paper's embryo: slices
# with marks and outlines; the image volume rendered with both structures in it; the surfaces with their points.
#
#     bash houdini_free_examples/17_figures_5_to_7.sh
set -euo pipefail
cd "$(dirname "$0")/.."
source houdini_free_examples/build.sh
contours=$results/contours
out=$results/figures
mkdir -p "$out"

echo "== the job"
[[ -f $contours/with.vdb ]] || bash houdini_free_examples/06_contours.sh >/dev/null
/usr/bin/python3 - "$contours" "$out" <<'PYTHON'
import csv, sys
contours, out = sys.argv[1:]
for name in ("core", "layer"):  # pixels of half a micrometre, slices one micrometre apart
    with open(f"{contours}/{name}.csv") as table, open(f"{out}/{name}.xyz", "w") as marks:
        for row in csv.DictReader(table):
            print(0.5 * float(row["x_px"]), 0.5 * float(row["y_px"]), row["slice"], file=marks)
PYTHON
marks=(--points "core=$out/core.xyz" "layer=$out/layer.xyz")

echo "== figures"
"$covol" render "$contours/with.vdb" --image "$contours/stack.tif" "${marks[@]}" --figure slices --slices 9 --size 1800x1500 \
  -o "$out/figure_5.png" --quiet
"$covol" render "$contours/with.vdb" --image "$contours/stack.tif" --figure surface --volume --view 30,35 --size 1500x1200 \
  -o "$out/figure_6.png" --quiet
"$covol" render "$contours/with.vdb" "${marks[@]}" --figure surface --view 30,35 --size 1500x1200 -o "$out/figure_7.png" --quiet

echo "== results"
for name in "figure_5.png   slices, the marked ones first, with marks and both outlines" \
            "figure_6.png   the image behind the surfaces, volume rendered" \
            "figure_7.png   the layer, the core within it, and the marks of each"; do
  echo "$out/$name"
done
