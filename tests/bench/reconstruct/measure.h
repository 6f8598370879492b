// What a surface is worth: distances, normals, topology.
#pragma once
#include <nlohmann/json.hpp>

#include "ply.h"

/// Distances are in % of the diagonal of `truth`'s bounding box; angles in degrees, without regard to orientation.
nlohmann::json measure(const Ply& mesh, const Ply& truth, bool self_intersections);

/// Of a surface without a truth: to the points it was made from. Lengths are in % of the diagonal of the points' bounding
/// box; the spacing is the mean distance to the 6 nearest points.
nlohmann::json measure_points(const Ply& mesh, const Ply& points);
