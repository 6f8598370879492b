#pragma once
// What the level set starts from.
#include <memory>
#include <optional>
#include <vector>

#include "segment/choices.h"

namespace covol::pipeline {

/// What the level set of now was made from: how far it may be from its end.
enum class StartOrigin {
    Given,       ///< a sphere, a box, a file, seeds
    Grown,       ///< one of these that has grown to the image's edges
    Guess,       ///< the surface through few marks
    Corrected,   ///< another tool's result, corrected by marks
    Settled,     ///< a result that no mark corrects
    Cloud,       ///< the surface behind a cloud: quadrics, and an indicator between them
    Tagged,      ///< the points, tagged (closed or as a solid, too)
    Contours,    ///< the body between contours
    CoarseLevel  ///< the end of the flow on a coarser lattice
};

/// How a start was made, and what goes on from it.
struct StartFacts {
    StartOrigin origin = StartOrigin::Given;
    Domain domain;
    MarkSets marks;                        ///< those that act from here on
    EvolveOptions flow;                    ///< of the flow from here
    std::optional<double> tag_distance;    ///< D, of points that were tagged
    bool encloses = true;                  ///< likewise: they do at that D
    std::vector<Vec3> on_surface;          ///< of a guess: marks that do not lie in the cut at the image's end
    std::vector<char> border_inside;       ///< of a start that the caller named: inside_on_border(); else empty
    CorrectionOptions correction_options;  ///< as used
    std::shared_ptr<const GuessCorrection> correction;  ///< of another tool's result
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
    FloatGridPtr u;                ///< of a cloud that rests the settled field, no distance: cloud::settled_field()
    FloatGridPtr distance;         ///< to the points that attract, where the flow needs it; or null
    FloatGridPtr obstacle, floor;  ///< of the flow, as in EvolveFields, or null

    [[nodiscard]] double h() const { return facts.domain.voxel_size; }
};

/// The start, or where the image moved it, is the surface: nothing pulls it off the marks, and no curvature shrinks it.
/// Stained sheets run on beside and across the border that contours mark, and guidance by the profile alone cannot
/// tell them apart: there the edge detector of lines flows, with the body as a guess.
[[nodiscard]] inline bool rests(const Problem& problem, const StartFacts& start, EdgeFeature feature) {
    if (start.origin == StartOrigin::Corrected || start.origin == StartOrigin::Settled) return true;
    if (!problem.is_guided() || !uses_points(start.flow)) return false;
    if (start.origin == StartOrigin::Contours) return !uses_image(start.flow) || !is_line(feature);
    return start.origin == StartOrigin::Guess || start.origin == StartOrigin::Cloud;
}

}  // namespace covol::pipeline
