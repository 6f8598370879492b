#pragma once
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "call.h"
#include "covol/pipeline.h"
#include "covol/points.h"
#include "options.h"

namespace covol::python {

/// A level set of covol, or one that is read from a .vdb file.
struct LevelSet {
    FloatGridPtr grid;
};

/// Where a level set starts, or a guess that marks correct: a text as on the command line, a level set or a mask.
using Shape = std::variant<std::monostate, std::string, LevelSet, Image>;

/// What says where the surface is.
struct Marks {
    std::vector<PointCloud> points, contours, inside, outside;
    std::optional<Image> painted;
    Shape init, guess;
};

/// What came of one structure, and what it came from.
struct Result {
    SegmentResult result;
    std::optional<Image> image;
    std::vector<Vec3> marks;          ///< as they were given, world units
    std::optional<Image> guess_mask;  ///< that was corrected
    int label = 1;                    ///< in that mask
    std::vector<std::string> log;     ///< choices and warnings, in their order
};

/// The job of `covol segment` and `covol reconstruct` on what is in memory. @param image  none: points alone
[[nodiscard]] std::shared_ptr<Result> solve(const std::optional<Image>& image, const Marks& marks,
                                            const GivenOptions& given, const Call& call);

}  // namespace covol::python
