#pragma once
// The start of the level set.
#include <memory>
#include <optional>
#include <vector>

#include "segment/choices.h"

namespace covol::pipeline {

/// What the current level set was made from, which bounds its distance from the result.
enum class StartOrigin {
    Given,       ///< a sphere, a box, a file, seeds
    Grown,       ///< one of these, grown to the image's edges
    Guess,       ///< the surface through few marks
    Corrected,   ///< the result of another tool, corrected by marks
    Settled,     ///< a result that no mark corrects
    Cloud,       ///< the surface of a cloud: quadrics, and an indicator between them
    Tagged,      ///< the tagged points (also closed, or as a solid)
    Contours,    ///< the body between contours
    CoarseLevel  ///< the end of the flow on a coarser lattice
};

/// How a start was made, and the settings for the following steps.
struct StartFacts {
    StartOrigin origin = StartOrigin::Given;
    Domain domain;
    MarkSets marks;                        ///< those that act from here on
    EvolveOptions flow;                    ///< of the flow from here
    std::optional<double> tag_distance;    ///< D, of points that were tagged
    bool encloses = true;                  ///< likewise: whether they enclose something at that D
    std::vector<Vec3> on_surface;          ///< of a guess: marks that do not lie in the cut at the image's end
    std::vector<char> border_inside;       ///< of a start that the caller specified: inside_on_border(); else empty
    CorrectionOptions correction_options;  ///< as used
    std::shared_ptr<const GuessCorrection> correction;  ///< of the result of another tool
    GuessReport guess;
    InferenceReport inference;  ///< of a guess in an image
    CloudReport cloud;
    std::shared_ptr<const Creases> creases;  ///< of a cloud, or null
    CorrectionReport correction_report;
    TagDistanceChoice tag;
    BandReport band;
    StepReport report;
};

struct StartSurface {
    StartFacts facts;
    FloatGridPtr u;                ///< for a cloud that does not flow: cloud::settled_field(), which is no distance
    FloatGridPtr distance;         ///< to the points that attract, if the flow needs it; or null
    FloatGridPtr obstacle, floor;  ///< of the flow, as in EvolveFields, or null

    [[nodiscard]] double h() const { return facts.domain.voxel_size; }
};

/// Whether the start, possibly moved by the image, is the result: nothing moves it off the marks, and no curvature
/// shrinks it. In stained sheets, which extend beside and across the border that contours mark, guidance by the profile
/// alone fails; there the start flows with the edge detector for lines, with the body as the start.
[[nodiscard]] inline bool is_final_start(const Problem& problem, const StartFacts& start, EdgeFeature feature) {
    if (start.origin == StartOrigin::Corrected || start.origin == StartOrigin::Settled) return true;
    if (!problem.is_guided() || !uses_points(start.flow)) return false;
    if (start.origin == StartOrigin::Contours) return !uses_image(start.flow) || !is_line(feature);
    return start.origin == StartOrigin::Guess || start.origin == StartOrigin::Cloud;
}

}  // namespace covol::pipeline
