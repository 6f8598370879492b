#pragma once
#include "segment/job.h"

namespace covol::pipeline {

/// The signed distance to u's zero level set, where that is not made already, its mesh, and how they fit the points.
void make_surface(Job& job);

}  // namespace covol::pipeline
