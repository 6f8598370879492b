#pragma once
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "clip/clipped.h"
#include "covol/domain.h"
#include "covol/mesh.h"
#include "mesh/corner_table.h"

namespace covol::meshing {

/// The surface whose crossings with the lattice's edges extract_mesh() approximates by linear interpolation: the
/// isosurface of an interpolated grid, cut off at the faces of a clip. Within a cell the trilinear interpolant is
/// corrected by the second differences along its edges, which makes it third-order; without the correction its error is
/// up to h^2/8 times the second derivative along each axis. Use one object per thread.
class Level {
public:
    /// @param grid  kept by reference. @param clip  which layers of the grid represent the faces of a cut.
    /// @param origin  of the mesh: all positions are relative to it
    Level(const FloatGrid& grid, const detail::LatticeClip& clip, double isovalue, const Vec3& origin);

    struct Sample {
        double value = 0;  ///< interpolated value minus the isovalue, world units; < 0 inside
        Vec3 gradient{};
    };
    [[nodiscard]] Sample sample(const Vec3& world) const;
    [[nodiscard]] double voxel_size() const { return domain_.voxel_size; }

    /// The point of the surface that Newton's method along the gradient finds, at most about a voxel away; none if it
    /// does not converge. Coordinate a does not change if bit a of `held` is set.
    [[nodiscard]] std::optional<Vec3> project(const Vec3& world, unsigned held = 0) const;
    /// Distance of a point from the surface, to first order, world units.
    [[nodiscard]] double distance(const Vec3& world) const;

    /// Whether one of the samples of a triangle, at most a voxel apart, is farther from the surface than this number of
    /// voxels.
    [[nodiscard]] bool is_farther(const Vec3& a, const Vec3& b, const Vec3& c, double voxels) const;

    /// A bit for each axis along which a point lies on a face of the clip.
    [[nodiscard]] unsigned faces(const Position& p) const;
    /// Whether the point is so close to two faces of the clip that meet that it belongs to the narrow chamfer by which
    /// extract_mesh() replaces their common edge.
    [[nodiscard]] bool on_chamfer(const Position& p) const;

private:
    /// A cell of the lattice: the values at its corners, z fastest, and for each axis the second differences along the
    /// four edges in its direction.
    struct Cell {
        openvdb::Coord base{std::numeric_limits<int>::min()};
        std::array<double, 8> corner{};
        std::array<std::array<double, 4>, 3> bend{};
    };

    [[nodiscard]] double lattice(int axis, double index, double& stretch) const;
    [[nodiscard]] const Cell& cell_at(const openvdb::Coord& base) const;
    void load_cell(Cell& cell) const;

    FloatGrid::ConstAccessor accessor_;
    detail::LatticeClip clip_;
    Domain domain_;
    double isovalue_;
    mutable std::array<Cell, 64> cells_;  ///< cache: one cell for each combination of the indices modulo 4
    bool clipped_ = false;
    std::array<std::array<float, 2>, 3> face_{};  ///< of the clip along each axis, world units; infinite: none
};

/// The surface of a Level, for any number of threads: each thread calls level() for an object of its own.
class Surface {
public:
    /// @param level_set  kept by reference. If a clip has cut it, the distance to the whole solid is restored around
    /// the clip's faces (detail::uncut), as in extract_mesh().
    /// @param origin  of the meshes of this surface
    Surface(const FloatGrid& level_set, double isovalue, const Vec3& origin);
    [[nodiscard]] Level level() const { return {grid_, clip_, isovalue_, origin_}; }
    /// Deviation of a mesh from the surface, in voxels, at points at most a voxel apart. Triangles on faces of the clip
    /// are omitted.
    [[nodiscard]] MeshDeviation deviation(const TriangleMesh& mesh) const;

private:
    std::optional<detail::Uncut> whole_;
    const FloatGrid& grid_;
    detail::LatticeClip clip_;
    double isovalue_;
    Vec3 origin_;
};

/// What a vertex lies on and must not leave when it moves.
enum Hold : std::uint8_t {
    kFaces = 7,     ///< a bit for each axis: on a face of the clip that is perpendicular to it
    kOnLevel = 8,   ///< on the isosurface; with a bit of kFaces: on the rim of that face
    kChamfer = 16,  ///< on a chamfer, see Level::on_chamfer(): moves only if an edge is collapsed
    kFixed = 32     ///< on the mesh's boundary or without triangles: does not move
};

[[nodiscard]] std::vector<std::uint8_t> holds_of(const CornerTable& table, const Positions& positions,
                                                 const Level& level);

}  // namespace covol::meshing
