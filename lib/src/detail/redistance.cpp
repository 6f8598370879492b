// Distance to the zero level set: each voxel of the band finds its nearest patch of the surface.
#include "detail/redistance.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "covol/error.h"
#include "detail/interface_patches.h"
#include "detail/leaf_band.h"
#include "detail/leaf_propagation.h"

namespace covol::detail {
namespace {

constexpr std::int32_t kNoPatch = -1;

openvdb::CoordBBox box_of(const Domain& d) {
    return {Coord(d.min[0], d.min[1], d.min[2]), Coord(d.max[0], d.max[1], d.max[2])};
}

/// Leaves with voxels that may be nearer than the band's half width to a patch.
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

/// Each voxel of the band with the nearest patch that it knows.
class NearestPatches {
public:
    NearestPatches(const InterfacePatches& interface, const LeafBand& band, double half_width)
        : interface_(interface),
          band_(band),
          squared_(band.size(), static_cast<float>(half_width * half_width), 0),
          patch_(band.size(), kNoPatch, 0),
          changed_(band.size(), LeafMask{}) {}

    void find(const RunContext& run) {
        tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) { seed(leaf); });
        propagate(band_, changed_, run, [this](std::size_t leaf, int p, std::size_t other, int q) {
            return try_patch(leaf, p, patch_.leaf(other)[q]);
        });
    }

    [[nodiscard]] const float* squared(std::size_t leaf) const { return squared_.leaf(leaf); }
    [[nodiscard]] const std::int32_t* patch(std::size_t leaf) const { return patch_.leaf(leaf); }

private:
    bool try_patch(std::size_t leaf, int p, std::int32_t patch) {
        std::int32_t& mine = patch_.leaf(leaf)[p];
        if (patch == mine) return false;
        float& best = squared_.leaf(leaf)[p];
        const Coord at = band_.origin(leaf).offsetBy(p >> 6, p >> 3 & 7, p & 7);
        const float d = interface_.squared_distance(at, static_cast<std::uint32_t>(patch), best);
        if (!(d < best)) return false;
        best = d;
        mine = patch;
        return true;
    }

    // The corners of a cell know its patches; those in the leaf belong to cells of the leaf and its lower neighbours.
    void seed(std::size_t leaf) {
        const Coord origin = band_.origin(leaf);
        for (int block = 0; block < 8; ++block) {
            const Coord from = origin.offsetBy(-kLeafDim * (block >> 2 & 1), -kLeafDim * (block >> 1 & 1), -kLeafDim * (block & 1));
            const auto at = std::lower_bound(interface_.leaves.begin(), interface_.leaves.end(), from);
            if (at == interface_.leaves.end() || *at != from) continue;
            const std::size_t n = static_cast<std::size_t>(at - interface_.leaves.begin());
            for (std::uint32_t m = interface_.first[n]; m < interface_.first[n + 1]; ++m) seed_corners(leaf, m);
        }
    }

    void seed_corners(std::size_t leaf, std::uint32_t patch) {
        const Coord cell = interface_.patches[patch].origin - band_.origin(leaf);
        for (int i = std::max(0, cell[0]); i <= std::min(kLeafDim - 1, cell[0] + 1); ++i)
            for (int j = std::max(0, cell[1]); j <= std::min(kLeafDim - 1, cell[1] + 1); ++j)
                for (int k = std::max(0, cell[2]); k <= std::min(kLeafDim - 1, cell[2] + 1); ++k)
                    if (const int p = leaf_offset(i, j, k); try_patch(leaf, p, static_cast<std::int32_t>(patch)))
                        set_on(changed_[leaf], p);
    }

    const InterfacePatches& interface_;
    const LeafBand& band_;
    LeafArray<float> squared_;
    LeafArray<std::int32_t> patch_;
    std::vector<LeafMask> changed_;
};

/// Bit p: voxel p of the leaf is inside. Beyond an open end of the domain a voxel has the sign of the nearest one within.
LeafMask inside_mask(const FloatGrid::ConstAccessor& accessor, const Coord& origin, const openvdb::CoordBBox& domain,
                     DomainEnd end) {
    LeafMask inside{};
    if (const auto* leaf = accessor.probeConstLeaf(origin)) {
        const float* values = leaf->buffer().data();
        for (int p = 0; p < kLeafSize; ++p) inside[p >> 6] |= std::uint64_t(values[p] < 0) << (p & 63);
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
        throw Error(Errc::InvalidInput, std::string(name) + ": grid '" + u.getName() + "': expected a background > 0 (outside), got " +
                                            std::to_string(u.background()));
    const InterfacePatches interface = find_interface(u, domain, end, run);
    if (interface.patches.empty())
        throw Error(Errc::InvalidInput, std::string(name) + ": grid '" + u.getName() +
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
    openvdb::tools::signedFloodFill(result->tree());
    openvdb::tools::pruneLevelSet(result->tree());
    return result;
}


}  // namespace covol::detail
