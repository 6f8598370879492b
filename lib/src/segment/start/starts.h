#pragma once
// How the level set starts: the domain, u0 on its band, and the distance to the points where they act.
#include "covol/start.h"
#include "segment/job.h"

namespace covol::pipeline {

/// One of those below, as options and input ask for.
void make_start(Job& job);

/// The surface through the marks that bends least.
void start_from_guess(Job& job);

/// The domain of a cloud.
void choose_cloud_domain(Job& job);

/// Where the surface does not rest on it, makes job.result.u, a cloud's settled field, a start as those of start.h.
void make_start_of_field(Job& job);

/// The surface behind a cloud, oriented by itself.
void start_from_cloud(Job& job);

/// The grid of a start other than `Tag`. @throws Error
[[nodiscard]] FloatGridPtr start_grid(const Start& start, const Domain& domain, const RunContext& run);

/// The guess of the options, corrected by the marks and seeds.
void start_from_corrected_guess(Job& job);

/// Makes a start that passes most of the trusted marks pass all of them.
void correct_start(Job& job);

/// The sphere, box, mesh, mask or level set that the caller names. The band follows the surface.
void start_as_given(Job& job);

/// A start inside an object grows to the object's edges, where the image alone decides and shows any.
void grow_to_edges(Job& job);

/// The domain of a start that flows: that of an image which is turned reaches a little beyond it on all sides.
void choose_domain_of_flow(Job& job);

/// Before it flows a start in an image which is turned goes on beyond its end, as in one that is not it does at the
/// domain's end.
void carry_beyond_turned_image(Job& job);

/// Halfway between the seeds, where there are no marks.
void start_from_seeds(Job& job);

/// The body between closed contours.
/// @return false, with nothing made, where there is no such body or it cannot be all that there is to start from
bool start_from_contours(Job& job);

/// From the points: the tagged surface, its closing where D is wide, or, for a scan that encloses nothing, a solid that
/// carries the points.
void start_by_tagging(Job& job);

}  // namespace covol::pipeline
