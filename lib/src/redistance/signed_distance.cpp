#include "redistance/signed_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "covol/error.h"
#include "distance/nearest.h"
#include "grid/leaf_propagation.h"
#include "redistance/no_surface.h"

namespace covol::detail {
namespace {

/// The nearest point of the interface to a voxel beside it, approximately.
struct Foot {
    Vec3 point;                   // in index space
    std::array<float, 3> normal;  // unit vector towards phi > 0
};

/// Input of the search for the interface.
struct Field {
    const LeafBand& band;
    const LeafArray<float>& phi;
    const std::vector<LeafMask>& valid;  // by leaf: voxels that are used; all others are ignored
    std::vector<LeafMask> inside;        // by leaf: used voxels with phi < 0

    /// phi at the voxel (i, j, k) relative to the leaf's first one. It may lie outside the leaf by one voxel along one
    /// axis. None if the voxel is not in `valid`.
    [[nodiscard]] std::optional<float> at(std::size_t leaf, int i, int j, int k) const {
        const int slot = neighbour_slot(i >> 3, j >> 3, k >> 3);
        const std::int32_t there = slot == 13 ? std::int32_t(leaf) : band.neighbours(leaf)[slot];
        const int offset = leaf_offset(i & 7, j & 7, k & 7);
        if (there == band.none() || !is_on(valid[there], offset)) return std::nullopt;
        return phi.leaf(there)[offset];
    }
};

/// The voxels of a leaf with a face neighbour of the other sign.
LeafMask beside_interface(const Field& field, std::size_t leaf) {
    constexpr LeafMask kNone{};
    LeafMask result{};
    for (int axis = 0; axis < 3; ++axis)
        for (int sign = -1; sign <= 1; sign += 2) {
            const int slot = neighbour_slot(axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0);
            const std::int32_t across = field.band.neighbours(leaf)[slot];
            const bool has_neighbour = across != field.band.none();
            const LeafMask inside =
                beside_marked(field.inside[leaf], has_neighbour ? field.inside[across] : kNone, axis, sign);
            const LeafMask valid =
                beside_marked(field.valid[leaf], has_neighbour ? field.valid[across] : kNone, axis, sign);
            for (int word = 0; word < 8; ++word)
                result[word] |= (field.inside[leaf][word] ^ inside[word]) & valid[word] & field.valid[leaf][word];
        }
    return result;
}

/// Calls visit(offset) for each bit that is on.
template <typename Visit>
void for_each_on(const LeafMask& mask, const Visit& visit) {
    for (int word = 0; word < 8; ++word)
        for (std::uint64_t bits = mask[word]; bits != 0; bits &= bits - 1) visit(word << 6 | __builtin_ctzll(bits));
}

/// The foot of voxel (i,j,k), which lies beside the interface, and the distance between them.
Foot find_foot(const Field& field, std::size_t leaf, int i, int j, int k, float& distance) {
    const float centre = *field.at(leaf, i, j, k);
    float nearest_crossing = std::numeric_limits<float>::max();
    std::array<float, 3> gradient{};
    for (int a = 0; a < 3; ++a) {
        const auto low = field.at(leaf, i - (a == 0), j - (a == 1), k - (a == 2));
        const auto high = field.at(leaf, i + (a == 0), j + (a == 1), k + (a == 2));
        const float down = low ? centre - *low : 0.0F, up = high ? *high - centre : 0.0F;
        const bool crosses_down = low && (*low < 0) != (centre < 0), crosses_up = high && (*high < 0) != (centre < 0);
        if (crosses_down || crosses_up) {
            // The slope across the interface: on the other side of the voxel, phi may belong to another surface.
            gradient[a] = crosses_down && (!crosses_up || std::abs(down) > std::abs(up)) ? down : up;
            nearest_crossing = std::min(nearest_crossing, std::abs(centre / gradient[a]));
        } else {
            gradient[a] = low && high ? 0.5F * (down + up) : down + up;
        }
    }
    const float slope = std::hypot(gradient[0], gradient[1], gradient[2]);
    distance = std::min(std::abs(centre) / slope, nearest_crossing);
    Foot foot;
    const float along = centre < 0 ? -distance : distance;
    const std::array<int, 3> at{i, j, k};
    for (int a = 0; a < 3; ++a) {
        foot.normal[a] = gradient[a] / slope;
        foot.point[a] = double(field.band.origin(leaf)[a] + at[a]) - double(along * foot.normal[a]);
    }
    return foot;
}

/// The distance of a voxel from a foot and its tangent plane. Feet are about one voxel apart, so that the voxel may lie
/// up to kSampling voxels beside the axis of its nearest foot only because of the sampling: this lateral offset is
/// ignored, and only what exceeds it is added.
float distance_to_foot(const Foot& foot, const Coord& voxel) {
    constexpr float kSampling = 0.75F;
    float squared = 0, along = 0;
    for (int a = 0; a < 3; ++a) {
        const auto r = float(voxel[a] - foot.point[a]);
        squared += r * r;
        along += r * foot.normal[a];
    }
    const float lateral = std::max(0.0F, std::sqrt(std::max(0.0F, squared - along * along)) - kSampling);
    return std::sqrt(along * along + lateral * lateral);
}

/// The interface, represented by the voxels beside it.
struct Interface {
    std::vector<LeafMask> inside;    ///< by leaf: phi < 0
    std::vector<LeafMask> beside;    ///< by leaf: voxels with a foot
    std::vector<Foot> feet;          ///< by leaf, then by voxel
    std::vector<float> distances;    ///< distances of these voxels from their feet
    std::vector<std::size_t> first;  ///< by leaf: index of its first foot

