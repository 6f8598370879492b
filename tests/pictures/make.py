"""The pictures of docs/in, each made from what its page describes: of the program's own window where Debian has it, else of what covol
gives to it.

    COVOL=build/bin/covol PYTHONPATH=build/python /usr/bin/python3 tests/pictures/make.py docs/pictures [NAME...]

Needs xvfb-run, and what NEEDS names for each picture. tests/pictures/made_test.py makes them anew and compares them with those of docs.
"""
import importlib
import os
import pathlib
import shutil
import sys

NEEDS = {  # of each picture: the module that makes it, and the programs that take part
    "fiji": ("windows", ("java", "imagej")),
    "blender": ("windows", ("blender",)),
    "napari": ("figures", ("chromium", "chromedriver")),
    "slicer": ("figures", ("chromium", "chromedriver")),
    "itksnap": ("figures", ("chromium", "chromedriver")),
    "cluster": ("figures", ("chromium", "chromedriver", "snakemake")),
    "notebook": ("figures", ("chromium", "chromedriver")),
}
SCREEN = "1100x700x24"
MOST_BYTES = 200_000  # of a picture


def missing(name):
    return [program for program in ("xvfb-run", *NEEDS[name][1]) if not shutil.which(program)]


def make_small(path):
    """With as many colours as fit into MOST_BYTES."""
    from PIL import Image
    whole = Image.open(path).convert("RGB")
    for colors in (256, 128, 64, 32):
        whole.quantize(colors, method=Image.Quantize.MAXCOVERAGE, kmeans=8, dither=Image.Dither.NONE).save(path, optimize=True)
        if path.stat().st_size <= MOST_BYTES:
            return
    raise RuntimeError(f"{path}: larger than {MOST_BYTES} bytes")


def main(folder, names):
    unknown = set(names) - set(NEEDS)
    if unknown:
        sys.exit(f"no such picture: {', '.join(sorted(unknown))}; expected {', '.join(NEEDS)}")
    if "COVOL_SCREEN" not in os.environ:  # never that of a person, whose windows would be in the way
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
