"""Seeded faults in all modules: which of them do the unit tests find?

    /usr/bin/python3 tests/mutants/mutants.py --work FOLDER [--count 50] [--seed 1] [--only N ...] [--preset ci]

Clones the repository's last commit into FOLDER, builds its unit tests there, and then changes one operator or constant at a time,
builds the tests of that module, and runs them. A fault that does not compile is replaced by another one. Prints a line for each
fault and, at the end, those that no test found: gaps in the tests, or changes without effect (a bound that is never met with
equality). Each fault depends only on its number: --only 7 31 repeats these two, as long as their files are unchanged. With
--preset asan the sanitizers find faults, too, and the tests of the program are left out.
"""
import argparse
import functools
import os
import pathlib
import random
import re
import resource
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# {source: programs of its tests}. One third of the faults is made in KERNELS, one third in READERS, and one third in
# other modules.
KERNELS = {
    "scheme/scheme_kernels.cpp": ["kernels_test", "scheme_test", "scheme_kernels_test", "evolve_test"],
    "scheme/scheme.cpp": ["kernels_test", "scheme_test", "scheme_kernels_test", "evolve_test"],
    "evolve/band_solver.cpp": ["evolve_test", "evolve_property_test", "sphere_curvature_test"],
    "evolve/motion.cpp": ["evolve_test", "evolve_property_test"],
    "evolve/evolve.cpp": ["evolve_test", "evolve_property_test", "advection_test"],
    "distance/nearest_kernel.cpp": ["nearest_kernel_test", "distance_test", "distance_property_test"],
    "distance/distance.cpp": ["distance_test", "distance_property_test"],
    "redistance/patch_kernel.cpp": ["surface_test", "evolve_test"],
    "redistance/redistance.cpp": ["surface_test", "evolve_test"],
    "tagging/band.cpp": ["band_test", "tag_distance_property_test"],
    "tagging/closing.cpp": ["closing_test", "band_test"],
    "edge/edge.cpp": ["edge_test"],
    "surface/surface_mesh.cpp": ["extract_test", "surface_test", "mesh_property_test"],
    "grid/leaf_band.cpp": ["evolve_test", "distance_test"],
}
READERS = {
    "io/pixels/raw_image.cpp": ["image_test", "image_chunks_test", "image_view_test", "image_roi_test"],
    "io/pixels/nifti_space.cpp": ["image_test", "image_formats_test", "cli/alignment_test"],
    "io/ics/ics.cpp": ["ics_test", "cli/image_formats_test"],
    "io/image/mrc.cpp": ["image_test", "image_formats_test", "cli/image_formats_test", "cli/interchange_test"],
    "io/image/npy.cpp": ["image_test", "image_formats_test", "image_python_test", "cli/image_formats_test", "cli/interchange_test"],
    "io/image/tiff_pages.cpp": ["image_test", "image_chunks_test", "cli/image_formats_test", "cli/alignment_test"],
    "io/image/tiff_stack.cpp": ["image_test", "image_chunks_test", "image_python_test", "cli/image_formats_test", "cli/alignment_test"],
    "io/dicom/dicom_header.cpp": ["image_test", "image_formats_test", "cli/image_formats_test", "cli/interchange_test"],
    "io/chunked/zarr_array.cpp": ["zarr_test", "chunked_voxels_test", "cli/zarr_test"],
    "io/chunked/zarr_chunks.cpp": ["zarr_test", "chunked_voxels_test", "cli/zarr_test"],
    "io/chunked/array_chunks.cpp": ["zarr_test", "chunked_voxels_test", "cli/hdf5_test"],
    "io/points/programs/cell_counter.cpp": ["point_formats_test", "point_programs_test"],
    "io/points/programs/fiji_roi.cpp": ["points_test", "point_formats_test", "point_programs_test"],
    "io/points/programs/zip.cpp": ["points_test", "point_formats_test"],
    "io/points/point_columns.cpp": ["points_test", "point_formats_test", "points_check_test"],
    "io/points/point_scans.cpp": ["point_formats_test", "point_normals_test"],
    "io/points/programs/slicer_markups.cpp": ["points_test", "point_formats_test", "point_programs_test"],
    "io/mesh/ply.cpp": ["mesh_io_test", "point_formats_test"],
    "io/mesh/stl.cpp": ["mesh_io_test"],
    "io/mesh/obj.cpp": ["mesh_io_test"],
    "io/mesh/glb.cpp": ["mesh_io_test"],
}


@functools.cache
def others(source):
    """The sources of all other modules, with the test programs in the folder of tests/unit that has the module's name."""
    found = {}
    for path in sorted((source / "lib/src").rglob("*.cpp")):
        name = path.relative_to(source / "lib/src").as_posix()
        folder = source / "tests/unit" / pathlib.PurePath(name).parent
        if not any(folder.glob("*_test.cpp")):
            folder = folder.parent
        tests = sorted(test.stem for test in folder.glob("*_test.cpp"))
        if tests and folder != source / "tests/unit" and name not in {**KERNELS, **READERS}:
            found[name] = tests
    return found


