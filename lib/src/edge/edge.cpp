// The edge detector g(s) = 1/(1 + K s²), Eq. (2), near the band: s = |∇G_σ * I|, or the brightness of lines.
#include "covol/edge.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "base/number.h"
#include "covol/error.h"
#include "edge/heuristics.h"
#include "edge/nth_value.h"
#include "grid/active_tiles.h"
#include "grid/halo.h"
#include "scheme/scheme.h"

namespace covol {
namespace {

using detail::Coord;
using detail::HaloField;
using detail::kLeafDim;
using detail::kLeafSize;
using detail::kPaddedSize;
using detail::LeafBand;
using detail::LeafBounds;
using LeafNode = FloatGrid::TreeType::LeafNodeType;

constexpr double kHeatTolerance = 1e-4;  // maximum error of the smoothed image, as a fraction of the brightness range
// [standard deviations] Distance beyond which the weights of the Gaussian are negligible: half and twice this distance
// give the same result.
constexpr double kHaloSigmas = 3.0;
// [h^2] Maximum time step of the diffusion. Shorter steps make the kernel more similar to a Gaussian, but change no
// result visibly.
constexpr double kLargestHeatStep = 0.5;

// The band's leaves with a sufficient margin, and the normalised image on them.
struct Window {
    LeafBand band;
    HaloField image;  // missing neighbours are filled in when loaded: homogeneous Neumann
};

// Bounds for mirror_outside(), which exclude the neighbours that are missing across faces. A neighbour across an edge
// or corner is ignored, too, if one across a face is missing; this occurs only far from the voxels at which the result
// is used.
LeafBounds known_bounds(const Domain& domain, const LeafBand& band, std::size_t leaf) {
    LeafBounds bounds(domain, band.origin(leaf));
    const auto& n = band.neighbours(leaf);
    for (int a = 0; a < 3; ++a) {
        int step[3] = {0, 0, 0};
        step[a] = -1;
        if (n[detail::neighbour_slot(step[0], step[1], step[2])] == band.none())
            bounds.lo[a] = std::max(bounds.lo[a], 0);
        step[a] = 1;
        if (n[detail::neighbour_slot(step[0], step[1], step[2])] == band.none())
            bounds.hi[a] = std::min(bounds.hi[a], 7);
    }
    return bounds;
}

// Number of leaves after which a mapped image's pages are released. Each of a leaf's 64 rows may be on a separate page:
// at most 0.5 GB in all.
constexpr std::size_t kLeavesAtOnce = 1 << 11;

Window sample_window(const Image& image, const FloatGrid& topology, const Domain& domain, double sigma,
                     const RunContext& run) {
    std::vector<Coord> origins;
    for (auto leaf = topology.tree().cbeginLeaf(); leaf; ++leaf)
        if (!leaf->isEmpty()) origins.push_back(leaf->origin());
    const int rings = int(std::ceil((kHaloSigmas * sigma / domain.voxel_size + 2.0) / kLeafDim));
    Window window{LeafBand(detail::dilate_leaves(origins, rings, domain)), {}};
    const LeafBand& band = window.band;
    window.image.values = detail::LeafArray<float>(band.size(), 0.0F, 1);
    window.image.blocks.resize(band.size());
    std::vector<VoxelBox> boxes;
    boxes.reserve(band.size());
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf) {
        const Coord& o = band.origin(leaf);
        boxes.push_back({{o.x(), o.y(), o.z()}, {o.x() + 7, o.y() + 7, o.z() + 7}});
    }
    image.load(domain, boxes, run);
    for (std::size_t begin = 0; begin < band.size(); begin += kLeavesAtOnce) {
        tbb::parallel_for(begin, std::min(begin + kLeavesAtOnce, band.size()), [&](std::size_t leaf) {
            window.image.blocks[leaf] = band.neighbours(leaf);
            float* values = window.image.values.leaf(leaf);
            image.sample(domain, boxes[leaf].min, boxes[leaf].max, values);
        });
        image.release();
    }
    return window;
}

// The brightness values that become 0 and 1. These are percentiles within the window: those of the whole image would
// require reading all of it, and would differ between a part of an image and the whole.
std::array<double, 2> brightness_range(const Window& window) {
    constexpr std::size_t kSamples = 4'000'000;
    const std::size_t all = window.band.size() * kLeafSize, step = all / kSamples + 1;
    std::vector<float> values((all + step - 1) / step);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, values.size(), 4096), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            values[n] = window.image.values.leaf(n * step / kLeafSize)[n * step % kLeafSize];
    });
    const auto value_at = [&](double fraction) {
        return double(detail::nth_value(values, std::size_t(std::lround(fraction * double(values.size() - 1)))));
    };
    const double low = value_at(kEdge.clipped), high = value_at(1 - kEdge.clipped);
    if (low < high) return {low, high};
    const auto [minimum, maximum] = std::minmax_element(values.begin(), values.end());
    return {double(*minimum), double(*maximum)};
}

