#pragma once
#include "covol/clip.h"
#include "segment/job.h"

namespace covol::pipeline {

/// Where a solid ends whatever the marks say: the image's box, and the region of interest.
[[nodiscard]] Clip where_it_ends(const Job& job);

/// The signed distance to u's zero level set, where that is not made already, its mesh, and how they fit the points.
void make_surface(Job& job);

}  // namespace covol::pipeline