FAULTS = [
    (r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "),
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " + "), (r" && ", " || "), (r" \|\| ", " && "),
    (r"std::min\(", "std::max("), (r"std::max\(", "std::min("), (r"\b0\.5\b", "0.6"), (r"\b1\b", "2"), (r"\b2\b", "3"),
    (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r" \+= ", " -= "), (r"if \(!", "if ("),
]
SKIPPED = re.compile(r"^\s*(//|/\*|#|using|namespace|template|static_assert|include)|throw |Error\(|run\.report|k\w+ = |\bline\(|memory|reserve")
# Limit of CPU time for a test, because a fault may cause an endless loop; unlike wall clock time, it does not depend on
# other load.
SECONDS = 120
BYTES = 12 << 30  # limit of address space for a test, because a fault may cause an absurd size
# Limit in seconds of wall clock time for a test that waits forever; long, because a test may be stopped for some time.
WAITING = 3600


@functools.cache
def faults_in(path):
    """(line, column, old, new) of each position at which one of the faults can be made."""
    found, text = [], path.read_text().splitlines()
    for number, line in enumerate(text):
        if SKIPPED.search(line):
            continue
        code = re.sub(r'"(\\.|[^"\\])*"', lambda m: "\0" * len(m.group()), line.split(" //")[0])
        for pattern, new in FAULTS:
            for match in re.finditer(pattern, code):
                found.append((number, match.start(), match.group(), new))
    return found


class Build:
    def __init__(self, folder, preset):
        self.source, self.build, self.preset = folder / "source", folder / f"source/build-{preset}", preset

    def make(self):
        if not self.source.exists():
            subprocess.run(["git", "clone", "-q", ROOT, self.source], check=True)
        subprocess.run(["cmake", "--preset", self.preset], cwd=self.source, check=True, stdout=subprocess.DEVNULL)
        # A run that was interrupted may have left its fault in the source.
        subprocess.run(["git", "-C", self.source, "checkout", "-q", "--", "lib"], check=True)
        names = (*KERNELS, *READERS, *others(self.source))
        for name in names:
            (self.source / "lib/src" / name).touch()
        tests = sorted({test for name in names for test in self.tests_of(name)})
        if not self.compile(tests):
            sys.exit("the tests do not build")
        for test in tests:
            if not self.passes(test):
                sys.exit(f"{test} fails without a fault")

    def tests_of(self, name):
        return [test for test in {**others(self.source), **KERNELS, **READERS}[name] if self.preset != "asan" or not test.startswith("cli/")]

    def compile(self, tests):
        targets = sorted({"covol_tool" if test.startswith("cli/") else test for test in tests})
        return subprocess.run(["ninja", "-C", self.build, *targets], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0

    def limit(self):
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        if self.preset != "asan":  # asan reserves terabytes of address space
            resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))

    def passes(self, test):
        command, folder = [self.build / "tests" / test, "-a"], self.build / "tests"
        if test.startswith("cli/"):
            command, folder = ["/usr/bin/python3", "-m", "unittest", "-f", test[4:]], self.source / "tests/cli"
        try:
            return subprocess.run(command, cwd=folder, env={**os.environ, "COVOL": str(self.build / "bin/covol")}, timeout=WAITING,
                                  preexec_fn=self.limit, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
        except subprocess.TimeoutExpired:
            return False

    def try_fault(self, name, tests, fault):
        """@return the test that found it, "" if none did, None if it does not compile"""
        path = self.source / "lib/src" / name
        original = path.read_text()
        lines = original.splitlines(keepends=True)
        number, column, old, new = fault
        lines[number] = lines[number][:column] + new + lines[number][column + len(old):]
        path.write_text("".join(lines))
        try:
            if not self.compile(tests):
                return None
            return next((test for test in tests if not self.passes(test)), "")
        finally:
            path.write_text(original)


def draws(sources, seed, n):
    """One (file, fault) after another for fault number n; kernels, readers and other modules take turns."""
    chance, modules = random.Random(f"{seed}:{n}"), (KERNELS, READERS, others(sources.parents[1]))[n % 3]
    while True:
        name = chance.choice(sorted(modules))
        if places := faults_in(sources / name):
            yield name, chance.choice(places)


def fault_of(build, seed, n):
    """@return a description of fault number n, and the test that found it"""
    sources = build.source / "lib/src"
    earlier = {next(draws(sources, seed, before)) for before in range(1, n)}
    for name, fault in draws(sources, seed, n):
        tests = build.tests_of(name)
        by = None if (name, fault) in earlier else build.try_fault(name, tests, fault)
        if by is not None:
            number, column, old, new = fault
            line = (sources / name).read_text().splitlines()[number].strip()
            return f"{name}:{number + 1}:{column + 1}: '{old.strip()}' to '{new.strip()}' in: {line}", by


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, nargs="+")
    parser.add_argument("--preset", default="ci")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    build = Build(options.work.resolve(), options.preset)
    build.make()
    found, survived = 0, []
    numbers = options.only or range(1, options.count + 1)
    for n in numbers:
        text, by = fault_of(build, options.seed, n)
        print(f"{n}: {by or 'SURVIVED'}: {text}", flush=True)
        if by:
            found += 1
        else:
            survived.append(f"{n}: {text}")
    print(f"{found} of {len(numbers)} found; not found:", *survived, sep="\n  ")


if __name__ == "__main__":
    main()
