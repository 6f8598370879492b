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

/// A level set of covol, or one that is read from a .vdb file.
struct LevelSet {
    FloatGridPtr grid;
};

/// Where a level set starts, or a guess that marks correct: a text as on the command line or a file, a level set or a
/// mask.
using Shape = std::variant<std::monostate, std::string, LevelSet, Image>;

/// What says where one structure is.
struct GivenMarks {
    std::string name;
    std::vector<PointCloud> points, contours, inside, outside;
    std::vector<Vec3> exterior_seeds;
    Shape init, guess;
    std::optional<Image> painted = {};  ///< of this structure alone
};

/// All of a job but its options.
struct Problem {
    std::optional<Image> image;  ///< none: points alone
    std::vector<GivenMarks> structures;
    std::optional<Image> painted;
    PaintedOptions painting;
    Shape init;
};

/// What came of one structure, and what it came from.
struct Result : StructureResult {
    std::optional<Image> image;
    std::vector<std::string> log;  ///< choices and warnings, in their order
};

struct Solution {
    std::vector<std::shared_ptr<Result>> structures;
    std::vector<StructureOverlap> overlaps;
};

/// The job of `covol segment` and `covol reconstruct` on what is in memory. @param lapse  null: no time-lapse
[[nodiscard]] Solution solve(const Problem& problem, const GivenOptions& given, const Call& call, TimeLapse* lapse);

}  // namespace covol::python
