"""covol from Python: from a real stack and its marks, as arrays, to a mask, a mesh and suggested positions for further marks.

    PYTHONPATH=build/python /usr/bin/python3 houdini_free_examples/11_python.py      # PYTHONPATH: where covol is not installed
"""
import os
import pathlib

import covol

data = pathlib.Path(__file__).parent / "data"
out = pathlib.Path(os.environ.get("COVOL_OUT", "out")) / "python"
out.mkdir(parents=True, exist_ok=True)

stack = covol.read_image(data / "celegans_embryo.tif")
marks = covol.read_points(data / "celegans_marks.csv").to_world(stack)
result = covol.segment(stack.array, marks, spacing=stack.spacing, origin=stack.origin, voxel_size=3)

check = covol.read_points(data / "celegans_check.csv").to_world(stack)  # marks that were not used for the segmentation
print(result, result.mask.shape, result.mask.sum(), "voxels inside")
print("marks held out:", covol.distances(check, result))
print("more marks would help in:", result.suggest(3))
for name in ("embryo.vdb", "embryo.ply", "embryo_mask.tif"):
    result.save(out / name)
    print(out / name)
