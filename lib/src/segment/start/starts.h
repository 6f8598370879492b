#pragma once
// The eight starts: the domain, u0 on its band, and the distance to the points where they act.
#include "segment/start/start_surface.h"

namespace covol::pipeline {

/// What all starts have in common whose band follows the surface; domain and u are still to be made.
[[nodiscard]] StartSurface follow(StartOrigin origin, const Choices& choices, MarkSets marks);

/// One of those below, as was chosen.
[[nodiscard]] StartSurface make_start(const Problem& problem, const Choices& choices, MarkSets marks);

/// The surface through the marks that bends least.
[[nodiscard]] StartSurface start_from_guess(const Problem& problem, const Choices& choices, MarkSets marks);

/// The surface behind a cloud, oriented by itself.
[[nodiscard]] StartSurface start_from_cloud(const Problem& problem, const Choices& choices, MarkSets marks);

/// The domain of a cloud.
[[nodiscard]] Domain choose_cloud_domain(const Problem& problem, double h, const std::vector<Vec3>& points);

/// The guess of the options, corrected by the marks and seeds.
[[nodiscard]] StartSurface start_from_corrected_guess(const Problem& problem, const Choices& choices, MarkSets marks);

/// Makes a start that passes most of the trusted marks pass all of them.
void correct_start(const Problem& problem, StartSurface& start);

/// The sphere, box, mesh, mask or level set that the caller names. The band follows the surface.
[[nodiscard]] StartSurface start_as_named(const Problem& problem, const Choices& choices, MarkSets marks);

/// The grid of a start that the caller names. @throws Error
[[nodiscard]] FloatGridPtr start_grid(const Start& start, const Domain& domain, const RunContext& run);

/// Halfway between the seeds, where there are no marks.
[[nodiscard]] StartSurface start_from_seeds(const Problem& problem, const Choices& choices, MarkSets marks);

/// A start inside an object grows to the object's edges, where the image alone decides and shows any.
void grow_to_edges(const Problem& problem, const Choices& choices, StartSurface& start);

/// The domain of a start that flows: that of an image which is turned reaches a little beyond it on all sides.
[[nodiscard]] Domain choose_domain_of_flow(const Problem& problem, double h, const std::vector<Vec3>& points);

/// Before it flows a start in an image which is turned goes on beyond its end, as in one that is not it does at the
/// domain's end.
[[nodiscard]] FloatGridPtr carried_beyond_turned_image(const Problem& problem, const Domain& domain, FloatGridPtr u);

/// The body between closed contours, or the points tagged where there is none, or it cannot be all that there is to
/// start from.
[[nodiscard]] StartSurface start_from_contours_or_tags(const Problem& problem, const Choices& choices, MarkSets marks);

/// From the points: the tagged surface, its closing where D is wide, or, for a scan that encloses nothing, a solid that
/// carries the points.
/// @param hole_seeds  in the holes of contours
[[nodiscard]] StartSurface start_by_tagging(const Problem& problem, const Choices& choices, MarkSets marks,
                                            const std::vector<Vec3>& hole_seeds);

}  // namespace covol::pipeline
