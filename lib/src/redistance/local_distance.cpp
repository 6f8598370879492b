#include "redistance/local_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "scheme/scheme.h"

namespace covol::detail {
namespace {

constexpr float kFallTolerance = 1e-3F;  // voxels
constexpr float kLeastCut = 1e-4F;       // voxels
constexpr float kUnclamped = 0.99F;
constexpr int kStride[3] = {padded(1, 0, 0) - padded(0, 0, 0), padded(0, 1, 0) - padded(0, 0, 0), 1};

/// A padded leaf of u; beyond the domain there is no surface.
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
    float* cuts = cut(leaf);
    std::fill_n(cuts, 3 * kLeafSize, 0.0F);
    alignas(64) float u[kPaddedSize];
    load_u(u_, band_, domain_, leaf, u);
    for (int n = 0; n < kLeafSize; ++n) {
        const float* p = u + padded(n >> 6, n >> 3 & 7, n & 7);
        for (int axis = 0; axis < 3; ++axis)
            for (const float q : {p[-kStride[axis]], p[kStride[axis]]}) {
                if ((q < 0.0F) == (*p < 0.0F)) continue;
                const float along = std::max(std::abs(*p) / (std::abs(*p) + std::abs(q)), kLeastCut);
                cuts[axis * kLeafSize + n] = std::max(cuts[axis * kLeafSize + n], 1.0F / along);
            }
    }
}

void LocalDistance::load_distance(std::size_t leaf, float* out) const {
    const float* across[6];
    for (int face = 0; face < 6; ++face) {
        const std::int32_t next = band_.neighbours(leaf)[kFaceSlots[face]];
        across[face] = next == band_.none() ? far_.leaf(0) : distance(next);
    }
    load_star_from(distance(leaf), across, out);
}

// Leaves in two colours; one is visited again when a leaf across a face has changed since.
void LocalDistance::spread() {
    const SchemeKernels& kernel = kernels();
    std::vector<unsigned char> changed(band_.size() + 1, 0);
    bool first = true;
    for (std::atomic<bool> again = true; again; first = false) {
        again = false;
        const std::size_t begins[3] = {0, band_.odd_begin(), band_.size()};
        for (int colour = 0; colour < 2; ++colour)
            tbb::parallel_for(begins[colour], begins[colour + 1], [&](std::size_t leaf) {
                if (!zone_[leaf]) return;
                bool news = first;
                for (const int slot : kFaceSlots) news |= changed[band_.neighbours(leaf)[slot]] != 0;
                changed[leaf] = 0;
                if (!news) return;
                alignas(64) float d[kPaddedSize];
                load_distance(leaf, d);
                if (!kernel.eikonal(d, cut(leaf), kFallTolerance)) return;
                store_inner(d, distances(leaf));
                changed[leaf] = 1;
                again = true;
            });
    }
}

void LocalDistance::settle(std::size_t leaf) {
    alignas(64) float d[kPaddedSize], u[kPaddedSize];
    load_distance(leaf, d);
    load_u(u_, band_, domain_, leaf, u);
    float* cuts = cut(leaf);
    for (int n = 0; n < kLeafSize; ++n) {
        const int p = padded(n >> 6, n >> 3 & 7, n & 7);
        float distances = d[p], values = std::abs(u[p]);
        bool is_cut = false;
        for (int axis = 0; axis < 3; ++axis) {
            if (cuts[axis * kLeafSize + n] == 0.0F) continue;
            for (const int q : {p - kStride[axis], p + kStride[axis]}) {
                if ((u[q] < 0.0F) == (u[p] < 0.0F)) continue;
                is_cut = true;
                distances += d[q];
                values += std::abs(u[q]);
            }
        }
        // Voxel n's cuts are not asked for again.
        cuts[n] = is_cut && values > 0.0F ? std::abs(u[p]) * distances / values : d[p];
    }
}

}  // namespace covol::detail
