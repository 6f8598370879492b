// Quality of a surface: distances, normals, topology.
#pragma once
#include <nlohmann/json.hpp>

#include "ply.h"

/// Mean distances to the truth and from it, and the largest either way, in % of the diagonal of the truth's bounding
/// box; mean angle between normals at nearest points, in degrees, without regard to orientation; topology of both.
nlohmann::ordered_json measure(const Ply& mesh, const Ply& truth);

/// For a surface without a known truth: the same distances to the points from which it was made; beyond_points is the
/// fraction of its area, in %, that is farther from all points than 3 times their mean distance to the 6 nearest.
nlohmann::ordered_json measure_points(const Ply& mesh, const Ply& points);
