"""Rules that the compiler does not check: includes go down only, public headers include little, lib/ prints nothing.

    python3 tests/lint/layers_test.py SOURCE_DIR
"""
import pathlib
import re
import sys

# Levels from the lowest to the highest: {folder of lib/src: public headers that it implements}. A file may include
# headers of its own folder and of lower levels, but not of another folder of the same level.
LAYERS = [
    {"base": ["api", "version", "fwd", "error", "option_names", "options_table", "run", "domain", "safe_text"], "scheme": []},
    {"files": ["file_set", "digest"], "limits": []},
    {"grid": [], "mesh": ["mesh"], "io": ["vdb_io"], "io/pixels": ["image"]},
    {"image": ["image_stream", "image_levels", "points", "slice_contours"], "io/chunked": [], "io/modules": ["reader_parts"]},
    {"io/hdf5": []},
    {"io/image": [], "io/mesh": ["mesh_io"], "distance": ["distance"]},
    {"io/dicom": [], "io/ics": [], "io/reader": [], "io/points": ["points_text", "point_array", "mark_kinds", "point_structures"], "clip": ["clip"], "edge": ["edge"], "redistance": []},
    {"io/points/programs": [], "io/write": ["program_marks"], "points": ["scan_noise", "cloud_cleanup"], "surface": ["surface", "mesh_stream"], "evolve": ["evolve", "checkpoints"], "tagging": ["band"], "cloud/poisson": []},
    {"contours": ["contours", "seeds"], "meshing": ["mesh_relax", "mesh_cleanup"], "holes": ["holes"], "cloud/indicator": ["orientation"]},
    {"cloud/orientation": [], "start": ["start", "level_set"], "painted": ["painted"], "analysis": ["compare", "evidence", "structures", "phantom", "intensity", "solid_measures"], "render/draw": ["picture"]},
    {"io/read": ["image_files"], "guess": ["guess", "guess_correction"], "cloud/surface": ["cloud_surface"], "report": ["report_page", "page_data"], "render": ["render"]},
    {"guidance": ["guidance", "motion"], "inference": ["inference"]},
    {"segment": ["pipeline"], "segment/start": [], "segment/solve": [], "segment/result": []},
    {"bricks": ["bricks"], "marks": ["marks"]},
    {"io/inputs": ["file_kind", "read_marks"], "structures": ["segment_structures"]},
    {"study": ["study", "study_solver"]},
    {"io/study": ["study_files"]},
]
LEVEL = {folder: level for level, folders in enumerate(LAYERS) for folder in folders}
FOLDER = {header: folder for folders in LAYERS for folder, headers in folders.items() for header in headers}
MAX_FILES, MAX_LINES = 20, 500
# The same for the modules of segment(), from the lowest level to the highest. segment/pipeline.cpp is above all of
# them.
PIPELINE = [
    ["heuristics", "options", "problem", "step", "vanished"],
    ["choices"],
    ["start_surface"],
    ["doubts", "fields"],
    ["starts", "named_start", "grown_start", "guess_start", "cloud_start", "corrected_start", "seed_start", "contour_start", "tagged_start"],
    ["flow"],
    ["coarse_level"],
    ["solve"],
    ["final_surface", "mark_fit"],
    ["report"],
]
PIPELINE_LEVEL = {name: level for level, names in enumerate(PIPELINE) for name in names}
SEGMENT = {"segment", "segment/start", "segment/solve", "segment/result"}
HEAVY = re.compile(r"#\s*include\s*[<\"](openvdb/(?!version\.h)|tbb/|oneapi/|OpenMesh/|CGAL/|itk|CLI/|nlohmann/)")
LOUD = re.compile(r"\bstd::(cout|cerr|clog)\b|(?<![\w:])(printf|puts|putchar)\s*\(|\bfprintf\s*\(\s*std(out|err)"
                  r"|(?<![\w.])(std::|::)?(exit|_Exit|quick_exit|abort|terminate)\s*\(")
GPL_FILES = {"cloud_cleanup.cpp", "convex_hull.cpp", "mesh_cleanup.cpp", "mesh_distance.cpp"}
# Folders with readers and writers, which are built only with COVOL_IO; the core must not include their headers.
READERS = {"io/chunked", "io/dicom", "io/hdf5", "io/ics", "io/image", "io/inputs", "io/modules", "io/points", "io/points/programs", "io/read", "io/reader", "io/study", "io/write"}
ROW = re.compile(r"^\| (\d+) \| `([\w/]+)` \| .", re.M)  # a row of the table in docs/architecture.md: level, folder
INCLUDE = re.compile(r"#\s*include\s*\"([\w/]+)\.h\"")


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)


