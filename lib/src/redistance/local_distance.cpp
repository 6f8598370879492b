#include "redistance/local_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "scheme/scheme.h"

namespace covol::detail {
namespace {

constexpr float kFallTolerance = 5e-3F;  // [voxels] smaller decreases of a distance cause no further visits
constexpr float kUnclamped = 0.99F;

/// Loads a padded leaf of u. Values are mirrored at the domain's end, so that there is no surface beyond it.
void load_u(const HaloField& u, const LeafBand& band, const Domain& domain, std::size_t leaf, float* out) {
    load_star(u, leaf, out);
    const LeafBounds bounds(domain, band.origin(leaf));
    if (bounds.cuts()) mirror_outside(out, bounds.lo, bounds.hi);
}

}  // namespace

LocalDistance::LocalDistance(const LeafBand& band, const HaloField& u, const std::vector<unsigned char>& zone,
                             const Domain& domain, float clamp, float width, Scratch scratch)
    : band_(band),
      u_(u),
      zone_(zone),
      domain_(domain),
      clamp_(clamp),
      width_(width),
      far_(1, width, 0),
      scratch_(scratch) {}

void LocalDistance::compute() {
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) { start(leaf); });
    spread();
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t leaf) {
        if (zone_[leaf]) settle(leaf);
    });
}

void LocalDistance::start(std::size_t leaf) {
    float* d = distances(leaf);
    if (!zone_[leaf]) {
        const float* value = u_.values.leaf(leaf);
        for (int n = 0; n < kLeafSize; ++n)
            d[n] = std::abs(value[n]) < kUnclamped * clamp_ ? std::abs(value[n]) : width_;
        return;
    }
    std::fill_n(d, kLeafSize, width_);
    alignas(64) float u[kPaddedSize];
    load_u(u_, band_, domain_, leaf, u);
    kernels().cut_edges(u, cut(leaf));
}

void LocalDistance::load_distance(std::size_t leaf, float* out) const {
    const float* across[6];
    for (int face = 0; face < 6; ++face) {
        const std::int32_t next = band_.neighbours(leaf)[kFaceSlots[face]];
        across[face] = next == band_.none() ? far_.leaf(0) : distance(next);
    }
    load_star_from(distance(leaf), across, out);
}

// Solves the eikonal equation leaf by leaf. Leaves have two colours, like the squares of a chessboard, and those of one
// colour are visited in parallel. A leaf is visited again, in the rows next to the changes, if a leaf across one of its
// faces has changed since.
void LocalDistance::spread() {
    const SchemeKernels& kernel = kernels();
    std::vector<RowMask> decreased(band_.size() + 1, 0);  // by leaf: rows with values that decreased in its last visit
    bool first = true;
    for (std::atomic<bool> again = true; again; first = false) {
        again = false;
        const std::size_t begins[3] = {0, band_.odd_begin(), band_.size()};
        for (int colour = 0; colour < 2; ++colour)
            tbb::parallel_for(begins[colour], begins[colour + 1], [&](std::size_t leaf) {
                if (!zone_[leaf]) return;
                const RowMask due = first ? ~RowMask{0} : beside(decreased, leaf);
                decreased[leaf] = 0;
                if (due == 0) return;
                alignas(64) float d[kPaddedSize];
                load_distance(leaf, d);
                decreased[leaf] = kernel.eikonal(d, cut(leaf), due, kFallTolerance);
                if (decreased[leaf] == 0) return;
                store_inner(d, distances(leaf));
                again = true;
            });
    }
}

// The rows of a leaf that are adjacent to decreased rows of the leaves across its faces.
RowMask LocalDistance::beside(const std::vector<RowMask>& decreased, std::size_t leaf) const {
    constexpr RowMask kFirst = 0x0101010101010101ULL;  // the rows with j = 0
    RowMask across[6];
    for (int face = 0; face < 6; ++face) across[face] = decreased[band_.neighbours(leaf)[kFaceSlots[face]]];
    return across[kMinusI] >> 56 | across[kPlusI] << 56 | (across[kMinusJ] >> 7 & kFirst) |
           (across[kPlusJ] & kFirst) << 7 | across[kMinusK] | across[kPlusK];
}

void LocalDistance::settle(std::size_t leaf) {
    alignas(64) float d[kPaddedSize], u[kPaddedSize];
    load_distance(leaf, d);
    load_u(u_, band_, domain_, leaf, u);
    kernels().settle(u, d, cut(leaf));  // overwrites the leaf's cuts, which are not needed any more
}

}  // namespace covol::detail
