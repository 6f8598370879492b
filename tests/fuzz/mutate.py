"""Damaged files of every format against the real program: none may crash it, hang it or make it use too much memory.

    python3 tests/fuzz/mutate.py --covol BUILD/bin/covol [--seconds 60] [--seed 1] [--formats tif,vdb] [--keep FOLDER]

Files that covol wrote, and those of --more, are changed at random: bytes and bits, numbers in headers set to the limits of their
types, digits in texts, blocks that are removed, duplicated or swapped, truncation. Each is read by `info` and by a command that
reads all of it. A finding is a termination by a signal or exit code 1, more than --limit seconds, or more memory than the
undamaged file takes plus 64 MB plus ten times its size. Findings are kept, and the exit code is 1.
"""
import argparse
import os
import pathlib
import random
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import time

IMAGES = ["nrrd", "mha", "nii", "nii.gz", "tif", "ome.tif", "zarr", "vdb"]
MESHES = ["ply", "obj", "off", "stl", "glb"]
POINTS = ["xyz", "csv"]
ENDS = [struct.pack(kind, value) for kind in ("<H", ">H", "<I", ">I", "<Q", ">Q", "<d", "<f")
        for value in ((0, 1, 2 ** (8 * struct.calcsize(kind)) - 1, 2 ** (8 * struct.calcsize(kind) - 1), 2 ** (8 * struct.calcsize(kind) - 1) - 1)
                      if kind[1] not in "df" else (float("nan"), float("inf"), -1e300 if kind[1] == "d" else -1e30, 0.0))]
NUMBERS = [b"0", b"-1", b"1e308", b"nan", b"2147483648", b"4294967295", b"9223372036854775807", b"18446744073709551616", b"-1e-320", b""]


def seeds_of(covol, folder):
    """Small files as covol writes them: format -> path."""
    def run(*words):
        subprocess.run([covol, *map(str, words), "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    run("phantom", "sphere", "--size", 16, "--count", 300, "-o", "seed.nrrd", "--points", "seed.ply")
    run("segment", "seed.nrrd", "--points", "seed.ply", "-o", "seed.vdb", "--mesh", "seed_mesh.ply")
    found = {"nrrd": folder / "seed.nrrd", "vdb": folder / "seed.vdb"}
    for end in IMAGES[1:-1]:
        run("mask", "seed.vdb", "--like", "seed.nrrd", "-o", f"seed.{end}")
        found[end] = folder / f"seed.{end}"
    for end in MESHES:
        run("mesh", "seed.vdb", "-o", f"surface.{end}")
        found[end] = folder / f"surface.{end}"
    for end in POINTS:
        run("convert", "seed.ply", f"points.{end}")
        found[end] = folder / f"points.{end}"
    return found


def mutate(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        if not data:
            break
        # Two of three changes are in the first or the last 400 bytes, where most formats have their metadata.
        length = len(data)
        at = rng.choice((rng.randrange(length), rng.randrange(min(length, 400)), length - 1 - rng.randrange(min(length, 400))))
        kind = rng.randrange(9)
        if kind == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[at] = rng.randrange(256)
        elif kind in (2, 3):
            end = rng.choice(ENDS)
            data[at:at + len(end)] = end
        elif kind == 4:
            del data[at:]
        elif kind == 5:
            del data[at:at + rng.choice((1, 4, 64, 1000))]
        elif kind == 6:
            block = bytes(data[at:at + rng.choice((1, 8, 100, 5000))])
            data[at:at] = block * rng.choice((1, 2, 20))
        else:  # replaces the next number that is written as text
            text = at
            while text < len(data) and not 48 <= data[text] <= 57:
                text += 1
            end = text
            while end < len(data) and data[end] in b"0123456789.eE+-":
                end += 1
            data[text:end] = rng.choice(NUMBERS)
    return bytes(data)


def damaged(seed, target, rng):
    """A damaged copy at `target`. @return its size"""
    if not seed.is_dir():
        data = mutate(seed.read_bytes(), rng)
        target.write_bytes(data)
        return len(data)
    shutil.copytree(seed, target)
    part = rng.choice([p for p in sorted(target.rglob("*")) if p.is_file()])
    part.write_bytes(mutate(part.read_bytes(), rng))
    return sum(p.stat().st_size for p in target.rglob("*") if p.is_file())


def measure(words, folder, limit):
    """@return exit code (None: over the limit), peak memory in bytes"""
    def bound():
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    before = time.monotonic()
    process = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=bound)
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_maxrss * 1024
        if time.monotonic() - before > limit:
            process.kill()
            process.wait()
            return None, 0
        time.sleep(0.002)


def commands(covol, end, path):
    yield [covol, "info", path, "--quiet"]
    if end in MESHES:
        yield [covol, "check", path, "--quiet"]
    elif end == "vdb":
        yield [covol, "mesh", path, "-o", "out.ply", "--quiet"]
    elif end in POINTS:
        yield [covol, "convert", path, "out.ply", "--quiet"]
    else:
        yield [covol, "convert", path, "out.vdb", "--quiet"]


def fuzz(covol, end, seed, seconds, rng, limit, keep):
    """@return number of files tried, lines of findings"""
    findings, tried = [], 0
    with tempfile.TemporaryDirectory(prefix="covol-fuzz-") as name:
        folder = pathlib.Path(name)
        usual = [measure(words, folder, 60)[1] for words in commands(covol, end, seed)]
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            target = folder / f"d.{end}"
            size = damaged(seed, target, rng)
            tried += 1
            for words, base in zip(commands(covol, end, target), usual):
                code, memory = measure(words, folder, limit)
                wrong = ("too slow" if code is None else f"signal {-code}" if code < 0 else "exit code 1" if code == 1 else
                         f"{memory >> 20} MB" if memory > base + (64 << 20) + 10 * size else "")
                if not wrong:
                    continue
                kept = keep / f"{end.replace('.', '-')}-{tried}.{end}"
                keep.mkdir(parents=True, exist_ok=True)
                if not kept.exists():
                    (shutil.copytree if target.is_dir() else shutil.copy)(target, kept)
                findings.append(f"{end}: {words[1]}: {wrong}: {kept}")
                break
            (shutil.rmtree if target.is_dir() else os.remove)(target)
    return tried, findings


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--covol", required=True)
    parser.add_argument("--seconds", type=float, default=60, help="for each format")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--formats", default="", help="some of them, by commas")
    parser.add_argument("--limit", type=float, default=20, help="seconds that one file may take")
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("fuzz-findings"))
    parser.add_argument("--more", type=pathlib.Path, nargs="*", default=[], help="files to damage, besides")
    options = parser.parse_args()
    covol = os.path.abspath(options.covol)
    found = []
    with tempfile.TemporaryDirectory(prefix="covol-seeds-") as name:
        seeds = seeds_of(covol, pathlib.Path(name))
        seeds.update({"".join(path.suffixes).lstrip("."): path.resolve() for path in options.more})
        for end, seed in seeds.items():
            if options.formats and end not in options.formats.split(","):
                continue
            tried, findings = fuzz(covol, end, seed, options.seconds, random.Random(f"{options.seed} {end}"), options.limit,
                                   options.keep.resolve())
            print(f"{end}: {tried} damaged files, {len(findings)} findings", flush=True)
            found += findings
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
