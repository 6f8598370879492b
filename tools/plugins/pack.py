#!/usr/bin/python3
"""Makes the plugins for other programs, each as one file.

    /usr/bin/python3 tools/plugins/pack.py [blender|imagej|slicer]... [--output FOLDER]

blender makes covol_blender-VERSION.zip, for Blender 3.4 (Preferences, Install) and as an extension for 4.2 and later (Install from
Disk); slicer makes covol_slicer-VERSION.zip, a folder for 3D Slicer's module paths; imagej copies the macros unchanged. The code that
the plugins share with the Python package, to run the program and to read files, is copied into each. Standard library only.
"""
import argparse
import pathlib
import re
import shutil
import sys
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PYTHON = SOURCE / "tools/python"
SHARED = [PYTHON / "covol/_errors.py", PYTHON / "covol/_files.py", PYTHON / "program/_process.py"]
TIME = (1980, 1, 1, 0, 0, 0)  # a constant time, so that archives are reproducible


def version():
    return re.search(r'STRING "([0-9.]+)"', (SOURCE / "lib/include/covol/version.h").read_text())[1]


def files_of(name):
    """{path in the archive: file}"""
    if name == "blender":
        own = sorted((SOURCE / "tools/blender/covol_blender").glob("*.*"))
        return {f"covol_blender/{path.name}": path for path in [*own, *SHARED, SOURCE / "LICENSE"]}
    own = sorted((SOURCE / "tools/slicer").glob("*.py"))
    return {**{path.name: path for path in own}, **{f"CovolLib/{path.name}": path for path in SHARED},
            **{f"CovolLib/{path.name}": path for path in sorted((SOURCE / "tools/slicer/CovolLib").glob("*.py"))}}


def pack(name, folder):
    """Makes the file of a plugin and returns its path."""
    folder.mkdir(parents=True, exist_ok=True)
    if name == "imagej":
        target = folder / "Covol_.ijm"
        shutil.copyfile(SOURCE / "tools/imagej/Covol_.ijm", target)
        return target
    target = folder / f"covol_{name}-{version()}.zip"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for inside, path in files_of(name).items():
            archive.writestr(zipfile.ZipInfo(inside, TIME), path.read_bytes(), zipfile.ZIP_DEFLATED)
    return target


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plugins", nargs="*", metavar="PLUGIN", help="blender, imagej, slicer [all]")
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path("."), help="folder of the files [here]")
    options = parser.parse_args()
    every = ("blender", "imagej", "slicer")
    for name in options.plugins or every:
        if name not in every:
            parser.error(f"{name}: expected one of {', '.join(every)}")
        print(f"pack: wrote {pack(name, options.output)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
