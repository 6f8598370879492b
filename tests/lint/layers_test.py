"""Rules that the compiler does not check: includes go down only, public headers stay light, lib/ keeps quiet.

    python3 tests/lint/layers_test.py SOURCE_DIR
"""
import pathlib
import re
import sys

# From the bottom up; a file may include headers of its own layer and of those below.
LAYERS = [
    ["error", "run", "fwd", "domain"],
    ["image", "clip", "points", "mesh", "vdb_io", "mesh_io"],
    ["contours", "seeds"],
    ["painted"],
    ["distance", "edge", "scan_noise", "orientation"],
    ["band", "evolve"],
    ["guess", "guess_correction"],
    ["surface", "mesh_relax", "mesh_cleanup", "cloud_cleanup", "compare"],
    ["structures", "evidence", "guidance", "cloud_surface", "holes"],
    ["pipeline", "phantom", "render"],
]
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}
# Files of lib/src whose name is not their header's.
SOURCE_LEVEL = {"contour_solid": LEVEL["contours"], "points_check": LEVEL["points"], "image_sampling": LEVEL["image"], "image_statistics": LEVEL["image"], "image_write": LEVEL["image"],
                "outline": LEVEL["painted"], "segments": LEVEL["painted"], "start_from_seeds": LEVEL["band"],
                "tag_distance": LEVEL["band"], "start": LEVEL["band"], "surface_mesh": LEVEL["surface"],
                "mesh_distance": LEVEL["surface"], "triangle": LEVEL["mesh"], "corner_table": LEVEL["mesh"], "contacts": LEVEL["mesh"], "edge_collapser": LEVEL["mesh"], "safe_moves": LEVEL["mesh"], "decimate": LEVEL["surface"], "level": LEVEL["surface"], "relax": LEVEL["surface"], "clipped": LEVEL["clip"], "open_ends": LEVEL["clip"],
                "grow": LEVEL["band"], "cloud_scale": LEVEL["orientation"], "winding_field": LEVEL["orientation"],
                "point_cells": LEVEL["orientation"], "neighbours": LEVEL["orientation"], "local_fit": LEVEL["orientation"],
                "stray": LEVEL["orientation"],
                "areas": LEVEL["orientation"], "indicator": LEVEL["orientation"], "views": LEVEL["orientation"],
                "vector": LEVEL["orientation"], "median": LEVEL["orientation"], "hold_topology": LEVEL["cloud_surface"],
                "lattice_kernel": LEVEL["orientation"], "fit_kernel": LEVEL["orientation"], "blend_kernel": LEVEL["cloud_surface"], "given_sides": LEVEL["orientation"],
                "cut": LEVEL["holes"], "membrane": LEVEL["holes"]}
# The modules of segment(), lib/src/pipeline, in the same way; lib/src/pipeline.cpp is above them all.
PIPELINE = [
    ["job", "options"],
    ["automatic", "fields"],
    ["doubts"],
    ["starts", "given_start", "grown_start", "guess_start", "cloud_start", "corrected_start", "seed_start", "contour_start", "tagged_start", "flow"],
    ["final_surface"],
    ["coarse_level"],
]
PIPELINE_LEVEL = {name: level for level, names in enumerate(PIPELINE) for name in names}
HEAVY = re.compile(r"#\s*include\s*[<\"](openvdb/(?!version\.h)|tbb/|oneapi/|OpenMesh/|CGAL/|itk|CLI/|nlohmann/)")
LOUD = re.compile(r"\bstd::(cout|cerr|clog)\b|(?<![\w:])(printf|puts|putchar)\s*\(|\bfprintf\s*\(\s*std(out|err)"
                  r"|(?<![\w.])(std::|::)?(exit|_Exit|quick_exit|abort|terminate)\s*\(")
GPL_FILES = {"cloud_cleanup.cpp", "mesh_cleanup.cpp", "mesh_distance.cpp"}
INCLUDE = re.compile(r"#\s*include\s*\"covol/(\w+)\.h\"")
INCLUDE_STEP = re.compile(r"#\s*include\s*\"pipeline/(\w+)\.h\"")


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)


def misplaced_step(path, line):
    """Says why this file may not include that module of lib/src/pipeline; None where it may."""
    include = INCLUDE_STEP.search(line)
    if not include:
        return None
    own = PIPELINE_LEVEL.get(path.stem) if path.parent.name == "pipeline" else len(PIPELINE) if path.stem == "pipeline" else None
    if own is None or include.group(1) not in PIPELINE_LEVEL:
        return "has no level in PIPELINE"
    return "includes upward" if PIPELINE_LEVEL[include.group(1)] > own else None


def findings(root):
    public = sorted((root / "lib/include/covol").glob("*.h"))
    sources = sorted((root / "lib/src").rglob("*.cpp")) + sorted((root / "lib/src").rglob("*.h"))
    if len(public) < 10 or len(sources) < 10:
        yield f"{root}: expected the sources of covol"
    for path in public:
        if path.stem not in LEVEL:
            yield f"{path}: has no layer; add it to LAYERS"
        if not path.read_text().startswith("#pragma once"):
            yield f"{path}:1: expected #pragma once"
    for path in public + sources:
        level = LEVEL.get(path.stem, SOURCE_LEVEL.get(path.stem)) if path.parent.name not in ("detail", "pipeline", "guess") else None
        for number, line in enumerate(without_comments(path.read_text()).splitlines(), 1):
            where = f"{path.relative_to(root)}:{number}"
            include = INCLUDE.search(line)
            if include and include.group(1) not in LEVEL:
                yield f"{where}: unknown header {include.group(1)}.h"
            elif include and level is not None and LEVEL[include.group(1)] > level:
                yield f"{where}: includes upward: {line.strip()}"
            if misplaced_step(path, line):
                yield f"{where}: {misplaced_step(path, line)}: {line.strip()}"
            if path in public and HEAVY.search(line):
                yield f"{where}: a public header includes {line.strip()}"
            if "CGAL/" in line and "#" in line and path.name not in GPL_FILES:
                yield f"{where}: CGAL outside the covol_cgal target: {line.strip()}"
            if LOUD.search(line):
                yield f"{where}: prints or ends the program: {line.strip()}"


def self_test():
    """The patterns find what they are for."""
    assert HEAVY.search('#include <openvdb/openvdb.h>') and not HEAVY.search("#include <openvdb/version.h>")
    for loud in ('std::cout << 1;', 'printf("x");', "std::exit(1);", "fprintf(stderr, 1);", "abort();"):
        assert LOUD.search(loud), loud
    fields, solve = pathlib.Path("lib/src/pipeline/fields.cpp"), pathlib.Path("lib/src/pipeline.cpp")
    assert not misplaced_step(fields, '#include "pipeline/job.h"') and not misplaced_step(solve, '#include "pipeline/flow.h"')
    assert misplaced_step(fields, '#include "pipeline/flow.h"') and misplaced_step(solve, '#include "pipeline/none.h"')
    assert misplaced_step(pathlib.Path("lib/src/edge.cpp"), '#include "pipeline/job.h"')
    for quiet in ('std::snprintf(text, 3, "x");', "run.exit_code(3);", "std::fprintf(file, 1);"):
        assert not LOUD.search(quiet), quiet


if __name__ == "__main__":
    self_test()
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
