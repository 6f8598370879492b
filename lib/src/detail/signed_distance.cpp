#include "detail/signed_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace covol::detail {
namespace {

/// Where the interface lies, seen from a voxel beside it.
struct Foot {
    Vec3 point;                 // index space
    std::array<float, 3> normal;  // towards phi > 0
};

/// A leaf's voxels and the layer around it; voxels that take no part are marked.
class Neighbourhood {
public:
    Neighbourhood(const LeafBand& band, const LeafArray<float>& phi, const std::vector<LeafMask>& valid, std::size_t leaf)
        : band_(band), phi_(phi), valid_(valid), leaf_(leaf) {}
    /// phi of voxel (i,j,k), at most one outside the leaf along one axis.
    [[nodiscard]] std::optional<float> at(int i, int j, int k) const {
        const int slot = neighbour_slot(i >> 3, j >> 3, k >> 3);
        const std::int32_t leaf = slot == 13 ? std::int32_t(leaf_) : band_.neighbours(leaf_)[slot];
        const int offset = leaf_offset(i & 7, j & 7, k & 7);
        if (leaf == band_.none() || !is_on(valid_[leaf], offset)) return std::nullopt;
        return phi_.leaf(leaf)[offset];
    }

private:
    const LeafBand& band_;
    const LeafArray<float>& phi_;
    const std::vector<LeafMask>& valid_;
    std::size_t leaf_;
};

/// The foot of voxel (i,j,k) and its distance to it, where a neighbour has the other sign.
std::optional<Foot> find_foot(const Neighbourhood& n, const Coord& origin, int i, int j, int k, float& distance) {
    const float centre = *n.at(i, j, k);
    float nearest_crossing = std::numeric_limits<float>::max();
    std::array<float, 3> gradient{};
    for (int a = 0; a < 3; ++a) {
        const auto low = n.at(i - (a == 0), j - (a == 1), k - (a == 2));
        const auto high = n.at(i + (a == 0), j + (a == 1), k + (a == 2));
        const float down = low ? centre - *low : 0.0F, up = high ? *high - centre : 0.0F;
        const bool crosses_down = low && (*low < 0) != (centre < 0), crosses_up = high && (*high < 0) != (centre < 0);
        if (crosses_down || crosses_up) {
            // The slope across the interface; phi may have another branch on the far side.
            gradient[a] = crosses_down && (!crosses_up || std::abs(down) > std::abs(up)) ? down : up;
            nearest_crossing = std::min(nearest_crossing, std::abs(centre / gradient[a]));
        } else {
            gradient[a] = low && high ? 0.5F * (down + up) : down + up;
        }
    }
    if (nearest_crossing > 1.0F) return std::nullopt;
    const float slope = std::hypot(gradient[0], gradient[1], gradient[2]);
    distance = std::min(std::abs(centre) / slope, nearest_crossing);
    Foot foot;
    const float signed_distance = centre < 0 ? -distance : distance;
    const std::array<int, 3> at{i, j, k};
    for (int a = 0; a < 3; ++a) {
        foot.normal[a] = gradient[a] / slope;
        foot.point[a] = double(origin[a] + at[a]) - double(signed_distance * foot.normal[a]);
    }
    return foot;
}

/// Feet are about one voxel apart: a lateral offset up to that is the sampling's, not the surface's.
float distance_to_foot(const Foot& foot, const Coord& voxel) {
    constexpr float kSampling = 0.75F;
    float squared = 0, along = 0;
    for (int a = 0; a < 3; ++a) {
        const auto r = float(voxel[a] - foot.point[a]);
        squared += r * r;
        along += r * foot.normal[a];
    }
    const float lateral = std::max(0.0F, std::sqrt(std::max(0.0F, squared - along * along)) - kSampling);
    return std::hypot(along, lateral);
}

}  // namespace

