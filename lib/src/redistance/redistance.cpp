// Distance to the zero level set: each voxel of the band finds its nearest patch of the surface.
#include "redistance/redistance.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "covol/error.h"
#include "grid/flood_tiles.h"
#include "grid/leaf_band.h"
#include "grid/leaf_propagation.h"
#include "grid/sign_masks.h"
#include "redistance/interface_patches.h"
#include "redistance/no_surface.h"

namespace covol::detail {
namespace {

constexpr std::int32_t kNoPatch = -1;

/// Leaves with voxels that may be closer to a patch than the band's half width.
std::vector<Coord> band_leaves(const InterfacePatches& interface, double half_width) {
    const int reach = static_cast<int>(std::ceil(half_width));
    std::vector<Coord> result;
    for (std::size_t n = 0; n < interface.leaves.size(); ++n) {
        openvdb::CoordBBox box;
        for (std::uint32_t m = interface.first[n]; m < interface.first[n + 1]; ++m)
            box.expand(interface.patches[m].origin);
        const Coord lo = box.min().offsetBy(-reach) & ~(kLeafDim - 1);
        const Coord hi = box.max().offsetBy(1 + reach) & ~(kLeafDim - 1);
        for (int i = lo[0]; i <= hi[0]; i += kLeafDim)
            for (int j = lo[1]; j <= hi[1]; j += kLeafDim)
                for (int k = lo[2]; k <= hi[2]; k += kLeafDim) result.emplace_back(i, j, k);
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
}

/// For each voxel of the band the nearest patch found so far.
class NearestPatches {
public:
    NearestPatches(const InterfacePatches& interface, const LeafBand& band, double half_width)
        : interface_(interface),
          band_(band),
          half_width_(static_cast<float>(half_width)),
          squared_(band.size(), static_cast<float>(half_width * half_width), 0),
          patch_(band.size(), kNoPatch, 0),
          interior_(band.size(), LeafMask{}) {}

    // A voxel whose nearest point lies within a patch lies in the cylinder above and below that patch. Voxels beside a
    // crease lie in no cylinder. These voxels, and those that are missed because normals of patches are inaccurate, get
    // candidates from their neighbours.
    void find(const RunContext& run) {
        seed();
        // If the nearest points of two voxels both lie within their patches, the voxels do not exchange patches: seed()
        // has already offered each of them every patch in whose cylinder it lies.
        std::vector<LeafMask> beside(band_.size());
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) { beside[leaf] = beside_creases(leaf); });
        propagate(band_, beside, run, [this](std::size_t leaf, int p, std::size_t other, int q) {
            return !(is_on(interior_[leaf], p) && is_on(interior_[other], q)) &&
                   try_patch(leaf, p, patch_.leaf(other)[q]);
        });
    }

    [[nodiscard]] const float* squared(std::size_t leaf) const { return squared_.leaf(leaf); }
    [[nodiscard]] const std::int32_t* patch(std::size_t leaf) const { return patch_.leaf(leaf); }

private:
    bool try_patch(std::size_t leaf, int p, std::int32_t patch) {
        const PatchLeaf known = known_by(leaf);
        if (patch == known.patch[p] || patch == kNoPatch) return false;
        const Coord at = band_.origin(leaf).offsetBy(p >> 6, p >> 3 & 7, p & 7);
        const Patch& candidate = interface_.patches[static_cast<std::size_t>(patch)];
        return known.offer(p, interface_.nearest(at, candidate, known.squared[p]), patch);
    }

    [[nodiscard]] PatchLeaf known_by(std::size_t leaf) {
        return {squared_.leaf(leaf), patch_.leaf(leaf), interior_[leaf].data()};
    }

    /// The cylinders of a leaf's patches reach into the adjacent leaves. Leaves of one colour are processed in
    /// parallel; along each axis they are a multiple of three leaves apart, so that no two write to the same leaf.
    void seed() {
        std::array<std::vector<std::size_t>, 27> colours;
        for (std::size_t n = 0; n < interface_.leaves.size(); ++n) {
            const Coord at = interface_.leaves[n] >> 3;  // in units of leaves
            const auto rest = [&](int a) { return std::size_t((at[a] % 3 + 3) % 3); };
            colours[rest(0) * 9 + rest(1) * 3 + rest(2)].push_back(n);
        }
        for (const std::vector<std::size_t>& colour : colours)
            tbb::parallel_for(std::size_t(0), colour.size(), [&](std::size_t n) { seed_from(colour[n]); });
    }

    void seed_from(std::size_t source) {
        const auto own = static_cast<std::size_t>(band_.find(interface_.leaves[source]));
        for (std::uint32_t n = interface_.first[source]; n < interface_.first[source + 1]; ++n) {
            const Patch& patch = interface_.patches[n];
            const Coord cell = patch.origin - band_.origin(own);
            int lo[3], hi[3];  // the leaves that the cylinder may meet
            for (int a = 0; a < 3; ++a) {
                const float center = patch.center[a] + float(cell[a]);
                const float reach = half_width_ * std::abs(patch.normal[a]) + patch.radius + kSlack;
                lo[a] = center - reach < 0 ? -1 : 0;
                hi[a] = center + reach > kLeafDim - 1 ? 1 : 0;
            }
            PatchFan fan;
            for (int i = lo[0]; i <= hi[0]; ++i)
                for (int j = lo[1]; j <= hi[1]; ++j)
                    for (int k = lo[2]; k <= hi[2]; ++k)
                        if (const std::int32_t leaf = band_.neighbours(own)[neighbour_slot(i, j, k)];
                            leaf != band_.none())
                            seed_cylinder(static_cast<std::size_t>(leaf), n, fan);
        }
    }

