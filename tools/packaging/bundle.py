#!/usr/bin/python3
"""Makes covol-VERSION-linux-MACHINE.tar.xz: the program with every library that it needs, for any Linux whose C library is at
least as new as the one of the build.

    cmake --preset package && cmake --build build-package --target covol_packed
    /usr/bin/python3 tools/packaging/bundle.py build-package [--output FOLDER] [--level 0..9]

The libraries come from the Debian packages that covol was built with. Each keeps its name and finds the others in the same folder (by
a relative RPATH, which LD_LIBRARY_PATH does not override). The C library is not included: the user's own fits the kernel,
and a copy would not find the machine's users, hosts and locales. `share/doc/covol/FILES.txt` in the bundle names the package, version
and licences of every file, and `share/doc/covol/licences` has their texts. The bundle is reproducible (SOURCE_DATE_EPOCH,
or the time of the last commit, is the time of every file). Needs patchelf, binutils and dpkg.
"""
import argparse
import gzip
import lzma
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
OF_C_LIBRARY = re.compile(r"(ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|anl|mvec|nsl|BrokenLocale|nss_\w+))\.so\.\d+")
COMPONENTS = ("program", "licence")


def fail(message):
    raise SystemExit(f"bundle: {message}")


def run(*words, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **more)
    if done.returncode != 0:
        fail(f"{' '.join(str(word) for word in words)} ended with {done.returncode}: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


def needed_by(path):
    """Names of the shared libraries that a file needs directly."""
    return re.findall(r"\(NEEDED\)\s+Shared library: \[([^]]+)\]", run("readelf", "-dW", path))


def is_elf(path):
    with open(path, "rb") as file:
        return file.read(4) == b"\x7fELF"


def resolved_by(path):
    """{name: path} of all shared libraries that a file needs, directly or not, as found by the dynamic loader."""
    found = dict(re.findall(r"^\s*(\S+) => (/\S+)", run("ldd", path), re.M))
    missing = re.findall(r"^\s*(\S+) => not found", run("ldd", path), re.M)
    if missing:
        fail(f"{path} needs {', '.join(missing)}, which this machine does not have")
    return found


def add_libraries(root):
    """Copies the libraries that the program needs, directly or not, into lib; returns {copy: original path}."""
    lib, origins = root / "lib", {}
    for user in [path for path in root.rglob("*") if path.is_file() and not path.is_symlink() and is_elf(path)]:
        for name, place in resolved_by(user).items():
            if not OF_C_LIBRARY.fullmatch(name) and not (lib / name).exists():
                shutil.copyfile(os.path.realpath(place), lib / name)
                origins[lib / name] = os.path.realpath(place)
    return origins


def set_paths(root):
    """Sets relative RPATHs for the libraries, and file modes as in a package."""
    for path in root.rglob("*"):
        if path.is_symlink() or not path.is_file():
            continue
        if is_elf(path):
            path.chmod(0o755)
            run("strip", "--strip-unneeded", path)
            to_lib = os.path.relpath(root / "lib", path.parent)
            run("patchelf", "--force-rpath", "--set-rpath", "$ORIGIN" if to_lib == "." else f"$ORIGIN/{to_lib}", path)
        is_program = path.parent.name == "bin" or is_elf(path)
        path.chmod(0o755 if is_program else 0o644)


def check_closed(root):
    """Checks that every needed library is in the bundle or belongs to the C library."""
    there = {path.name for path in (root / "lib").iterdir()}
    for path in root.rglob("*"):
        if path.is_file() and not path.is_symlink() and is_elf(path):
            for name in needed_by(path):
                if name not in there and not OF_C_LIBRARY.fullmatch(name):
                    fail(f"{path.relative_to(root)} needs {name}, which is not in the bundle")


def newest_c_library(root):
    """The minimum version of glibc that the bundle needs."""
    versions = set()
    for path in root.rglob("*"):
        if path.is_file() and not path.is_symlink() and is_elf(path):
            versions |= set(re.findall(r"\bGLIBC_(\d+(?:\.\d+)+)", run("readelf", "-VW", path)))
    return max(versions, key=lambda v: [int(n) for n in v.split(".")])


def packages_of(origins):
    """{copy: (package, version)}"""
    candidates = {origin: [origin, origin.removeprefix("/usr") if origin.startswith("/usr/lib") else "/usr" + origin]
                  for origin in origins.values()}
    # One call for all paths, because each call reads the file lists of all installed packages. The exit code is not checked: it is 1 if
    # dpkg does not know a path, and dpkg knows most libraries by only one of their two paths, with or without /usr.
    done = subprocess.run(["dpkg", "-S", *(path for paths in candidates.values() for path in paths)], capture_output=True, text=True)
    owners = dict(reversed(line.split(": ", 1)) for line in done.stdout.splitlines())
    found = {}
    for copy, origin in origins.items():
        found[copy] = next((owners[path] for path in candidates[origin] if path in owners), None)
        if not found[copy]:
            fail(f"{origin} is of no Debian package, so its licence is not known")
    rows = run("dpkg-query", "-W", "-f", "${binary:Package}\t${Version}\n", *sorted(set(found.values()))).splitlines()
    versions = dict(row.split("\t") for row in rows)
    return {copy: (package, versions[package]) for copy, package in found.items()}


def licence_names(text):
    """The short names of the licences in a copyright file; if it does not follow Debian's format, a reference to it."""
    names = dict.fromkeys(name.strip() for name in re.findall(r"^License:[ \t]*(\S[^\n]*)$", text, re.M))
    return ", ".join(names) or "as its copyright file says"


def write_licences(root, origins):
    doc = root / "share/doc/covol"
    texts = doc / "licences"
    texts.mkdir(parents=True, exist_ok=True)
    common = pathlib.Path("/usr/share/common-licenses")
    for path in sorted(common.iterdir()):  # full texts of licences, to which the packages' copyright files refer
        shutil.copyfile(os.path.realpath(path), texts / f"common-{path.name}")
    rows = []
    for copy, (package, version) in sorted(packages_of(origins).items()):
        name = package.split(":")[0]
        folder = pathlib.Path("/usr/share/doc") / name
        sources = [folder / "copyright", folder / "copyright.gz"]
        source = next((path for path in sources if path.exists()), None)
        if not source:
            fail(f"{package} has no copyright file in {folder}")
        text = (gzip.open(source, "rt") if source.suffix == ".gz" else open(source, encoding="utf-8", errors="replace")).read()
        (texts / name).write_text(text)
        rows.append((copy.relative_to(root), f"{name} {version}", licence_names(text)))
    listed = {row[0] for row in rows}
    own = "covol", "Apache-2.0, with code of CGAL: as a whole under GPL-3+"
    for path in sorted(path.relative_to(root) for path in root.rglob("*") if path.is_file()):
        if path not in listed and path.parent != texts.relative_to(root):
            rows.append((path, own[0], "CC0-1.0") if path.name == "celegans_embryo.tif" else (path, *own))
    lines = [f"{path}\t{package}\t{licences}" for path, package, licences in sorted(rows, key=lambda row: str(row[0]))]
    (doc / "FILES.txt").write_text("file\tpackage\tlicences (texts in share/doc/covol/licences)\n" + "\n".join(lines) + "\n")
    shutil.copyfile(SOURCE / "docs/licences.md", doc / "licences.md")


def epoch():
    if "SOURCE_DATE_EPOCH" in os.environ:
        return int(os.environ["SOURCE_DATE_EPOCH"])
    done = subprocess.run(["git", "-C", SOURCE, "log", "-1", "--format=%ct"], capture_output=True, text=True)
    return int(done.stdout) if done.returncode == 0 else 0


def pack(root, path, level):
    time = epoch()

    def plain(info):
        info.uid = info.gid = 0
        info.uname = info.gname = "root"
        info.mtime = time
        return info

    partial = path.with_name(path.name + ".part")
    with lzma.open(partial, "wb", preset=level) as file, tarfile.open(fileobj=file, mode="w", format=tarfile.GNU_FORMAT) as tar:
        for entry in [root, *sorted(root.rglob("*"))]:
            tar.add(entry, entry.relative_to(root.parent), recursive=False, filter=plain)
    partial.replace(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, help="folder of the build")
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path("."), help="folder of the bundle [here]")
    parser.add_argument("--level", type=int, default=9, choices=range(10), help="of xz [9]")
    options = parser.parse_args()
    for tool in ("patchelf", "readelf", "strip", "ldd", "dpkg", "cmake"):
        if not shutil.which(tool):
            fail(f"{tool} is missing; install it (patchelf, binutils, dpkg, cmake)")
    build = options.build.resolve()
    if not (build / "cmake_install.cmake").exists():
        fail(f"{build}: expected the folder of a build of covol")
    with tempfile.TemporaryDirectory(prefix="covol-bundle-") as work:
        staged = pathlib.Path(work) / "staged"
        for component in COMPONENTS:
            run("cmake", "--install", build, "--prefix", staged, "--component", component)
        version = run(staged / "bin/covol", "--version").split()[1]
        name = f"covol-{version}-linux-{os.uname().machine}"
        root = staged.rename(pathlib.Path(work) / name)
        flatten(root)
        origins = add_libraries(root)
        set_paths(root)
        check_closed(root)
        write_licences(root, origins)
        c_library = newest_c_library(root)
        (root / "README.txt").write_text(README.format(version=version, c_library=c_library))
        (root / "README.txt").chmod(0o644)
        options.output.mkdir(parents=True, exist_ok=True)
        path = options.output / f"{name}.tar.xz"
        pack(root, path, options.level)
        unpacked = sum(file.stat().st_size for file in root.rglob("*") if file.is_file())
    print(f"bundle: wrote {path}: {path.stat().st_size / 1e6:.1f} MB, {unpacked / 1e6:.1f} MB unpacked, "
          f"{len(origins)} libraries, glibc {c_library} or later")
    return 0


def flatten(root):
    """Moves Debian's lib/MACHINE-linux-gnu to lib, so that all libraries of the bundle are in one folder."""
    for folder in (root / "lib").glob("*-linux-gnu"):
        for path in folder.iterdir():
            path.rename(root / "lib" / path.name)
        folder.rmdir()


README = """covol {version}: surfaces of structures in 3D images, and of point clouds

    bin/covol mark stack.tif          click marks in the browser, and see the surface
    bin/covol segment --help          the same without a page

Nothing has to be installed: the folder may lie anywhere, and bin/covol may be linked from a folder of your PATH. It needs
Linux with glibc {c_library} or later. Manual pages are in share/man, completions for bash, zsh and fish in share.
What every file is and its licence: share/doc/covol/FILES.txt.
"""


if __name__ == "__main__":
    sys.exit(main())