LeafArray<float> signed_distance(const LeafBand& band, const LeafArray<float>& phi,
                                 const std::vector<LeafMask>& inside_domain, const VoxelBox& box, float width,
                                 const RunContext& run) {
    LeafArray<float> result(band.size(), width);
    std::vector<std::vector<Foot>> feet_of_leaf(band.size());
    std::vector<LeafMask> beside(band.size(), LeafMask{});
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const Neighbourhood around(band, phi, inside_domain, leaf);
        for (int at = 0; at < kLeafSize; ++at) {
            if (!is_on(inside_domain[leaf], at)) continue;
            float distance = width;
            if (const auto foot = find_foot(around, band.origin(leaf), at >> 6, at >> 3 & 7, at & 7, distance)) {
                feet_of_leaf[leaf].push_back(*foot);
                set_on(beside[leaf], at);
            }
            result.leaf(leaf)[at] = phi.leaf(leaf)[at] < 0 ? -std::min(distance, width) : std::min(distance, width);
        }
    });
    std::vector<Foot> feet;
    std::vector<Vec3> points;
    for (const auto& some : feet_of_leaf)
        for (const Foot& foot : some) {
            feet.push_back(foot);
            points.push_back(foot.point);
        }
    if (feet.empty()) return result;
    const NearestField field = nearest_points(points, box, width + 1.0, "signed_distance", run);
    tbb::parallel_for(std::size_t(0), field.leaves.size(), [&](std::size_t n) {
        const NearestLeaf& nearest = field.leaves[n];
        const std::int32_t leaf = band.find(nearest.origin);
        if (leaf == band.none()) return;
        for (int at = 0; at < kLeafSize; ++at) {
            if (nearest.nearest[at] < 0 || !is_on(inside_domain[leaf], at) || is_on(beside[leaf], at)) continue;
            const Foot& foot = feet[field.source[nearest.nearest[at]]];
            const float distance = distance_to_foot(foot, nearest.origin.offsetBy(at >> 6, at >> 3 & 7, at & 7));
            float& u = result.leaf(leaf)[at];
            u = std::copysign(std::min(distance, width), u);
        }
    });
    return result;
}

FloatGridPtr make_band(const LeafBand& band, const LeafColumns& columns, const LeafArray<float>& values,
                       const std::vector<LeafMask>& active, const std::vector<bool>& interior, const Domain& domain,
                       float width) {
    using Leaf = FloatGrid::TreeType::LeafNodeType;
    const auto h = float(domain.voxel_size);
    const float outside = width * h;
    FloatGridPtr grid = make_grid(domain, outside, "band");
    for (std::size_t n = 0; n < columns.pieces().size(); ++n) {
        if (!interior[n]) continue;
        const VoxelBox box = columns.voxels(columns.pieces()[n]);
        grid->tree().sparseFill(openvdb::CoordBBox(box.min, box.max), -outside, false);
    }
    std::vector<std::unique_ptr<Leaf>> leaves(band.size());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t n) {
        const float* u = values.leaf(n);
        const bool is_uniform = std::all_of(u, u + kLeafSize, [&](float v) { return (v < 0) == (u[0] < 0); });
        if (!any_on(active[n]) && is_uniform && u[0] >= 0) return;
        leaves[n] = std::make_unique<Leaf>(band.origin(n), outside, false);
        if (!any_on(active[n]) && is_uniform) return leaves[n]->fill(-outside);
        std::transform(u, u + kLeafSize, leaves[n]->buffer().data(), [h](float v) { return h * v; });
        auto mask = leaves[n]->valueMask();
        for (int word = 0; word < 8; ++word) mask.getWord<std::uint64_t>(word) = active[n][word];
        leaves[n]->setValueMask(mask);
    });
    for (auto& leaf : leaves) {
        if (!leaf) continue;
        if (leaf->isEmpty() && leaf->getFirstValue() == -outside && leaf->getLastValue() == -outside)
            grid->tree().addTile(1, leaf->origin(), -outside, false);
        else
            grid->tree().addLeaf(leaf.release());
    }
    return grid;
}

}  // namespace covol::detail