void normalise(Window& window, const EdgeReport& report) {
    const auto low = static_cast<float>(report.low);
    const auto scale = static_cast<float>(1.0 / (report.high - report.low));
    tbb::parallel_for(std::size_t(0), window.band.size(), [&](std::size_t leaf) {
        float* values = window.image.values.leaf(leaf);
        for (int n = 0; n < kLeafSize; ++n) values[n] = std::clamp((values[n] - low) * scale, 0.0F, 1.0F);
    });
}

// Calls work(leaf, padded values with mirrored boundary) for every leaf.
template <typename Work>
void for_each_padded(const Window& window, const Domain& domain, Work work) {
    tbb::parallel_for(std::size_t(0), window.band.size(), [&](std::size_t leaf) {
        alignas(64) float values[kPaddedSize];
        detail::load_padded(window.image, leaf, values);
        const LeafBounds bounds = known_bounds(domain, window.band, leaf);
        if (bounds.cuts()) detail::mirror_outside(values, bounds.lo, bounds.hi);
        work(leaf, values);
    });
}

/// A leaf and the values across its faces. If the domain or the window ends in the leaf or next to it, the nearest
/// layer within is repeated, so that the flux is zero.
class ClosedStar {
public:
    ClosedStar(const detail::LeafStar& star, const LeafBounds& bounds) : star_(star) {
        if (!(bounds.contains(0, 0, 0) && bounds.contains(7, 7, 7))) {
            const auto within = [&](int at, int a) { return std::max(std::min(at, bounds.hi[a]), bounds.lo[a]) & 7; };
            for (int n = 0; n < kLeafSize; ++n)
                inner_[n] = star.inner[within(n >> 6, 0) << 6 | within(n >> 3 & 7, 1) << 3 | within(n & 7, 2)];
            star_.inner = inner_;
        }
        for (int a = 0; a < 3; ++a) {
            if (bounds.lo[a] == 0) mirror(2 * a);
            if (bounds.hi[a] == 7) mirror(2 * a + 1);
        }
    }
    ClosedStar(const ClosedStar&) = delete;
    ClosedStar& operator=(const ClosedStar&) = delete;
    [[nodiscard]] const detail::LeafStar& star() const { return star_; }

private:
    void mirror(int face) {
        const int stride = face < 2 ? 64 : face < 4 ? 8 : 1;
        const int a = stride == 64 ? 8 : 64, b = stride == 1 ? 8 : 1;
        const int from = face % 2 == 0 ? 0 : 7 * stride, to = 7 * stride - from;
        for (int n = 0; n < kLeafDim; ++n)
            for (int m = 0; m < kLeafDim; ++m) layers_[face][to + n * a + m * b] = star_.inner[from + n * a + m * b];
        star_.across[face] = layers_[face];
    }

    detail::LeafStar star_;
    alignas(64) float inner_[kLeafSize];
    alignas(64) float layers_[6][kLeafSize];  // only the layer that touches the leaf is set
};

// The coefficients of `steps` implicit steps of t h² as a Chebyshev series. These steps divide a plane wave by
// (1 + 6t (1 - m))^steps; m in [-1, 1] is the factor by which the mean over the six neighbours multiplies the wave. The
// series is in m, and is truncated when the remainder is below the tolerance.
std::vector<double> heat_series(double t, int steps) {
    const int nodes = 64 + 16 * int(std::ceil(std::sqrt(6 * t * steps)));
    std::vector<double> values(nodes);
    for (int j = 0; j < nodes; ++j) values[j] = std::pow(1 + 6 * t * (1 - std::cos(M_PI * (j + 0.5) / nodes)), -steps);
    std::vector<double> series(nodes / 2);
    double rest = 0;
    for (std::size_t k = 0; k < series.size(); ++k) {
        for (int j = 0; j < nodes; ++j)
            series[k] += (k == 0 ? 1.0 : 2.0) / nodes * values[j] * std::cos(M_PI * double(k) * (j + 0.5) / nodes);
        rest += std::abs(series[k]);
    }
    std::size_t count = 0;
    while (count < series.size() && rest > kHeatTolerance) rest -= std::abs(series[count++]);
    series.resize(count);
    return series;
}

