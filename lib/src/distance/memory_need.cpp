#include "distance/memory_need.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

#include "covol/distance.h"
#include "covol/error.h"
#include "grid/leaf_band.h"

namespace covol::detail {
namespace {

constexpr double kTubeBytes = 12;        // [bytes] measured peak memory for each voxel of a distance tube
constexpr double kBandBytes = 200;       // [bytes] the same for each active voxel of a band on which a flow is solved
constexpr double kCoarseVoxels = 1e6;    // approximate number of voxels of the grid on which volumes are measured
constexpr double kBandVoxels = 10;       // [voxels] width of a band that moves with the surface, in whole leaves
constexpr double kLeafVoxels = 4;        // [voxels] mean distance by which a tube's leaves extend beyond the tube
constexpr double kGrowth = 1.02;         // ratio of successive voxel sizes in the search for one that fits
constexpr double kBaseBytes = 8e7;       // [bytes] memory of a program before any computation
constexpr double kOverestimate = 1.2;    // estimates of the memory were too high by up to this factor
constexpr double kBudgetFraction = 0.8;  // fraction of the budget that the proposed voxel size needs
constexpr int kMaxGrowths = 2000;        // maximum number of voxel sizes that are tried

/// Volume of {d <= r} as a function of r, where d is the distance to the points. It is measured on a grid so coarse
/// that its own memory is small for any domain.
class CloudVolume {
public:
    CloudVolume(const std::vector<Vec3>& points, const Domain& domain, const RunContext& run)
        : points_(double(points.size())) {
        const WorldBox box = domain.world_box();
        double volume = 1, diagonal = 0;
        for (int a = 0; a < 3; ++a) {
            volume *= box.max[a] - box.min[a];
            diagonal += std::pow(box.max[a] - box.min[a], 2);
        }
        coarse_ = std::max(2 * domain.voxel_size, std::cbrt(volume / kCoarseVoxels));
        RunContext unbounded = run;
        unbounded.memory_budget = 0;
        const FloatGridPtr grid =
            compute_distance(points, make_domain(box, coarse_), {std::sqrt(diagonal)}, unbounded).grid;
        for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf)
            for (auto value = leaf->cbeginValueOn(); value; ++value) sorted_.push_back(*value);
        std::sort(sorted_.begin(), sorted_.end());
    }

    double operator()(double r) const {
        // Below the coarse voxel size, the volume is proportional to the radius, as around a surface.
        const double counted = std::max(r, coarse_);
        const auto inside = std::upper_bound(sorted_.begin(), sorted_.end(), float(counted)) - sorted_.begin();
        return std::min(double(inside) * std::pow(coarse_, 3) * (r / counted), points_ * 4.19 * r * r * r);
    }

    /// Area of the surface that the points sample, if a tube of radius r has no gaps.
    [[nodiscard]] double area(double r) const {
        const double wide = std::max(r, coarse_);
        return (*this)(wide) / (2 * wide);
    }

private:
    double points_, coarse_;
    std::vector<float> sorted_;
};

double gigabytes(double bytes) { return bytes / (1 << 30); }

using BytesAt = std::function<double(double voxel_size)>;

void require(const BytesAt& bytes_at, double voxel_size, const char* where, const RunContext& run) {
    const double budget = double(run.memory_budget), needed = bytes_at(voxel_size);
    if (!(needed > kOverestimate * budget) || kBudgetFraction * budget <= kBaseBytes)
        return;  // it fits, or no voxel size would satisfy this limit
    double fits = voxel_size;
    for (int n = 0; n < kMaxGrowths && bytes_at(fits) > kBudgetFraction * budget; ++n) fits *= kGrowth;
    std::ostringstream text;
    text.precision(2);
    text << where << ": a voxel size of " << voxel_size << " needs about " << gigabytes(needed)
         << " GiB of memory, but only " << gigabytes(budget) << " GiB may be used; use a larger one, such as " << fits
         << " (`voxel_size`), or a smaller domain (`roi`)";
    throw Error(Errc::InvalidOptions, text.str(), "voxel_size");
}

}  // namespace

void require_tube_memory(const std::vector<Vec3>& points, const Domain& domain, const TubeNeed& need, const char* where,
                         const RunContext& run) {
    const double maximum = need.solved ? std::max(kTubeBytes, kBandBytes) : kTubeBytes;
    if (run.memory_budget == 0 || double(domain.voxel_count()) * maximum + kBaseBytes <= double(run.memory_budget))
        return;
    const CloudVolume volume(points, domain, run);
    require(
        [&](double h) {
            const double radius = need.reach + need.voxels * h;
            double bytes = kTubeBytes * volume(radius + kLeafVoxels * h);
            if (need.solved)
                bytes = std::max(
                    bytes,
                    kBandBytes * std::min(volume(radius),
                                          kBandVoxels * h * volume.area(std::max(need.reach, 0.5 * kBandVoxels * h))));
            return kBaseBytes + bytes / (h * h * h);
        },
        domain.voxel_size, where, run);
}

void require_band_memory(double area, double voxel_size, const char* where, const RunContext& run) {
    if (run.memory_budget == 0) return;
    require([&](double h) { return kBaseBytes + kBandBytes * kBandVoxels * area / (h * h); }, voxel_size, where, run);
}

}  // namespace covol::detail
