#pragma once
#include <optional>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// How the parts of a surface without points are treated.
enum class Holes {
    Auto,   ///< Open if the points lie on a sheet and more than half of the closed surface is hole, else Close
    Close,  ///< the surface is closed smoothly there
    Open,   ///< the mesh ends there; the level set stays closed
    Flat    ///< the surface of minimum area closes the hole, in mesh and level set
};
template <>
inline constexpr auto kWords<Holes> = std::array{"auto", "close", "open", "flat"};

/// Whether the policy requires a mesh in addition to the level set, because the holes are cut out of a mesh.
[[nodiscard]] constexpr bool needs_mesh(Holes policy) { return policy == Holes::Open || policy == Holes::Flat; }

struct HolesOptions {
    Holes policy = Holes::Auto;
    /// world units, > 0: a hole is a part of the surface that is farther than this from all points; automatic:
    /// choose_hole_distance()
    std::optional<double> distance;
};

template <>
inline constexpr auto kOptions<HolesOptions> =
    std::tuple{Option{"holes", &HolesOptions::policy, points_alone(Group::Clouds),
                      "what happens where there are no points: the surface continues smoothly (close), the mesh ends "
                      "and only the level set stays closed (open), or both are closed by the flattest patch (flat); "
                      "auto: open if this concerns more than half of the surface, else close"},
               Option{"hole_distance", &HolesOptions::distance, kPositiveLength, points_alone(Group::Clouds),
                      "a hole is a part of the surface that is farther than this from all points",
                      "3 times the spacing where the points are sparse, at least 3vx"}};

/// A closed line at which a mesh ends.
struct BoundaryLoop {
    std::size_t edges = 0;
    double length = 0;  ///< world units
};
/// The boundary loops of a mesh, the longest first. @pre manifold
[[nodiscard]] COVOL_API std::vector<BoundaryLoop> find_boundary_loops(const TriangleMesh& mesh);

struct HolesReport {
    Holes policy = Holes::Close;  ///< what was done, never Auto
    double distance = 0;          ///< the value of HolesOptions::distance that was used
    double fraction = 0;          ///< fraction of the closed surface's area that was trimmed or flattened
    /// only from segment(): the volume of the mesh before it was trimmed; 0 if it was not trimmed
    double closed_volume = 0;
    std::size_t dropped_pieces = 0;   ///< number of pieces between holes that were removed because they were too small
    std::vector<BoundaryLoop> loops;  ///< the rims of the holes
};

/// The automatic HolesOptions::distance: three times the spacing in sparse regions (from the 95th percentile of the
/// nearest-neighbour distance), at least three voxels. Among uniformly random points such a wide gap is improbable: one
/// in 10^12 discs of that radius is empty.
[[nodiscard]] COVOL_API double choose_hole_distance(const std::vector<Vec3>& points, double voxel_size);

/// The distance of each vertex to the nearest point, world units. @pre there is a point
[[nodiscard]] COVOL_API std::vector<float> measure_distances(const TriangleMesh& mesh, const std::vector<Vec3>& points,
                                                             const RunContext& run = {});

/// Fraction of the mesh's area that is farther than `distance` from every point.
/// @param distances  of the vertices to the points, from measure_distances()
[[nodiscard]] COVOL_API double measure_fraction_beyond(const TriangleMesh& mesh, const std::vector<float>& distances,
                                                       double distance);

struct TreatedHoles {
    TriangleMesh mesh;
    HolesReport report;
};

/// Removes the surface that is farther than `distance` from all points, and all surface closer than `distance` -
/// `slack` to a position removed in this way, so that the hole extends back to the points. The rim is smooth, because
/// it is the border of a union of balls of that radius. Triangles are cut along the rim, vertices close to it are moved
/// onto it, and pieces with an area below that of a disc of radius `distance` are removed.
/// @param mesh       closed, manifold, outward
/// @param to_points  from measure_distances()
/// @param slack      width of the surface that is kept beyond the last points, world units, < distance
/// @return 2-manifold with boundary, outward; the mesh itself if there is no hole
/// @throws Error InvalidInput if nothing remains.
[[nodiscard]] COVOL_API TreatedHoles trim_holes(const TriangleMesh& mesh, const std::vector<float>& to_points,
                                                double distance, double slack, const RunContext& run = {});

/// Cuts holes as trim_holes() does and closes each with a surface of minimum area (Pinkall and Polthier, Computing
/// discrete minimal surfaces and their conjugates, Experimental Mathematics 2, 1993). The resulting mesh may intersect
/// itself; a level set made from it does not.
[[nodiscard]] COVOL_API TreatedHoles flatten_holes(const TriangleMesh& mesh, const std::vector<float>& to_points,
                                                   double distance, double slack, const RunContext& run = {});

}  // namespace covol
