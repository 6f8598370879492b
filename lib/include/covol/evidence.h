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

/// What supports a surface, and where new marks would help most.
struct EvidenceOptions {
    double reach = 0.0;  ///< world units, > 0: the surface within this distance of a mark is supported by the marks
    /// in (0,1): where the edge strength 1 − g is below this, the image does not support the surface
    double weak_edge = 0.25;
    int suggestions = 0;  ///< number of slices to suggest, >= 0
};

template <>
inline constexpr auto kOptions<EvidenceOptions> =
    std::tuple{Option{"reach", &EvidenceOptions::reach, kPositive},
               Option{"weak_edge", &EvidenceOptions::weak_edge, kBetween0And1},
               Option{"suggestions", &EvidenceOptions::suggestions, kNotNegative}};

/// The surface and the marks in one slice of the image (along its third axis, half a slice to either side).
struct SliceEvidence {
    int slice = 0;                               ///< index, from 0
    double area = 0;                             ///< of the surface, world units^2
    double unsupported_area = 0;                 ///< of it, farther from all marks than the reach and on a weak edge
    double to_marks_mean = 0, to_marks_max = 0;  ///< from the surface to the nearest mark anywhere; 0 without marks
    double edge_strength = 0;                    ///< mean of 1 − g on the surface; 0 without an image
    int marks = 0;                               ///< that lie in the slice
    double marks_mean = 0, marks_max = 0;        ///< distance from those to the surface
};

/// A slice in which marks would help, and the position in it where they would help most.
struct Suggestion {
    int slice = 0;
    /// unsupported surface that marks along the outline there would support, beyond earlier suggestions
    double area = 0;
    Vec3 index{0, 0, 0};  ///< voxels of the image
    Vec3 world{0, 0, 0};
};

struct Evidence {
    double reach = 0, weak_edge = 0;        ///< as used
    double area = 0, unsupported_area = 0;  ///< of the whole surface
    std::vector<SliceEvidence> slices;      ///< those that contain surface or a mark, ascending
    std::vector<Suggestion> suggestions;    ///< best first; fewer than requested if no unsupported surface remains
    std::vector<float> distance_to_marks;   ///< at the mesh's vertices; empty without marks
    std::vector<float> edge_strength;       ///< 1 − g there; empty without an edge grid
};

/// Assesses a surface by its marks and the image's edges.
///
/// Triangles are split between the slices; a triangle is unsupported if the means over its vertices are. Slices are
/// suggested greedily: the one whose outline would, with marks along it, support the most surface (within `reach` of
/// the outline), then the next one without the surface that the first would support, and so on.
/// @param mesh   world units
/// @param marks  world positions, may be empty
/// @param edge   g from detect_edges(); background 1
/// @throws Error InvalidOptions; InvalidInput (an empty mesh).
[[nodiscard]] COVOL_API Evidence assess_evidence(const TriangleMesh& mesh, const std::vector<Vec3>& marks,
                                                 const FloatGrid& edge, const ImageGeometry& geometry,
                                                 const EvidenceOptions& options, const RunContext& run = {});
/// By the marks alone, without edges.
[[nodiscard]] COVOL_API Evidence assess_evidence(const TriangleMesh& mesh, const std::vector<Vec3>& marks,
                                                 const ImageGeometry& geometry, const EvidenceOptions& options,
                                                 const RunContext& run = {});

/// Fraction of a surface's area that is farther than `reach` from every point and thus not determined by the points.
/// @param distance  to the points; its background, the value beyond its tube, is at least `reach`
[[nodiscard]] COVOL_API double measure_fraction_without_points(const TriangleMesh& mesh, const FloatGrid& distance,
                                                               double reach, const RunContext& run = {});
/// The same, on a temporary distance grid with a third of `reach` as voxel size.
[[nodiscard]] COVOL_API double measure_fraction_without_points(const TriangleMesh& mesh,
                                                               const std::vector<Vec3>& points, double reach,
                                                               const RunContext& run = {});

}  // namespace covol
