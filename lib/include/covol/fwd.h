#pragma once
#include <openvdb/version.h>

#include <array>
#include <cstdint>
#include <memory>

// Forward declaration of OpenVDB's FloatGrid, so that covol's headers compile fast.
// Include <openvdb/openvdb.h> to access the contents of a grid.
namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
template <typename>
class Grid;
namespace tree {
template <typename>
class Tree;
template <typename>
class RootNode;
template <typename, std::uint32_t>
class InternalNode;
template <typename, std::uint32_t>
class LeafNode;
}  // namespace tree
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace covol {

/// The same type as openvdb::FloatGrid, with leaves of 8^3 voxels. All of covol's fields on voxels have this type.
using FloatGrid = openvdb::Grid<openvdb::tree::Tree<openvdb::tree::RootNode<
    openvdb::tree::InternalNode<openvdb::tree::InternalNode<openvdb::tree::LeafNode<float, 3>, 4>, 5>>>>;
using FloatGridPtr = std::shared_ptr<FloatGrid>;

struct WorldBox;

using Vec3 = std::array<double, 3>;                    ///< x, y, z
using Index3 = std::array<std::int32_t, 3>;            ///< i, j, k
using Matrix3 = std::array<std::array<double, 3>, 3>;  ///< m[row][column]

}  // namespace covol
