"""Heuristic constants are in heuristics.h, each with unit, meaning and a row in docs/heuristics.md, and nowhere else.

    python3 tests/lint/heuristics_test.py SOURCE_DIR
"""
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bench"))
from heuristics import read_heuristics  # noqa: E402

# CONSTANT finds floating-point constants, which a .cpp must not define if its folder has a heuristics.h. ALLOWED lists
# those that are not heuristic: tolerances of solvers, and constants of mathematics.
CONSTANT = re.compile(r"^\s*(?:static )?constexpr (?:double|float) (k\w+)\b", re.M)
DECLARED = re.compile(r"^(?:struct|COVOL_HEURISTICS \w+) (\w+)", re.M)
ALLOWED = {
    "base/domain.cpp:kAnchorVoxels", "base/domain.cpp:kFarthestVoxel", "base/domain.cpp:kMaxVoxelsPerAxis", "base/domain.cpp:kMin",
    "cloud/orientation/cloud_scale.cpp:kCellRadii", "cloud/orientation/given_sides.cpp:kHalfwayInside", "cloud/surface/cloud_field.cpp:kMaxLeaves", "cloud/surface/crease.cpp:kFlat",
    "cloud/surface/hold_topology.cpp:kHeld",
    "cloud/surface/sharp_mesh.cpp:kBeside", "cloud/surface/sharp_mesh.cpp:kLineHeight", "cloud/surface/sharp_mesh.cpp:kLongestMove",
    "cloud/surface/sharp_mesh.cpp:kNeedle", "cloud/surface/sharp_mesh.cpp:kOnCrease", "cloud/surface/sharp_mesh.cpp:kOnSurface", "cloud/surface/sharp_mesh.cpp:kSame",
    "segment/choices.cpp:kMaxReach",
    "contours/contour_curve.cpp:kLongestPiece", "contours/section_field.cpp:kClosest", "contours/section_field.cpp:kSettled", "contours/slice_field.cpp:kSeedPiece",
    "edge/edge.cpp:kHaloSigmas", "edge/edge.cpp:kHeatTolerance", "edge/edge.cpp:kLargestHeatStep", "evolve/band_solver.cpp:kDiverged", "evolve/band_solver.cpp:kLocalGoal", "evolve/band_solver.cpp:kMaxOmega", "evolve/band_solver.cpp:kRounding", "evolve/evolve.cpp:kInactiveFraction", "evolve/evolve.cpp:kLargestTau", "evolve/evolve.cpp:kSmallestStep", "evolve/motion.cpp:kInfinity",
    "guess/guess_correction.cpp:kSolved", "guess/guess_correction.cpp:kSteepestBump", "guess/guess_correction.cpp:kVoxelEnd",
    "guess/marks_surface.cpp:kExact", "guess/marks_surface.cpp:kInfinity", "guess/marks_surface.cpp:kMaxCells", "guess/marks_surface.cpp:kWholeWeight",
    "guess/variational.cpp:kAround", "guess/variational.cpp:kLocalFractions", "guess/variational.cpp:kMinLambda", "guess/variational.cpp:kNoStep", "guess/variational.cpp:kRounding",
    "guidance/border_profile.cpp:kIgnoredWeight", "guidance/learning.cpp:kSteepest", "guidance/motion.cpp:kFinest", "guidance/motion.cpp:kMinNoise", "guidance/offset_field.cpp:kSolved", "guidance/smooth_image.cpp:kKernelSigmas", "guidance/smooth_image.cpp:kMinSigma", "holes/holes.cpp:kP95OfSpacing", "holes/holes.cpp:kStep", "holes/membrane.cpp:kMinWeight",
    "inference/appearance.cpp:kConverged", "inference/appearance.cpp:kFeatureSigmas", "inference/candidate.cpp:kCells", "inference/candidate.cpp:kFarCells",
    "inference/candidate.cpp:kOffsets", "inference/candidate.cpp:kStairs", "inference/infer.cpp:kBandCells", "inference/infer.cpp:kMaxCells",
    "inference/lattice.cpp:kFar", "inference/marks.cpp:kTowards",
    "meshing/contacts.cpp:kAlong", "meshing/contacts.cpp:kFacing", "meshing/contacts.cpp:kFar", "meshing/contacts.cpp:kRounding",
    "meshing/level.cpp:kConverged", "meshing/level.cpp:kNearFace", "meshing/mesh_distance.cpp:kThinFraction", "meshing/relax.cpp:kGain", "meshing/relax.cpp:kStep", "start/start.cpp:kLeafRadius", "start/start_mesh.cpp:kMaxCaps",
    "start/other_lattice.cpp:kSame", "tagging/cores.cpp:kBeyond", "tagging/cores.cpp:kBucketsPerVoxel", "tagging/cores.cpp:kOutsideDomain", "tagging/tagging.cpp:kBall",
}


def findings(root):
    heuristics = read_heuristics(root)
    if len(heuristics) < 100:
        yield f"lib/src: expected heuristics, found {len(heuristics)}"
    rows = set(re.findall(r"^\| `([\w.]+)` \|", (root / "docs/heuristics.md").read_text(), re.M))
    values = dict(re.findall(r"^\| `([\w.]+)` \| ([^|]+) \|", (root / "docs/heuristics.md").read_text(), re.M))
    for h in heuristics:
        if h.problem:
            yield f"{h.name}: {h.problem}"
        elif h.name not in rows:
            yield f"{h.name}: no row in docs/heuristics.md; run tests/bench/sensitivity.py"
        elif values[h.name] != h.text:
            yield f"{h.name}: docs/heuristics.md has {values[h.name]}, the header {h.text}; run tests/bench/sensitivity.py"
    for name in sorted(rows - {h.name for h in heuristics}):
        yield f"docs/heuristics.md: {name}: no such constant"
    declared = [name for path in sorted((root / "lib/src").rglob("heuristics.h")) for name in DECLARED.findall(path.read_text())]
    for name in sorted({name for name in declared if declared.count(name) > 1}):
        yield f"lib/src: {name} is declared more than once: the linker would merge them in the build that measures"
    for h in {h.name: h for h in heuristics}.values():
        if sum(other.name == h.name for other in heuristics) > 1:
            yield f"{h.name}: more than once"
    found = set()
    for folder in sorted(path.parent for path in (root / "lib/src").rglob("heuristics.h")):
        for path in sorted(folder.rglob("*.cpp")):
            for name in CONSTANT.findall(path.read_text()):
                where = f"{path.relative_to(root / 'lib/src').as_posix()}:{name}"
                found.add(where)
                if where not in ALLOWED:
                    yield f"lib/src/{where}: a heuristic belongs to {folder.name}/heuristics.h; what is none, to ALLOWED of this test"
    for where in sorted(ALLOWED - found):
        yield f"{where}: allowed, but not there"


if __name__ == "__main__":
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
