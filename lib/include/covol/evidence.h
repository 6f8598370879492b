#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// Options of assess_evidence(), which determines which parts of a surface marks or image edges support.
struct EvidenceOptions {
    double reach = 0.0;  ///< world units, > 0: marks support the surface within this distance
    /// In (0,1): the image does not support the surface at positions at which the edge strength 1 − g is below this; g
    /// is the value of the edge detector (detect_edges()).
    double weak_edge = 0.25;
    int suggestions = 0;  ///< number of slices to suggest, >= 0
};

template <>
inline constexpr auto kOptions<EvidenceOptions> =
    std::tuple{Option{"reach", &EvidenceOptions::reach, kPositive},
               Option{"weak_edge", &EvidenceOptions::weak_edge, kBetween0And1},
               Option{"suggestions", &EvidenceOptions::suggestions, kNotNegative}};

/// The surface and the marks in one slice of the image, perpendicular to its third axis and one spacing thick.
struct SliceEvidence {
    int slice = 0;                ///< index, from 0
    double area = 0;              ///< area of the surface in the slice, world units^2
    double unsupported_area = 0;  ///< area that neither marks nor the image support
    /// mean and maximum distance from the surface to the nearest mark of any slice, world units; 0 without marks
    double to_marks_mean = 0, to_marks_max = 0;
    double edge_strength = 0;              ///< mean of 1 − g on the surface; 0 without an image
    int marks = 0;                         ///< number of marks in the slice
    double marks_mean = 0, marks_max = 0;  ///< mean and maximum distance from these marks to the surface, world units
};

/// A slice in which further marks would support surface that neither marks nor the image's edges support, and the
/// position in the slice at which they would support most of it.
struct Suggestion {
    int slice = 0;
    /// unsupported area within EvidenceOptions::reach of the surface's outline in this slice, which marks along the
    /// outline would support; without the area that earlier suggestions would support; world units^2
    double area = 0;
    Vec3 index{0, 0, 0};  ///< voxels of the image
    Vec3 world{0, 0, 0};
};

struct Evidence {
    double reach = 0, weak_edge = 0;        ///< values of EvidenceOptions that were used
    double area = 0, unsupported_area = 0;  ///< of the whole surface
    std::vector<SliceEvidence> slices;      ///< the slices that contain a part of the surface or a mark, ascending
    std::vector<Suggestion> suggestions;    ///< best first; fewer than requested if no unsupported surface remains
    std::vector<float> distance_to_marks;   ///< at the mesh's vertices; empty without marks
    std::vector<float> edge_strength;       ///< 1 − g at the mesh's vertices; empty without an edge grid
};

/// Assesses a surface by its marks and the image's edges.
///
/// Triangles are split between the slices. A triangle is unsupported if the mean distance of its vertices from the
/// marks exceeds `reach` and the mean edge strength at its vertices is below `weak_edge`. Slices are suggested
/// greedily: first the slice with the largest unsupported area within `reach` of the surface's outline in it; this area
/// then counts as supported, and the next slice is chosen in the same way.
/// @param mesh   world units
/// @param marks  world positions, may be empty
/// @param edge   g from detect_edges(); background 1
/// @throws Error InvalidOptions; InvalidInput (an empty mesh).
[[nodiscard]] COVOL_API Evidence assess_evidence(const TriangleMesh& mesh, const std::vector<Vec3>& marks,
                                                 const FloatGrid& edge, const ImageGeometry& geometry,
                                                 const EvidenceOptions& options, const RunContext& run = {});
/// Assesses a surface by the marks alone, without edges.
[[nodiscard]] COVOL_API Evidence assess_evidence(const TriangleMesh& mesh, const std::vector<Vec3>& marks,
                                                 const ImageGeometry& geometry, const EvidenceOptions& options,
                                                 const RunContext& run = {});

/// Fraction of a surface's area that is farther than `reach` from every point.
/// @param distance  distance to the points, from compute_distance() with max_distance >= reach
[[nodiscard]] COVOL_API double measure_fraction_without_points(const TriangleMesh& mesh, const FloatGrid& distance,
                                                               double reach, const RunContext& run = {});
/// Fraction of a surface's area that is farther than `reach` from every point, from a temporary distance grid whose
/// voxel size is a third of `reach`.
[[nodiscard]] COVOL_API double measure_fraction_without_points(const TriangleMesh& mesh,
                                                               const std::vector<Vec3>& points, double reach,
                                                               const RunContext& run = {});

}  // namespace covol
