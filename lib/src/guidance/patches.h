#pragma once
#include <cstdint>
#include <vector>

#include "covol/image.h"
#include "covol/mesh.h"

namespace covol::guidance {

/// A surface cut into patches about two voxels wide: what has one offset of its own.
struct Patches {
    // by vertex
    std::vector<Vec3> places, normals;
    std::vector<std::uint32_t> patch;
    // by patch
    std::vector<std::uint32_t> first, members;  ///< patch p has the vertices members[first[p] .. first[p+1])
    std::vector<Vec3> centers, directions;      ///< mean place, mean normal
    std::vector<double> area;
    std::vector<double> voxel;  ///< the image's voxel along the normal, world units
    struct Border {
        std::uint32_t a, b;
        double length, distance;
    };
    std::vector<Border> borders;
    std::vector<std::vector<std::uint32_t>> neighbours;  ///< by patch: those with which it has a border

    [[nodiscard]] std::size_t size() const { return centers.size(); }
};

/// @param mesh    closed, outward
/// @param width   of the patches; at least one voxel of the image along each of its axes
/// @param smooth  rounds of averaging of normals
[[nodiscard]] Patches make_patches(const TriangleMesh& mesh, const ImageGeometry& geometry, double width, int smooth);

/// The edge of the image's voxels along a unit vector.
[[nodiscard]] double voxel_along(const ImageGeometry& geometry, const Vec3& direction);

}  // namespace covol::guidance
