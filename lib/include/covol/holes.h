#pragma once
#include <optional>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/mesh.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// What becomes of a surface where no points hold it.
enum class Holes {
    Auto,   ///< Open if the points lie on sheets and hold less than half of the closed surface, else Close
    Close,  ///< it goes on smoothly
    Open,   ///< the mesh ends there; the level set stays closed
    Flat    ///< it is spanned by the flattest patch, in mesh and level set
};
template <>
inline constexpr auto kWords<Holes> = std::array{"auto", "close", "open", "flat"};

/// Whether a mesh is needed for it, and not a level set alone.
[[nodiscard]] constexpr bool needs_mesh(Holes policy) { return policy == Holes::Open || policy == Holes::Flat; }

struct HolesOptions {
    Holes policy = Holes::Auto;
    /// world units, > 0: a hole is what lies farther from all points; automatic: choose_hole_distance()
    std::optional<double> distance;
};

template <>
inline constexpr auto kOptions<HolesOptions> = std::tuple{
    Option{"holes", &HolesOptions::policy, points_alone(Group::Clouds),
           "where no points are, the surface goes on smoothly, or the mesh ends (the level set stays closed), or the "
           "flattest patch spans it, in both; auto: it ends if that is more than half of it, else it goes on"},
    Option{"hole_distance", &HolesOptions::distance, kPositiveLength, points_alone(Group::Clouds),
           "a hole is where the surface lies farther from all points",
           "3 spacings where they are sparse, at least 3vx"}};

/// A closed line on which a mesh ends.
struct BoundaryLoop {
    std::size_t edges = 0;
    double length = 0;  ///< world units
};
/// Those of a mesh with boundary, the longest first. @pre manifold
[[nodiscard]] COVOL_API std::vector<BoundaryLoop> find_boundary_loops(const TriangleMesh& mesh);

struct HolesReport {
    Holes policy = Holes::Close;  ///< what was done, never Auto
    double distance = 0;          ///< as used
    double fraction = 0;          ///< of the closed surface's area: what was trimmed, or made flat
    double closed_volume = 0;     ///< of segment() alone: of the level set, where the mesh is open and has none; else 0
    std::size_t dropped_pieces = 0;   ///< between holes, too small to stay
    std::vector<BoundaryLoop> loops;  ///< of the holes
};

/// A distance from which on points are missing: three spacings where they lie sparsely (the 95 % nearest neighbour),
/// and three voxels. Of points spread evenly at random hardly a gap is as wide (one of 10^12 discs of that radius is
/// empty).
[[nodiscard]] COVOL_API double choose_hole_distance(const std::vector<Vec3>& points, double voxel_size);

/// At each vertex, to the nearest point. @pre there is a point
[[nodiscard]] COVOL_API std::vector<float> measure_distances(const TriangleMesh& mesh, const std::vector<Vec3>& points,
                                                             const RunContext& run = {});

/// Share of the area that lies farther than `distance` from every point, of the distances at the vertices.
[[nodiscard]] COVOL_API double measure_fraction_beyond(const TriangleMesh& mesh, const std::vector<float>& distances,
                                                       double distance);

struct TreatedHoles {
    TriangleMesh mesh;
    HolesReport report;
};

/// Takes away what lies farther than `distance` from all points, back to the last of them: all that is closer than that
/// to such a place. So a ball of that radius rolls along the rim, which is as smooth as it. Triangles are cut along the
/// line, vertices close to it moved onto it, and pieces smaller than the ball's disc left out.
/// @param mesh       closed, manifold, outward
/// @param to_points  measure_distances()
/// @param slack      of the rim beyond the last points, world units, < distance
/// @return 2-manifold with boundary, outward; the mesh itself where there is no hole
/// @throws Error InvalidInput where nothing is left.
[[nodiscard]] COVOL_API TreatedHoles trim_holes(const TriangleMesh& mesh, const std::vector<float>& to_points,
                                                double distance, double slack, const RunContext& run = {});

/// The same cut, with the surface of least area in each hole instead of what was there (Pinkall and Polthier, Computing
/// discrete minimal surfaces and their conjugates, Experimental Mathematics 2, 1993). It may pass through itself: a
/// level set made from it does not.
[[nodiscard]] COVOL_API TreatedHoles flatten_holes(const TriangleMesh& mesh, const std::vector<float>& to_points,
                                                   double distance, double slack, const RunContext& run = {});

}  // namespace covol