// Solves I_t = ΔI over the time σ²/2. The implicit steps are not performed one by one: their product is a function of
// the operator that averages six neighbours, which heat_series() expands in Chebyshev polynomials, and Clenshaw's
// recurrence (Math. Comp. 9, 1955) evaluates this series.
void smooth(Window& window, const Domain& domain, double sigma, const RunContext& run) {
    const double time = 0.5 * sigma * sigma / (domain.voxel_size * domain.voxel_size);
    const int steps = int(std::ceil(time / kLargestHeatStep - 1e-9));
    if (steps == 0) return;
    const std::vector<double> series = heat_series(time / steps, steps);
    const LeafBand& band = window.band;
    const detail::LeafArray<float> image = window.image.values;
    detail::LeafArray<float>& newest = window.image.values;  // the field whose neighbours are averaged
    detail::LeafArray<float> other(band.size(), 0.0F, 1);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        for (int n = 0; n < kLeafSize; ++n) newest.leaf(leaf)[n] = float(series.back()) * image.leaf(leaf)[n];
    });
    for (std::size_t k = series.size() - 1; k-- > 0;) {
        run.check();
        run.report("edge", 1 - double(k + 1) / double(series.size()));
        const float step_fraction = float(series[k]), weight = k == 0 ? 1.0F / 6 : 1.0F / 3;
        tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
            const detail::LeafStar star = detail::star_of(window.image, leaf);
            const LeafBounds bounds = known_bounds(domain, band, leaf);
            const auto step = [&](const detail::LeafStar& u) {
                detail::kernels().mean_step(u, image.leaf(leaf), step_fraction, weight, other.leaf(leaf));
            };
            if (bounds.cuts())
                step(ClosedStar(star, bounds).star());
            else
                step(star);
        });
        std::swap(newest, other);
    }
}

std::vector<LeafNode*> leaves_of(FloatGrid& grid) {
    std::vector<LeafNode*> leaves;
    grid.tree().getNodes(leaves);
    return leaves;
}

// The given percentile of s, the argument of g(s), over the active voxels of `slopes`. K is then 1 over the square of
// this value.
double contrast_of(FloatGrid& slopes, double percentile) {
    const std::vector<LeafNode*> leaves = leaves_of(slopes);
    std::vector<std::size_t> first{0};
    for (const LeafNode* leaf : leaves) first.push_back(first.back() + leaf->onVoxelCount());
    std::vector<float> values(first.back());
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        float* to = values.data() + first[n];
        for (auto v = leaves[n]->cbeginValueOn(); v; ++v) *to++ = *v;
    });
    const float at = detail::nth_value(values, std::size_t(percentile * double(values.size() - 1)));
    if (at > 0.0F) return at;
    // The value is 0 if edges are too rare to reach the percentile. Half of the maximum is then used.
    return 0.5 * *std::max_element(values.begin(), values.end());
}

double automatic_contrast(FloatGrid& s, const EdgeOptions& options, EdgeFeature feature) {
    if (options.contrast_percentile) return contrast_of(s, *options.contrast_percentile);
    return is_line(feature) ? kEdge.line_fraction * contrast_of(s, 0.5)  // the median
                            : contrast_of(s, kEdge.slope_percentile);
}

}  // namespace

