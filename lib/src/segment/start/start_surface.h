#pragma once
// The start of the level set.
#include <memory>
#include <optional>
#include <vector>

#include "segment/choices.h"

namespace covol::pipeline {

/// What the current level set was made from. This determines how far it may be from the result.
enum class StartOrigin {
    Given,       ///< a sphere, a box, a file, seeds
    Grown,       ///< a start of kind Given, grown to the image's edges
    Guess,       ///< the surface through few marks, or a given start that marks correct
    Corrected,   ///< the result of another tool, corrected by marks
    Settled,     ///< a previous result that is kept, because there are no marks
    Cloud,       ///< the surface of a cloud: quadrics, and an indicator between them
    Tagged,      ///< the surface from tagging, possibly closed by a ball
    Contours,    ///< the body between contours
    CoarseLevel  ///< the end of the flow on a coarser lattice
};

/// How a start was made, and the settings for the following steps.
struct StartFacts {
    StartOrigin origin = StartOrigin::Given;
    Domain domain;
    MarkSets marks;                        ///< the marks that the following steps use
    EvolveOptions flow;                    ///< options of the flow that follows
    std::optional<double> tag_distance;    ///< D, if points were tagged
    bool encloses = true;                  ///< of tagged points: whether they enclose something at D
    std::vector<Vec3> on_surface;          ///< of a guess: its marks, without those in the cut at the image's end
    std::vector<char> border_inside;       ///< of a start that the caller specified: inside_on_border(); else empty
    CorrectionOptions correction_options;  ///< the options with which `correction` was made
    std::shared_ptr<const GuessCorrection> correction;  ///< made if another tool's result was corrected, or null
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

/// Whether the start, possibly moved by the image, is the result, so that no flow follows. The body between contours
/// flows if the image has lines as edges: stained sheets can extend beside and across the marked border, and guidance
/// by the intensity profile alone then fails.
[[nodiscard]] inline bool is_final_start(const Problem& problem, const StartFacts& start, EdgeFeature feature) {
    if (start.origin == StartOrigin::Corrected || start.origin == StartOrigin::Settled) return true;
    if (!problem.is_guided() || !uses_points(start.flow)) return false;
    if (start.origin == StartOrigin::Contours) return !uses_image(start.flow) || !is_line(feature);
    return start.origin == StartOrigin::Guess || start.origin == StartOrigin::Cloud;
}

}  // namespace covol::pipeline
