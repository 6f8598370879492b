#pragma once
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "call.h"
#include "covol/segment_structures.h"
#include "options.h"

namespace covol::python {

/// A level set computed by covol, or read from a .vdb file.
struct LevelSet {
    FloatGridPtr grid;
};

/// A start or a guess: none, a text as for --init on the command line, the path of a file, a level set, or a mask.
using Shape = std::variant<std::monostate, std::string, LevelSet, Image>;

/// The marks and other inputs of one structure.
struct GivenMarks {
    std::string name;
    std::vector<PointCloud> points, contours, inside, outside;
    std::vector<Vec3> exterior_seeds;
    Shape init, guess;
    std::optional<Image> painted = {};  ///< painted image with only this structure
};

/// All inputs of a job except its options.
struct Problem {
    std::optional<Image> image;  ///< none: points only
    std::vector<GivenMarks> structures;
    std::optional<Image> painted;
    PaintedOptions painting;
    Shape init;
};

/// The result for one structure, and its inputs.
struct Result : StructureResult {
    std::optional<Image> image;
    std::vector<std::string> log;  ///< automatic choices and warnings, in chronological order
};

struct Solution {
    std::vector<std::shared_ptr<Result>> structures;
    std::vector<StructureOverlap> overlaps;
};

/// Runs the job of `covol segment` or `covol reconstruct` on data in memory. @param lapse  null: no time-lapse
[[nodiscard]] Solution solve(const Problem& problem, const GivenOptions& given, const Call& call, TimeLapse* lapse);

}  // namespace covol::python