def folder_of(path, root):
    """The level of a source or a header; None if it is not in LAYERS."""
    if path.parent.name == "covol":
        return FOLDER.get(path.stem)
    folder = path.parent.relative_to(root / "lib/src").as_posix()
    return folder if folder in LEVEL else None


def misplaced(path, include, root):
    """The reason why this file may not include that header; None if it may."""
    own = folder_of(path, root)
    folder, name = include.rsplit("/", 1) if "/" in include else ("", include)
    other = FOLDER.get(name) if folder == "covol" else folder if folder in LEVEL else None
    if own is None or other is None:
        return "has no place in LAYERS"
    if folder in READERS and own not in READERS:
        return "the core includes a reader"
    if LEVEL[other] > LEVEL[own] or (LEVEL[other] == LEVEL[own] and other != own and not {own, other} <= SEGMENT):
        return "includes upward"
    if own in SEGMENT and folder in SEGMENT:
        levels = [PIPELINE_LEVEL.get(name), len(PIPELINE) if path.stem == "pipeline" else PIPELINE_LEVEL.get(path.stem)]
        return "has no level in PIPELINE" if None in levels else "includes upward" if levels[0] > levels[1] else None
    return None


def findings(root):
    public = sorted((root / "lib/include/covol").glob("*.h"))
    sources = sorted((root / "lib/src").rglob("*.cpp")) + sorted((root / "lib/src").rglob("*.h"))
    if len(public) < 10 or len(sources) < 10:
        yield f"{root}: expected the sources of covol"
    for path in public:
        if path.stem not in FOLDER:
            yield f"{path}: has no layer; add it to LAYERS"
        if not path.read_text().startswith("#pragma once"):
            yield f"{path}:1: expected #pragma once"
    shown = {folder: int(level) for level, folder in ROW.findall((root / "docs/architecture.md").read_text())}
    for folder in sorted(LEVEL.keys() | shown.keys()):
        if shown.get(folder) != LEVEL.get(folder):
            yield f"docs/architecture.md: {folder}: expected level {LEVEL.get(folder)}, got {shown.get(folder)}"
    for folder in LEVEL:
        count = sum(path.is_file() for path in (root / "lib/src" / folder).glob("*"))
        if not 0 < count <= MAX_FILES:
            yield f"lib/src/{folder}: expected 1 to {MAX_FILES} files, got {count}"
    for path in public + sources:
        if (lines := path.read_text().count("\n")) > MAX_LINES:
            yield f"{path.relative_to(root)}: {lines} lines, expected {MAX_LINES} at most"
        for number, line in enumerate(without_comments(path.read_text()).splitlines(), 1):
            where = f"{path.relative_to(root)}:{number}"
            include = INCLUDE.search(line)
            if include and (why := misplaced(path, include.group(1), root)):
                yield f"{where}: {why}: {line.strip()}"
            if path in public and HEAVY.search(line):
                yield f"{where}: a public header includes {line.strip()}"
            if "CGAL/" in line and "#" in line and path.name not in GPL_FILES:
                yield f"{where}: CGAL outside the covol_cgal target: {line.strip()}"
            if LOUD.search(line):
                yield f"{where}: prints or ends the program: {line.strip()}"


def self_test():
    """Checks that the patterns match what they should."""
    assert HEAVY.search('#include <openvdb/openvdb.h>') and not HEAVY.search("#include <openvdb/version.h>")
    for loud in ('std::cout << 1;', 'printf("x");', "std::exit(1);", "fprintf(stderr, 1);", "abort();"):
        assert LOUD.search(loud), loud
    root = pathlib.Path("/r")
    fields, solve, edge = (root / "lib/src" / name for name in ("segment/solve/fields.cpp", "segment/pipeline.cpp", "edge/edge.cpp"))
    assert not misplaced(fields, "segment/problem", root) and not misplaced(solve, "segment/solve/flow", root) and not misplaced(edge, "grid/halo", root)
    assert misplaced(fields, "segment/solve/flow", root) and misplaced(solve, "segment/none", root)
    assert misplaced(edge, "segment/problem", root) and misplaced(edge, "covol/pipeline", root) and misplaced(edge, "nowhere/x", root)
    assert misplaced(edge, "redistance/redistance", root)  # on the same level as edge, but in another folder
    for quiet in ('std::snprintf(text, 3, "x");', "run.exit_code(3);", "std::fprintf(file, 1);"):
        assert not LOUD.search(quiet), quiet


if __name__ == "__main__":
    self_test()
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
