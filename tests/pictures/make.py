"""The pictures of docs/in, each made according to the description on its page: of the program's own window if Debian has the
program, otherwise of covol's data for it.

    COVOL=build/bin/covol PYTHONPATH=build/python /usr/bin/python3 tests/pictures/make.py docs/pictures [NAME...]

Needs xvfb-run, and the programs in NEEDS for each picture. tests/pictures/made_test.py makes the pictures again and compares them
with those of docs.
"""
import importlib
import os
import pathlib
import shutil
import sys

NEEDS = {  # {picture: (module that makes it, programs that it needs)}
    "fiji": ("windows", ("java", "imagej")),
    "blender": ("windows", ("blender",)),
    "napari": ("figures", ("chromium", "chromedriver")),
    "slicer": ("figures", ("chromium", "chromedriver")),
    "itksnap": ("figures", ("chromium", "chromedriver")),
    "cluster": ("figures", ("chromium", "chromedriver", "snakemake")),
    "notebook": ("figures", ("chromium", "chromedriver")),
}
SCREEN = "1100x700x24"
MAX_BYTES = 200_000  # maximum size of a picture file


def missing(name):
    return [program for program in ("xvfb-run", *NEEDS[name][1]) if not shutil.which(program)]


def make_small(path):
    """Saves a picture with as many colours as fit into MAX_BYTES."""
    from PIL import Image
    whole = Image.open(path).convert("RGB")
    for colors in (256, 128, 64, 32):
        whole.quantize(colors, method=Image.Quantize.MAXCOVERAGE, kmeans=8, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size <= MAX_BYTES:
            return
    raise RuntimeError(f"{path}: larger than {MAX_BYTES} bytes")


def main(folder, names):
    unknown = set(names) - set(NEEDS)
    if unknown:
        sys.exit(f"no such picture: {', '.join(sorted(unknown))}; expected {', '.join(NEEDS)}")
    # Starts this script again on a virtual screen, since windows on the user's would cover those in the picture.
    if "COVOL_SCREEN" not in os.environ:
        os.environ["COVOL_SCREEN"] = SCREEN
        os.execvp("xvfb-run", ["xvfb-run", "-a", "-s", f"-screen 0 {SCREEN}", sys.executable, *sys.argv])
    from work import Work
    for name in names or NEEDS:
        if absent := missing(name):
            sys.exit(f"{name}: needs {', '.join(absent)}")
        path = pathlib.Path(folder).resolve() / f"in_{name}.png"
        with Work() as work:
            getattr(importlib.import_module(NEEDS[name][0]), name)(work, path)
        make_small(path)
        print(f"{path.name}: {path.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
