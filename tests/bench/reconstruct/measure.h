// Quality of a surface: distances, normals, topology.
#pragma once
#include <nlohmann/json.hpp>

#include "ply.h"

/// The mean distance from the mesh to the truth, that from the truth to the mesh, and the maximum of both directions,
/// in % of the diagonal of the truth's bounding box; the mean angle between normals at nearest points, in degrees,
/// without regard to orientation; the topology of the mesh and the genus of the truth.
nlohmann::ordered_json measure(const Ply& mesh, const Ply& truth);

/// For a surface without a known truth: the same distances between the mesh and the points from which it was made, and
/// its topology. beyond_points is the percentage of its area that is farther from all points than three times their
/// spacing, which is here the mean distance of a point to its 6 nearest neighbours.
nlohmann::ordered_json measure_points(const Ply& mesh, const Ply& points);