EdgeResult detect_edges(const Image& image, const FloatGrid& topology, const EdgeOptions& options,
                        const RunContext& run) {
    require_valid(options, "detect_edges");
    if (topology.activeVoxelCount() == 0)
        throw Error(Errc::InvalidInput, "expected active voxels in the band, got none");
    const Domain domain = domain_of(topology);
    EdgeResult result;
    EdgeReport& report = result.report;
    report.feature = options.feature == EdgeFeature::Automatic ? EdgeFeature::Slope : options.feature;
    report.sigma = options.sigma.value_or(domain.voxel_size);
    with_threads(run, [&] {
        Window window = sample_window(image, topology, domain, report.sigma, run);
        const auto range = options.intensities ? *options.intensities : brightness_range(window);
        report.low = range[0], report.high = range[1];
        if (!(report.low < report.high))
            throw Error(Errc::InvalidInput,
                        image.path() + ": every voxel near the band has the value " + std::to_string(report.low) +
                            ", so there is no edge; check that the points lie on the image's "
                            "structure, or segment with the points alone (`rho = 0`)",
                        "rho");
        normalise(window, report);
        smooth(window, domain, report.sigma, run);

        result.grid = make_grid(domain, 1.0F, "edge");
        result.grid->topologyUnion(topology);
        detail::require_memory_of_tiles(*result.grid, "edges", run);
        result.grid->tree().voxelizeActiveTiles();
        const detail::SchemeKernels& kernels = detail::kernels();
        const auto per_length = static_cast<float>(1.0 / domain.voxel_size);
        for_each_padded(window, domain, [&](std::size_t leaf, float* values) {
            auto* node = result.grid->tree().probeLeaf(window.band.origin(leaf));
            if (node == nullptr) return;
            float slope[kLeafSize];
            if (is_line(report.feature)) {
                detail::store_inner(values, slope);
                if (report.feature == EdgeFeature::DarkLine)
                    for (float& s : slope) s = 1.0F - s;
            } else {
                kernels.mean_gradient(values, slope);
                for (float& s : slope) s *= per_length;
            }
            for (int n = 0; n < kLeafSize; ++n)
                if (node->isValueOn(n)) node->setValueOnly(n, slope[n]);
        });
        if (options.edge_k)
            report.edge_contrast = 1.0 / std::sqrt(*options.edge_k);
        else if (options.edge_contrast)
            report.edge_contrast = *options.edge_contrast;
        else
            report.edge_contrast = automatic_contrast(*result.grid, options, report.feature);
        if (!(report.edge_contrast > 0))
            throw Error(Errc::InvalidInput,
                        image.path() + ": limited to intensities from " + detail::number(report.low) + " to " +
                            detail::number(report.high) +
                            ", the image is constant throughout the band, so there is no edge; check that the points "
                            "lie on the image's structure, or segment with the points alone (`rho = 0`)",
                        "rho");
        report.edge_k = 1.0 / (report.edge_contrast * report.edge_contrast);
        const auto k = static_cast<float>(report.edge_k);
        const std::vector<LeafNode*> leaves = leaves_of(*result.grid);
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
            for (auto v = leaves[n]->beginValueOn(); v; ++v) v.setValue(1.0F / (1.0F + k * *v * *v));
        });
    });
    return result;
}

MarkedFeature detect_feature(const Image& image, const std::vector<Vec3>& places, const std::vector<Vec3>& normals,
                             double reach) {
    const auto value_at = [&](const Vec3& x) {
        Domain one;
        one.origin = x;
        float value = 0;
        image.sample(one, {0, 0, 0}, {0, 0, 0}, &value);
        return double(value);
    };
    std::vector<Vec3> inner = places, outer = places;
    for (std::size_t n = 0; n < places.size(); ++n)
        for (int a = 0; a < 3; ++a) {
            inner[n][a] -= reach * normals[n][a];
            outer[n][a] += reach * normals[n][a];
        }
    std::vector<Vec3> all = places;
    all.insert(all.end(), inner.begin(), inner.end());
    all.insert(all.end(), outer.begin(), outer.end());
    image.load(all);
    double line = 0, squares = 0, step = 0;
    for (std::size_t n = 0; n < places.size(); ++n) {
        const double inside = value_at(inner[n]), outside = value_at(outer[n]);
        const double here = value_at(places[n]) - 0.5 * (inside + outside);
        line += here;
        squares += here * here;
        step += 0.5 * (outside - inside);
    }
    image.release();
    MarkedFeature found;
    const auto count = double(places.size());
    if (count < 2) return found;
    found.line = line / count;
    found.step = step / count;
    const double error = std::sqrt(std::max(0.0, squares / count - found.line * found.line) / (count - 1));
    if (std::abs(found.line) > std::abs(found.step) && std::abs(found.line) > kCommon.errors * error)
        found.feature = found.line > 0 ? EdgeFeature::BrightLine : EdgeFeature::DarkLine;
    return found;
}

}  // namespace covol