    [[nodiscard]] std::vector<Vec3> points() const {
        std::vector<Vec3> result(feet.size());
        std::transform(feet.begin(), feet.end(), result.begin(), [](const Foot& foot) { return foot.point; });
        return result;
    }
};

Interface find_interface(const LeafBand& band, const LeafArray<float>& phi,
                         const std::vector<LeafMask>& inside_domain) {
    Field field{band, phi, inside_domain, std::vector<LeafMask>(band.size(), LeafMask{})};
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            field.inside[leaf][at >> 6] |= std::uint64_t(phi.leaf(leaf)[at] < 0) << (at & 63);
        for (int word = 0; word < 8; ++word) field.inside[leaf][word] &= inside_domain[leaf][word];
    });
    Interface result;
    result.beside.resize(band.size());
    tbb::parallel_for(std::size_t(0), band.size(),
                      [&](std::size_t leaf) { result.beside[leaf] = beside_interface(field, leaf); });
    result.first.assign(band.size() + 1, 0);
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        result.first[leaf + 1] = result.first[leaf] + std::size_t(count_on(result.beside[leaf]));
    result.feet.resize(result.first.back());
    result.distances.resize(result.first.back());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        std::size_t n = result.first[leaf];
        for_each_on(result.beside[leaf], [&](int at) {
            result.feet[n] = find_foot(field, leaf, at >> 6, at >> 3 & 7, at & 7, result.distances[n]);
            ++n;
        });
    });
    result.inside = std::move(field.inside);
    return result;
}

}  // namespace

