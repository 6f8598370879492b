#!/usr/bin/python3
"""Makes covol-VERSION-py3-none-manylinux_GLIBC_MACHINE.whl from the bundle: the program, and a package for every Python from 3.9 on.

    /usr/bin/python3 tools/packaging/wheel.py covol-0.1.0-linux-x86_64.tar.xz [--output FOLDER] [--level 0..9]
    pip install covol-0.1.0-py3-none-manylinux_2_36_x86_64.whl

The package has the same interface as the module that is compiled for Debian's Python, and shares its Python files; the compiled part
is replaced by tools/python/program, which runs the program in covol/program. The wheel is reproducible. Standard library only.
"""
import argparse
import base64
import hashlib
import pathlib
import re
import sys
import tarfile
import tempfile
import time
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
LEFT_OUT = ("share/man/", "share/bash-completion/", "share/zsh/", "share/fish/", "README.txt")  # shells and man do not search for these files in a Python package
METADATA = """Metadata-Version: 2.1
Name: covol
Version: {version}
Summary: Surfaces of structures in 3D images from a few marks, and of point clouds without normals
License: Apache-2.0; with code of CGAL, as a whole under GPL-3.0-or-later
Requires-Python: >=3.9
Requires-Dist: numpy
Classifier: Environment :: Console
Classifier: Operating System :: POSIX :: Linux
Classifier: Programming Language :: Python :: 3
Classifier: Topic :: Scientific/Engineering :: Image Processing
Description-Content-Type: text/markdown

{description}"""
DESCRIPTION = """covol finds the surface of a structure in a 3D image with the help of a few marked points, and the surface behind a
point cloud without normals, on sparse OpenVDB level sets.

```python
import covol

result = covol.segment(volume, marks, spacing=(0.35, 0.35, 1.0))  # volume: (nz, ny, nx), marks: (n, 3), x, y, z
result.mask            # uint8, of the volume's shape
result.mesh.vertices   # (m, 3), x, y, z
result.save("cell.vdb")
```

The command `covol` comes with it: `covol demo`, `covol mark stack.tif`. No GPU, no weights, no account; nothing leaves the machine.
"""


def fail(message):
    raise SystemExit(f"wheel: {message}")


def digest(data):
    return "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def files_of_program(root):
    """(name, bytes, executable) of the files that the program needs. Zip files have no links: the name that is needed gets the content."""
    targets = {}
    for path in sorted(root.rglob("*")):
        if path.is_symlink():
            targets.setdefault(path.resolve(), []).append(path)
    renamed = {}
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        if path.is_symlink() or not path.is_file() or name.startswith(LEFT_OUT) or name == "share/doc/covol/FILES.txt":
            continue
        names = [link.relative_to(root).as_posix() for link in targets.get(path, [])] or [name]
        renamed[name] = names
        for each in names:
            yield each, path.read_bytes(), bool(path.stat().st_mode & 0o100)
    rows = (root / "share/doc/covol/FILES.txt").read_text().splitlines()
    kept = [rows[0]]
    for row in rows[1:]:
        name, tab, rest = row.partition("\t")
        kept += [each + tab + rest for each in renamed.get(name, [])]
    yield "share/doc/covol/FILES.txt", ("\n".join(kept) + "\n").encode(), False


def files_of_package(version):
    for folder in ("covol", "program"):
        for path in sorted((SOURCE / "tools/python" / folder).iterdir()):
            if path.suffix in (".py", ".pyi", ".typed") or path.name == "py.typed":
                yield path.name, path.read_bytes()
    yield "_version.py", f'"""Made by tools/packaging/wheel.py."""\n__version__ = "{version}"\n'.encode()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=pathlib.Path, help="covol-VERSION-linux-MACHINE.tar.xz, as bundle.py makes it")
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path("."), help="folder of the wheel [here]")
    parser.add_argument("--level", type=int, default=6, choices=range(10), help="of deflate [6]")
    options = parser.parse_args()
    named = re.fullmatch(r"covol-([0-9.]+)-linux-(\w+)\.tar\.xz", options.bundle.name)
    if not named:
        fail(f"{options.bundle}: expected covol-VERSION-linux-MACHINE.tar.xz, as bundle.py names it")
    version, machine = named.groups()
    with tempfile.TemporaryDirectory(prefix="covol-wheel-") as work:
        with tarfile.open(options.bundle) as tar:
            times = {entry.mtime for entry in tar.getmembers()}
            tar.extractall(work)  # the archive is trusted: bundle.py made it on this machine
        [root] = pathlib.Path(work).iterdir()
        c_library = re.search(r"glibc (\d+)\.(\d+)", (root / "README.txt").read_text())
        if not c_library:
            fail(f"{options.bundle}: its README.txt does not say which glibc it needs")
        tag = f"py3-none-manylinux_{c_library[1]}_{c_library[2]}_{machine}"
        about = f"covol-{version}.dist-info"
        entries = [(f"covol/{name}", data, False) for name, data in files_of_package(version)]
        entries += [(f"covol/program/{name}", data, mode) for name, data, mode in files_of_program(root)]
        entries += [(f"{about}/{name}", text.encode(), False) for name, text in [
            ("METADATA", METADATA.format(version=version, description=DESCRIPTION)),
            ("WHEEL", f"Wheel-Version: 1.0\nGenerator: covol wheel.py\nRoot-Is-Purelib: false\nTag: {tag}\n"),
            ("entry_points.txt", "[console_scripts]\ncovol = covol._program:main\n"), ("top_level.txt", "covol\n"),
            ("licenses/LICENSE", (SOURCE / "LICENSE").read_text()), ("licenses/licences.md", (SOURCE / "docs/licences.md").read_text())]]
        record = "".join(f"{name},{digest(data)},{len(data)}\n" for name, data, _ in entries) + f"{about}/RECORD,,\n"
        entries.append((f"{about}/RECORD", record.encode(), False))
    stamp = time.gmtime(max(max(times), 315532800))[:6]  # seconds, 1980-01-01: zip files cannot store earlier times
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f"covol-{version}-{tag}.whl"
    partial = path.with_name(path.name + ".part")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, data, executable in entries:
            info = zipfile.ZipInfo(name, stamp)
            info.external_attr = (0o100755 if executable else 0o100644) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(info, data, compresslevel=options.level)
    partial.replace(path)
    print(f"wheel: wrote {path}: {path.stat().st_size / 1e6:.1f} MB, {len(entries)} files, glibc {c_library[1]}.{c_library[2]} or later")
    return 0


if __name__ == "__main__":
    sys.exit(main())
