#include "grid/flood_tiles.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <vector>

namespace covol::detail {
namespace {

using openvdb::Coord;
using Tree = FloatGrid::TreeType;

/// Fills the tiles of one node, from its children outward.
template <typename Node>
void fill_tiles(Node& node, const openvdb::CoordBBox& domain, float background) {
    constexpr int kSide = 1 << Node::LOG2DIM, kChild = Node::ChildNodeType::DIM;
    const auto& children = node.getChildMask();
    auto* const table = const_cast<typename Node::UnionType*>(node.getTable());
    const auto at = [](const Coord& slot) {
        return openvdb::Index(((slot.x() << Node::LOG2DIM) + slot.y()) << Node::LOG2DIM) + openvdb::Index(slot.z());
    };
    const auto place = [](openvdb::Index n) {
        return Coord(int(n >> (2 * Node::LOG2DIM)), int(n >> Node::LOG2DIM) & (kSide - 1), int(n) & (kSide - 1));
    };
    const auto meets = [&](openvdb::Index n) {
        return domain.hasOverlap(openvdb::CoordBBox::createCube(node.offsetToGlobalCoord(n), kChild));
    };
    std::vector<unsigned char> known(Node::NUM_VALUES, 0);
    std::vector<openvdb::Index> front;
    const auto spread = [&](openvdb::Index from, const auto& value_towards) {
        for (int face = 0; face < 6; ++face) {
            Coord next = place(from);
            next[face / 2] += face % 2 == 0 ? -1 : 1;
            if (next[face / 2] < 0 || next[face / 2] >= kSide) continue;
            const openvdb::Index n = at(next);
            if (children.isOn(n) || known[n] || !meets(n)) continue;
            known[n] = 1;
            table[n].setValue(value_towards(face) < 0 ? -background : background);
            front.push_back(n);
        }
    };
    for (auto on = children.beginOn(); on; ++on) {
        if (!meets(on.pos())) continue;
        spread(on.pos(), [&](int face) {
            // The value at the middle of the child's face towards the tile, limited to the domain.
            Coord voxel = node.offsetToGlobalCoord(on.pos()).offsetBy(kChild / 2);
            voxel[face / 2] += face % 2 == 0 ? -kChild / 2 : kChild / 2 - 1;
            voxel = Coord::minComponent(Coord::maxComponent(voxel, domain.min()), domain.max());
            return table[on.pos()].getChild()->getValue(voxel);
        });
    }
    while (!front.empty()) {
        const openvdb::Index n = front.back();
        front.pop_back();
        spread(n, [&](int) { return table[n].getValue(); });
    }
}

template <typename Node>
void fill_all(Tree& tree, const openvdb::CoordBBox& domain, float background) {
    std::vector<Node*> nodes;
    tree.getNodes(nodes);
    tbb::parallel_for(std::size_t(0), nodes.size(), [&](std::size_t n) { fill_tiles(*nodes[n], domain, background); });
}

}  // namespace

void flood_tiles(FloatGrid& level_set, const Domain& domain) {
    using Leaf = Tree::LeafNodeType;
    using Upper = Tree::RootNodeType::ChildNodeType;
    Tree& tree = level_set.tree();
    // OpenVDB's flood fill sets the tiles of the root. It does not change leaves whose voxels are all active; they are
    // made so for a while, because their signs are known.
    std::vector<Leaf*> leaves;
    tree.getNodes(leaves);
    std::vector<Leaf::NodeMaskType> masks(leaves.size());
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        masks[n] = leaves[n]->valueMask();
        leaves[n]->setValuesOn();
    });
    openvdb::tools::signedFloodFill(tree);
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) { leaves[n]->setValueMask(masks[n]); });
    const openvdb::CoordBBox box(Coord(domain.min.data()), Coord(domain.max.data()));
    fill_all<Upper::ChildNodeType>(tree, box, level_set.background());
    fill_all<Upper>(tree, box, level_set.background());
}

}  // namespace covol::detail