LeafArray<float> signed_distance(const LeafBand& band, const LeafArray<float>& phi,
                                 const std::vector<LeafMask>& inside_domain, const CoordBBox& box, float width,
                                 const RunContext& run) {
    const Interface interface = find_interface(band, phi, inside_domain);
    LeafArray<float> result(band.size(), width);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        float* u = result.leaf(leaf);
        for (int at = 0; at < kLeafSize; ++at) u[at] = is_on(interface.inside[leaf], at) ? -width : width;
        std::size_t n = interface.first[leaf];
        for_each_on(interface.beside[leaf],
                    [&](int at) { u[at] = std::copysign(std::min(interface.distances[n++], width), u[at]); });
    });
    if (interface.feet.empty()) return result;
    const std::vector<Vec3> points = interface.points();
    const NearestField tube = nearest_points(points, box, width + 1.0, "distance", run);
    tbb::parallel_for(std::size_t(0), tube.leaves.size(), [&](std::size_t n) {
        const NearestLeaf& nearest = tube.leaves[n];
        const std::int32_t leaf = band.find(nearest.origin);
        if (leaf == band.none()) return;
        for (int at = 0; at < kLeafSize; ++at) {
            if (nearest.nearest[at] < 0 || !is_on(inside_domain[leaf], at) || is_on(interface.beside[leaf], at))
                continue;
            const Foot& foot = interface.feet[tube.source[nearest.nearest[at]]];
            const float distance = distance_to_foot(foot, nearest.origin.offsetBy(at >> 6, at >> 3 & 7, at & 7));
            float& u = result.leaf(leaf)[at];
            u = std::copysign(std::min(distance, width), u);
        }
    });
    return result;
}

FloatGridPtr make_band(const LeafBand& band, const LeafColumns& columns, const LeafArray<float>& u,
                       const std::vector<LeafMask>& active, const std::vector<bool>& interior, const Domain& domain,
                       float width) {
    using Leaf = FloatGrid::TreeType::LeafNodeType;
    const auto h = float(domain.voxel_size);
    const float outside = width * h;
    const CoordBBox limit = box_of(domain);
    FloatGridPtr grid = make_grid(domain, outside, "band");
    for (std::size_t n = 0; n < columns.pieces().size(); ++n) {
        if (!interior[n]) continue;
        const CoordBBox box = columns.voxels(columns.pieces()[n]);
        grid->tree().sparseFill(
            {Coord::maxComponent(box.min(), limit.min()), Coord::minComponent(box.max(), limit.max())}, -outside,
            false);
    }
    std::vector<std::unique_ptr<Leaf>> leaves(band.size());
    std::vector<char> is_interior(band.size(), 0);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t n) {
        const float* from = u.leaf(n);
        if (!any_on(active[n])) {
            const auto is_inside = [](float v) { return v < 0; };
            if (std::none_of(from, from + kLeafSize, is_inside)) return;
            is_interior[n] = std::all_of(from, from + kLeafSize, is_inside);
            if (is_interior[n]) return;
        }
        leaves[n] = std::make_unique<Leaf>(band.origin(n), outside, false);
        std::transform(from, from + kLeafSize, leaves[n]->buffer().data(),
                       [&](float v) { return std::clamp(h * v, -outside, outside); });
        auto mask = leaves[n]->valueMask();
        for (int word = 0; word < 8; ++word) mask.getWord<std::uint64_t>(word) = active[n][word];
        leaves[n]->setValueMask(mask);
    });
    for (std::size_t n = 0; n < band.size(); ++n) {
        if (leaves[n]) grid->tree().addLeaf(leaves[n].release());
        if (is_interior[n]) grid->tree().addTile(1, band.origin(n), -outside, false);
    }
    return grid;
}

FloatGridPtr make_start(const LeafBand& band, LeafArray<float>& u, const Domain& domain, const char* where) {
    constexpr auto kWidth = float(kHalfWidthVoxels);
    const CoordBBox box = box_of(domain);
    std::vector<LeafMask> active(band.size(), LeafMask{}), inside(band.size(), LeafMask{});
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const LeafMask in_domain = mask_in_box(band.origin(leaf), box);
        for (int at = 0; at < kLeafSize; ++at) {
            float& v = u.leaf(leaf)[at];
            v = is_on(in_domain, at) ? std::clamp(v, -kWidth, kWidth) : kWidth;
            if (std::abs(v) < kWidth) set_on(active[leaf], at);
            if (v < 0) set_on(inside[leaf], at);
        }
    });
    if (std::none_of(active.begin(), active.end(), any_on))
        throw NoSurface(std::string(where) + ": no surface lies in the domain");
    const LeafColumns columns(band, box, LeafColumns::Extent::Domain);
    return make_band(band, columns, u, active, inside_runs(columns, inside), domain, kWidth);
}

}  // namespace covol::detail