    void seed_cylinder(std::size_t leaf, std::uint32_t index, PatchFan& fan) {
        const Patch& patch = interface_.patches[index];
        const Coord cell = patch.origin - band_.origin(leaf);
        PatchCylinder cylinder{{}, patch.radius + kSlack, half_width_, patch.radius, patch.height};
        for (int a = 0; a < 3; ++a) cylinder.center[a] = patch.center[a] + float(cell[a]);
        offer_patch(interface_.outline(patch), cylinder, static_cast<std::int32_t>(index), known_by(leaf), fan);
    }

    /// Voxels whose nearest point does not lie within their patch, and the neighbours of such voxels in the leaf and
    /// across its faces.
    [[nodiscard]] LeafMask beside_creases(std::size_t leaf) const {
        constexpr LeafMask kNone{};
        const auto outside = [this](std::size_t n) {
            LeafMask mask = interior_[n];
            for (std::uint64_t& word : mask) word = ~word;
            return mask;
        };
        const LeafMask own = outside(leaf);
        LeafMask result = own;
        for (int axis = 0; axis < 3; ++axis)
            for (int sign = -1; sign <= 1; sign += 2) {
                const std::int32_t across = band_.neighbours(
                    leaf)[neighbour_slot(axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0)];
                const LeafMask look = beside_marked(own, across != band_.none() ? outside(across) : kNone, axis, sign);
                for (int word = 0; word < 8; ++word) result[word] |= look[word];
            }
        for (int p = 0; p < kLeafSize; ++p)
            if (patch_.leaf(leaf)[p] == kNoPatch) result[p >> 6] &= ~(std::uint64_t(1) << (p & 63));
        return result;
    }

    static constexpr float kSlack = 0.25F;  ///< [voxels] added to the radius of cylinders, so that they overlap
    const InterfacePatches& interface_;
    const LeafBand& band_;
    float half_width_;
    LeafArray<float> squared_;
    LeafArray<std::int32_t> patch_;
    std::vector<LeafMask> interior_;  ///< voxels whose nearest point lies within their patch
};

/// Bit p: voxel p of the leaf is inside. Voxels beyond the domain have the sign of the nearest voxel of the domain if
/// `end` is Open; otherwise they are outside.
LeafMask inside_mask(const FloatGrid::ConstAccessor& accessor, const Coord& origin, const openvdb::CoordBBox& domain,
                     DomainEnd end) {
    LeafMask inside{};
    if (const auto* leaf = accessor.probeConstLeaf(origin)) {
        inside = negative_mask(leaf->buffer().data());
    } else if (accessor.getValue(origin) < 0) {
        inside.fill(~std::uint64_t(0));
    }
    if (domain.isInside(openvdb::CoordBBox(origin, origin.offsetBy(kLeafDim - 1)))) return inside;
    for (int p = 0; p < kLeafSize; ++p) {
        const Coord at = origin.offsetBy(p >> 6, p >> 3 & 7, p & 7);
        if (domain.isInside(at)) continue;
        const Coord nearest = Coord::minComponent(Coord::maxComponent(at, domain.min()), domain.max());
        const std::uint64_t bit = std::uint64_t(1) << (p & 63);
        inside[p >> 6] &= ~bit;
        if (end == DomainEnd::Open && accessor.getValue(nearest) < 0) inside[p >> 6] |= bit;
    }
    return inside;
}

}  // namespace

FloatGridPtr redistance(const FloatGrid& u, const Domain& domain, double half_width, DomainEnd end, const char* name,
                        const RunContext& run) {
    if (!(u.background() > 0))
        throw Error(Errc::InvalidInput, std::string(name) + ": grid '" + u.getName() +
                                            "': expected a background > 0 (outside), got " +
                                            std::to_string(u.background()));
    const InterfacePatches interface = find_interface(u, domain, end, run);
    if (interface.patches.empty())
        throw NoSurface(std::string(name) + ": grid '" + u.getName() +
                        "' has no zero crossing: nothing in the domain is inside, or nothing outside");
    LeafBand band(band_leaves(interface, half_width));
    NearestPatches nearest(interface, band, half_width);
    nearest.find(run);

    const float h = static_cast<float>(domain.voxel_size);
    const float background = static_cast<float>(half_width * domain.voxel_size);
    LeafArray<float> values(band.size(), background, 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, band.size(), 16), [&](const auto& range) {
        const auto accessor = u.getConstAccessor();
        for (std::size_t leaf = range.begin(); leaf != range.end(); ++leaf) {
            const LeafMask inside = inside_mask(accessor, band.origin(leaf), box_of(domain), end);
            for (int p = 0; p < kLeafSize; ++p) {
                float d = background;
                if (nearest.patch(leaf)[p] != kNoPatch) {
                    set_on(band.active(leaf), p);
                    d = std::min(background, h * std::sqrt(nearest.squared(leaf)[p]));
                }
                values.leaf(leaf)[p] = is_on(inside, p) ? -d : d;
            }
        }
    });
    FloatGridPtr result = export_grid(band, values, domain, background, name);
    result->setGridClass(openvdb::GRID_LEVEL_SET);
    flood_tiles(*result, domain);
    openvdb::tools::pruneLevelSet(result->tree());
    return result;
}

}  // namespace covol::detail
