#include "start/sampled_leaves.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <set>
#include <utility>

namespace covol::detail {
namespace {

constexpr int kFaces = 6, kSide = kLeafDim + 1, kEnd = kLeafDim - 1;

/// The voxels of a leaf's first layer across an axis, local.
CoordBBox first_layer(int axis) {
    CoordBBox layer(Coord(0), Coord(kEnd));
    layer.max()[axis] = 0;
    return layer;
}

/// Calls visit(offset) with the offset in the leaf of each voxel of a box in it, k fastest as in a Sampler's values.
template <typename Visit>
void for_each_in(const CoordBBox& box, const Visit& visit) {
    for (int i = box.min().x(); i <= box.max().x(); ++i)
        for (int j = box.min().y(); j <= box.max().y(); ++j)
            for (int k = box.min().z(); k <= box.max().z(); ++k) visit(leaf_offset(i, j, k));
}

}  // namespace

/// A leaf with the first layers of the next leaves: 9 x 9 x 9 voxels.
class SampledLeaves::WithNext {
public:
    WithNext(const SampledLeaves& sampled, const Coord& origin) {
        for (int n = 0; n < 8; ++n) leaves_[n] = sampled.leaves_.at(at(origin, n)).values->data();
    }
    /// The origins of the leaf and of the seven leaves that contain the next layer.
    static Coord at(const Coord& origin, int n) {
        return origin.offsetBy((n >> 2) * kLeafDim, (n >> 1 & 1) * kLeafDim, (n & 1) * kLeafDim);
    }
    /// i, j, k 0..8
    [[nodiscard]] bool is_negative(int i, int j, int k) const {
        return leaves_[(i >> 3) * 4 + (j >> 3) * 2 + (k >> 3)][leaf_offset(i & 7, j & 7, k & 7)] < 0;
    }
    [[nodiscard]] bool is_mixed() const {
        const bool first = is_negative(0, 0, 0);
        for (int i = 0; i < kSide; ++i)
            for (int j = 0; j < kSide; ++j)
                for (int k = 0; k < kSide; ++k)
                    if (is_negative(i, j, k) != first) return true;
        return false;
    }
    /// The faces, as in kFaceSlots, that the surface crosses.
    [[nodiscard]] std::array<bool, kFaces> mixed_faces() const {
        std::array<bool, kFaces> mixed{};
        for (int face = 0; face < kFaces; ++face) {
            const int axis = face / 2;
            Coord at(0);
            at[axis] = face % 2 * kLeafDim;
            const bool first = is_negative(at.x(), at.y(), at.z());
            for (int a = 0; a < kSide; ++a)
                for (int b = 0; b < kSide; ++b) {
                    at[(axis + 1) % 3] = a;
                    at[(axis + 2) % 3] = b;
                    mixed[face] = mixed[face] || is_negative(at.x(), at.y(), at.z()) != first;
                }
        }
        return mixed;
    }

private:
    const float* leaves_[8];
};

void SampledLeaves::sample(const Coord& origin, Entry& entry) const {
    if ((entry.requested & kWholeLeaf) != 0) {
        sample_(origin, origin.offsetBy(kEnd), entry.values->data());
        entry.known = kWholeLeaf | (kWholeLeaf - 1);
        return;
    }
    std::array<float, kLeafDim * kLeafDim> layer;
    for (int axis = 0; axis < 3; ++axis) {
        if ((entry.requested & ~entry.known & 1U << axis) == 0) continue;
        const CoordBBox box = first_layer(axis);
        sample_(origin + box.min(), origin + box.max(), layer.data());
        const float* next = layer.data();
        for_each_in(box, [&](int at) { (*entry.values)[at] = *next++; });
    }
    entry.known |= entry.requested;
}

void SampledLeaves::request(const std::vector<Request>& requests) {
    std::vector<std::pair<const Coord, Entry>*> due;
    for (const Request& wish : requests) {
        const auto entry = leaves_.try_emplace(wish.origin).first;
        const bool is_due = entry->second.requested != entry->second.known;
        entry->second.requested |= wish.parts;
        if (!is_due && (entry->second.requested & ~entry->second.known) != 0) due.push_back(&*entry);
    }
    tbb::parallel_for(std::size_t(0), due.size(), [&](std::size_t n) {
        Entry& entry = due[n]->second;
        if (entry.values == nullptr) entry.values = std::make_unique<Values>();
        sample(due[n]->first, entry);
        entry.requested = entry.known;
    });
}

void SampledLeaves::request_with_next(const std::vector<Coord>& leaves) {
    std::vector<Request> requests;
    for (const Coord& o : leaves)
        for (int n = 0; n < 8; ++n) requests.push_back({WithNext::at(o, n), n == 0 ? kWholeLeaf : kFirstLayers});
    request(requests);
}

std::vector<Coord> SampledLeaves::crossed_by(const std::vector<Coord>& leaves) {
    request_with_next(leaves);
    std::vector<char> crosses(leaves.size());
    tbb::parallel_for(std::size_t(0), leaves.size(),
                      [&](std::size_t n) { crosses[n] = WithNext(*this, leaves[n]).is_mixed(); });
    std::vector<Coord> crossed;
    for (std::size_t n = 0; n < leaves.size(); ++n)
        if (crosses[n]) crossed.push_back(leaves[n]);
    return crossed;
}

std::vector<Coord> SampledLeaves::crossed_from(const Domain& domain, const std::vector<Vec3>& seeds,
                                               const RunContext& run) {
    const CoordBBox box = box_of(domain);
    std::map<Coord, bool> crosses;  // the leaves visited so far
    std::vector<Coord> front;
    const auto visit = [&](const Coord& o) {
        if (any_on(mask_in_box(o, box)) && crosses.try_emplace(o, false).second) front.push_back(o);
    };
    const auto follow = [&] {
        while (!front.empty()) {
            run.check();
            const std::vector<Coord> now = crossed_by(std::exchange(front, {}));
            std::vector<std::array<bool, kFaces>> through(now.size());
            tbb::parallel_for(std::size_t(0), now.size(),
                              [&](std::size_t n) { through[n] = WithNext(*this, now[n]).mixed_faces(); });
            for (std::size_t n = 0; n < now.size(); ++n) {
                crosses[now[n]] = true;
                for (int face = 0; face < kFaces; ++face)
                    if (through[n][std::size_t(face)]) visit(neighbour_origin(now[n], kFaceSlots[face]));
            }
        }
    };
    std::set<Coord> homes;
    for (const Vec3& seed : seeds) {
        const Vec3 at = domain.world_to_index(seed);
        homes.insert(Coord::floor(openvdb::Vec3d(at[0], at[1], at[2])) & ~(kLeafDim - 1));
    }
    for (const Coord& home : homes) visit(home);
    follow();
    for (const Coord& home : homes)
        if (const auto found = crosses.find(home); found == crosses.end() || !found->second)
            for (int slot = 0; slot < 27; ++slot) visit(neighbour_origin(home, slot));
    follow();
    std::vector<Coord> crossed;
    for (const auto& [origin, does_cross] : crosses)
        if (does_cross) crossed.push_back(origin);
    return crossed;
}

bool SampledLeaves::Entry::has_one_sign() const {
    bool is_any_negative = false, is_any_positive = false;
    const auto look = [&](int at) { ((*values)[at] < 0 ? is_any_negative : is_any_positive) = true; };
    for (int axis = 0; axis < 3; ++axis)
        if ((known & 1U << axis) != 0) for_each_in(first_layer(axis), look);
    return is_any_negative != is_any_positive;
}

// All values that signed_distance() reads lie in crossed leaves and in the first layers of the leaves that follow them:
// if a voxel next to the surface, or one from which its slope is computed, lay in another leaf, that leaf would be
// crossed.
Sampler SampledLeaves::sampler(const std::vector<Coord>& beside) {
    std::vector<Request> requests;
    for (const Coord& o : beside)
        if (leaves_.find(o) == leaves_.end()) requests.push_back({o, kOneLayer});
    request(requests);
    std::vector<Request> others;  // leaves that another part of the surface crosses
    for (const Coord& o : beside)
        if (const Entry& entry = leaves_.at(o); (entry.known & kWholeLeaf) == 0 && !entry.has_one_sign())
            others.push_back({o, kWholeLeaf});
    request(others);
    return [this](const Coord& lo, const Coord&, float* values) {
        const Entry& entry = leaves_.at(lo);
        const Values& known = *entry.values;
        if ((entry.known & kWholeLeaf) != 0) {
            std::copy(known.begin(), known.end(), values);
            return;
        }
        // The first voxel is part of each first layer, and therefore known.
        std::fill_n(values, kLeafSize, known[0] < 0 ? -1.0F : 1.0F);
        for (int axis = 0; axis < 3; ++axis)
            if ((entry.known & 1U << axis) != 0)
                for_each_in(first_layer(axis), [&](int at) { values[at] = known[std::size_t(at)]; });
    };
}

}  // namespace covol::detail
