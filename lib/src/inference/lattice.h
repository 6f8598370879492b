#pragma once
#include <cstddef>
#include <vector>

#include "covol/image.h"
#include "covol/run.h"

namespace covol::inference {

/// Positions in the image's frame, whose coordinate axes are those of the image: index times spacing. Unless the
/// image's axes are sheared, distances in the frame equal those in the world.
[[nodiscard]] Vec3 to_frame(const ImageGeometry& geometry, const Vec3& world);
[[nodiscard]] Vec3 to_world(const ImageGeometry& geometry, const Vec3& place);

using Field = std::vector<float>;  ///< a value for each node of a lattice, x fastest

/// A box of nodes along the image's axes; lengths and positions are in the image's frame.
struct Lattice {
    Index3 size{0, 0, 0};
    Vec3 origin{0, 0, 0};   ///< position of node (0, 0, 0)
    Vec3 spacing{1, 1, 1};  ///< of the nodes; at least that of the image

    [[nodiscard]] std::size_t count() const {
        return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]);
    }
    [[nodiscard]] std::size_t node(int i, int j, int k) const {
        return (std::size_t(k) * std::size_t(size[1]) + std::size_t(j)) * std::size_t(size[0]) + std::size_t(i);
    }
    [[nodiscard]] Vec3 place(int i, int j, int k) const {
        return {origin[0] + i * spacing[0], origin[1] + j * spacing[1], origin[2] + k * spacing[2]};
    }
    [[nodiscard]] Vec3 place_of(std::size_t node) const {
        const std::size_t x = std::size_t(size[0]), y = std::size_t(size[1]);
        return place(int(node % x), int(node / x % y), int(node / (x * y)));
    }
    [[nodiscard]] double finest() const;
    /// The length along a unit vector that counts as one cell: the reciprocal of the vector's length in cells.
    [[nodiscard]] double cell_along(const Vec3& unit) const;
    /// The precision of a position along a unit vector: the root mean square of a cell's edges, weighted by the squared
    /// components of the vector.
    [[nodiscard]] double extent_along(const Vec3& unit) const;
    /// Trilinear interpolation; beyond the lattice, the value at its boundary.
    [[nodiscard]] double value(const Field& field, const Vec3& place) const;
};

/// Covers a box of the frame, within the image, with at most `maximum` nodes. The nodes are the voxels if these are few
/// enough; otherwise they lie symmetrically about the middle of the box, so that a mirror image has the same nodes.
[[nodiscard]] Lattice cover(const ImageGeometry& geometry, const Vec3& low, const Vec3& high, double maximum);

/// The maximum number of nodes of a result's lattice, the cells of which are half as large as those of the lattice on
/// which candidates are compared.
[[nodiscard]] double fine_nodes();

/// The values of the level set u at all nodes.
[[nodiscard]] std::vector<double> levels_on(const Lattice& lattice, const ImageGeometry& geometry, const FloatGrid& u);

/// Whether the image's box under a lattice is too large to be read as a whole.
[[nodiscard]] bool is_too_large(const Lattice& lattice, const ImageGeometry& geometry, const RunContext& run);

/// The image at the nodes: its voxels, or their mean with weights that decrease to 0 at the neighbouring nodes.
[[nodiscard]] Field sample(const Image& image, const Lattice& lattice, const RunContext& run);

/// The field convolved with a Gaussian. Beyond the boundary the last value is repeated. @param sigma  world units
[[nodiscard]] Field smooth(const Lattice& lattice, const Field& field, double sigma);

/// Central differences along an axis, one-sided at the boundary.
[[nodiscard]] Field derivative(const Lattice& lattice, const Field& field, int axis);

/// Signed distance to the border of a body of nodes, negative inside, accurate to half a cell. Without a border, its
/// absolute value is large.
[[nodiscard]] Field signed_distance(const Lattice& lattice, const std::vector<char>& inside);

/// The parts of a body that are connected through faces: for each node the number of its part, from 1 on, or 0 outside
/// of the body.
struct Parts {
    std::vector<int> number;
    int count = 0;
};
[[nodiscard]] Parts label_parts(const Lattice& lattice, const std::vector<char>& inside);

}  // namespace covol::inference
