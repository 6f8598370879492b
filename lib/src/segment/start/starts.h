#pragma once
// The kinds of start. Each gives the domain, the level set on its band, and the distance to the points if they attract.
#include "segment/start/start_surface.h"

namespace covol::pipeline {

/// The common part of all starts whose band follows the surface; domain and u are still to be set.
[[nodiscard]] StartSurface follow(StartOrigin origin, const Choices& choices, MarkSets marks);

/// Makes the start that was chosen.
[[nodiscard]] StartSurface make_start(const Problem& problem, const Choices& choices, MarkSets marks);

/// The surface of minimum bending energy through the marks.
[[nodiscard]] StartSurface start_from_guess(const Problem& problem, const Choices& choices, MarkSets marks);

/// The surface of a cloud, whose orientation is computed.
[[nodiscard]] StartSurface start_from_cloud(const Problem& problem, const Choices& choices, MarkSets marks);

/// The domain of a cloud.
[[nodiscard]] Domain choose_cloud_domain(const Problem& problem, double h, const std::vector<Vec3>& points);

/// The caller's guess (SegmentOptions::guess), corrected by the marks and seeds.
[[nodiscard]] StartSurface start_from_corrected_guess(const Problem& problem, const Choices& choices, MarkSets marks);

/// Corrects a start that passes most of the trusted marks so that it passes all of them.
void correct_start(const Problem& problem, StartSurface& start);

/// The sphere, box, mesh, mask or level set that the caller specifies. The band follows the surface.
[[nodiscard]] StartSurface start_as_named(const Problem& problem, const Choices& choices, MarkSets marks);

/// The grid of a start that the caller specifies. @throws Error InvalidOptions if the start does not define a grid by
/// itself; the errors of start.h.
[[nodiscard]] FloatGridPtr start_grid(const Start& start, const Domain& domain, const RunContext& run);

/// The surface halfway between the seeds, for input without marks.
[[nodiscard]] StartSurface start_from_seeds(const Problem& problem, const Choices& choices, MarkSets marks);

/// Grows a start inside an object to the object's edges, if there are no points and the image shows clear edges.
void grow_to_edges(const Problem& problem, const Choices& choices, StartSurface& start);

/// The domain of a start that flows: for a rotated image it extends a little beyond the image on all sides.
[[nodiscard]] Domain choose_domain_of_flow(const Problem& problem, double h, const std::vector<Vec3>& points);

/// In a rotated image, continues a start beyond the image's end up to the domain's end, before it flows. Returns `u`
/// unchanged in other images.
[[nodiscard]] FloatGridPtr carried_beyond_turned_image(const Problem& problem, const Domain& domain, FloatGridPtr u);

/// The body between closed contours; the tagged points if there is no such body, or if points or seeds contradict it.
[[nodiscard]] StartSurface start_from_contours_or_tags(const Problem& problem, const Choices& choices, MarkSets marks);

/// The surface from tagging, closed by a ball of radius D if D exceeds the band. A body that the image cuts off is
/// continued beyond the image.
/// @param hole_seeds  seeds in the holes of contours
[[nodiscard]] StartSurface start_by_tagging(const Problem& problem, const Choices& choices, MarkSets marks,
                                            const std::vector<Vec3>& hole_seeds);

}  // namespace covol::pipeline
