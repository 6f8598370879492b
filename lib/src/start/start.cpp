// Starts other than tagging: the signed distance to a given surface, clamped, in a band around it.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "base/geometry.h"
#include "base/number.h"
#include "clip/clipped.h"
#include "clip/half_spaces.h"
#include "covol/error.h"
#include "covol/start.h"
#include "redistance/signed_distance.h"
#include "start/carry_on.h"
#include "start/other_lattice.h"
#include "start/sampled_leaves.h"

namespace covol {
namespace {

using detail::Coord;
using detail::kLeafDim;
using detail::kLeafSize;
using detail::LeafArray;
using detail::LeafBand;
using detail::SampledLeaves;
using detail::Sampler;

constexpr auto kWidth = float(kHalfWidthVoxels);

/// Origins of the leaves that intersect both the domain and the world box.
std::vector<Coord> leaves_in(const Domain& domain, const WorldBox& box) {
    const Vec3 low = domain.world_to_index(box.min), high = domain.world_to_index(box.max);
    Coord lo, hi;
    for (int a = 0; a < 3; ++a) {
        lo[a] = int(std::floor(std::clamp(low[a], double(domain.min[a]), double(domain.max[a])))) & ~(kLeafDim - 1);
        hi[a] = int(std::ceil(std::clamp(high[a], double(domain.min[a]), double(domain.max[a]))));
    }
    std::vector<Coord> origins;
    for (int i = lo.x(); i <= hi.x(); i += kLeafDim)
        for (int j = lo.y(); j <= hi.y(); j += kLeafDim)
            for (int k = lo.z(); k <= hi.z(); k += kLeafDim) origins.emplace_back(i, j, k);
    return origins;
}

/// The leaves for which `keep` is true, in the same order.
std::vector<Coord> filter(const std::vector<Coord>& leaves, const std::function<bool(const Coord&)>& keep) {
    std::vector<char> kept(leaves.size());
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) { kept[n] = keep(leaves[n]); });
    std::vector<Coord> result;
    for (std::size_t n = 0; n < leaves.size(); ++n)
        if (kept[n]) result.push_back(leaves[n]);
    return result;
}

using SignedDistance = std::function<double(const Vec3& world)>;

/// A start from a signed distance that is known everywhere.
FloatGridPtr start_from_distance(const Domain& domain, const WorldBox& box, const SignedDistance& distance,
                                 const char* where) {
    const double h = domain.voxel_size;
    const auto world = [&](const Coord& origin, double i, double j, double k) {
        return domain.index_to_world({origin.x() + i, origin.y() + j, origin.z() + k});
    };
    // The leaf's farthest voxel centres lie 3.5 sqrt(3) voxels from its middle. If the surface is farther away, the
    // leaf has no voxel in the band.
    const double reach = (kHalfWidthVoxels + 3.5 * std::sqrt(3.0)) * h;
    LeafBand band(filter(leaves_in(domain, box),
                         [&](const Coord& o) { return std::abs(distance(world(o, 3.5, 3.5, 3.5))) <= reach; }));
    LeafArray<float> u(band.size(), kWidth);
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            u.leaf(leaf)[at] = float(distance(world(band.origin(leaf), at >> 6, at >> 3 & 7, at & 7)) / h);
    });
    return detail::make_start(band, u, domain, where);
}

/// The leaves with an edge between voxels, including edges to the next leaf, that the zero level set crosses.
std::vector<Coord> crossed_by(const std::vector<Coord>& leaves, const Sampler& sample) {
    return filter(leaves, [&](const Coord& o) {
        std::array<float, 9 * 9 * 9> values;
        sample(o, o.offsetBy(kLeafDim), values.data());
        return std::any_of(values.begin(), values.end(), [&](float v) { return (v < 0) != (values[0] < 0); });
    });
}

/// A start from a field whose zero level set is the surface.
/// @param beside  the leaves that the surface crosses, and those around them
FloatGridPtr start_on(const Domain& domain, const std::vector<Coord>& beside, const Sampler& sample, const char* where,
                      const RunContext& run) {
    run.check();
    const detail::CoordBBox box = detail::box_of(domain);
    const LeafBand band(beside);
    LeafArray<float> phi(band.size(), 0.0F);
    std::vector<detail::LeafMask> inside_domain(band.size());
    tbb::parallel_for(std::size_t(0), band.size(), [&](std::size_t leaf) {
        const Coord& o = band.origin(leaf);
        sample(o, o.offsetBy(kLeafDim - 1), phi.leaf(leaf));
        inside_domain[leaf] = detail::mask_in_box(o, box);
    });
    run.check();
    LeafArray<float> u = detail::signed_distance(band, phi, inside_domain, box, kWidth, run);
    return detail::make_start(band, u, domain, where);
}

/// @param crossed  the leaves that the surface crosses, sorted
FloatGridPtr start_from_field(const Domain& domain, const std::vector<Coord>& crossed, const Sampler& sample,
                              const char* where, const RunContext& run) {
    return start_on(domain, detail::dilate_leaves(crossed, 1, domain), sample, where, run);
}
FloatGridPtr start_from_field(const Domain& domain, const std::vector<Coord>& crossed, SampledLeaves& sampled,
                              const char* where, const RunContext& run) {
    const std::vector<Coord> beside = detail::dilate_leaves(crossed, 1, domain);
    return start_on(domain, beside, sampled.sampler(beside), where, run);
}

using detail::to_text;

/// 1 if the mask is above 0, else 0: values between those of different labels have no meaning.
Image binarised(const Image& mask) {
    const Index3 n = mask.geometry().size;
    const std::size_t count = std::size_t{1} * n[0] * n[1] * n[2];
    std::vector<std::uint8_t> values(count);
    tbb::parallel_for(0, n[2], [&](int k) {
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i)
                values[(std::size_t(k) * n[1] + j) * n[0] + i] = mask.at(i, j, k) > 0 ? 1 : 0;
    });
    return Image::from_values(mask.geometry(), values.data());
}

bool contains(const ImageGeometry& geometry, const Vec3& world) {
    const Vec3 at = geometry.world_to_index(world);
    for (int a = 0; a < 3; ++a)
        if (!(at[a] >= -0.5 && at[a] <= geometry.size[a] - 0.5)) return false;
    return true;
}

}  // namespace

FloatGridPtr start_from_sphere(const Domain& domain, const Vec3& center, double radius) {
    if (!(radius > 0) || !std::isfinite(radius) || !std::isfinite(length(center)))
        throw Error(Errc::InvalidOptions, "sphere: expected a finite center and a radius > 0, got " + to_text(center) +
                                              " and " + std::to_string(radius));
    const double reach = radius + kHalfWidthVoxels * domain.voxel_size;
    const WorldBox box{{center[0] - reach, center[1] - reach, center[2] - reach},
                       {center[0] + reach, center[1] + reach, center[2] + reach}};
    return start_from_distance(
        domain, box, [&](const Vec3& x) { return length(minus(x, center)) - radius; }, "start_from_sphere");
}

FloatGridPtr start_from_box(const Domain& domain, const WorldBox& box) {
    for (int a = 0; a < 3; ++a)
        if (!(box.max[a] > box.min[a]) || !std::isfinite(box.max[a] - box.min[a]))
            throw Error(Errc::InvalidOptions,
                        "box: expected a positive extent, got " + to_text(box.min) + " to " + to_text(box.max));
    WorldBox wide = box;
    for (int a = 0; a < 3; ++a) {
        wide.min[a] -= kHalfWidthVoxels * domain.voxel_size;
        wide.max[a] += kHalfWidthVoxels * domain.voxel_size;
    }
    const auto distance = [&](const Vec3& x) {
        Vec3 out;
        double deepest = -std::numeric_limits<double>::max();
        for (int a = 0; a < 3; ++a) {
            const double beyond = std::max(box.min[a] - x[a], x[a] - box.max[a]);
            deepest = std::max(deepest, beyond);
            out[a] = std::max(beyond, 0.0);
        }
        return deepest > 0 ? length(out) : deepest;
    };
    return start_from_distance(domain, wide, distance, "start_from_box");
}

FloatGridPtr start_from_mask(const Domain& domain, const Image& mask, const RunContext& run) {
    FloatGridPtr result;
    with_threads(run, [&] {
        const Image inside = binarised(mask);
        const ImageGeometry& geometry = mask.geometry();
        WorldBox box = geometry.world_box();
        for (int a = 0; a < 3; ++a) {
            box.min[a] -= domain.voxel_size;
            box.max[a] += domain.voxel_size;
        }
        const Sampler sample = [&](const Coord& lo, const Coord& hi, float* values) {
            inside.sample(domain, {lo.x(), lo.y(), lo.z()}, {hi.x(), hi.y(), hi.z()}, values);
            std::size_t n = 0;
            for (int i = lo.x(); i <= hi.x(); ++i)
                for (int j = lo.y(); j <= hi.y(); ++j)
                    for (int k = lo.z(); k <= hi.z(); ++k, ++n)
                        // Image::sample() repeats border values beyond the image's end, but the mask ends there.
                        values[n] = values[n] > 0 &&
                                            contains(geometry, domain.index_to_world({double(i), double(j), double(k)}))
                                        ? 0.5F - values[n]
                                        : 0.5F;
        };
        result = start_from_field(domain, crossed_by(leaves_in(domain, box), sample), sample, "start_from_mask", run);
    });
    return result;
}

FloatGridPtr start_from_contours(const Domain& domain, const ContourSolid& solid, const RunContext& run) {
    constexpr double kLeafRadius = 4.5 * 1.7320508;  // voxels, half of the diagonal of a leaf with its next layer
    FloatGridPtr result;
    with_threads(run, [&] {
        const std::vector<Coord> near = filter(leaves_in(domain, solid.box()), [&](const Coord& o) {
            return solid.may_meet(domain.index_to_world({o.x() + 4.0, o.y() + 4.0, o.z() + 4.0}),
                                  kLeafRadius * domain.voxel_size);
        });
        const Vec3 step{0, 0, domain.voxel_size};
        const Sampler sample = [&](const Coord& lo, const Coord& hi, float* values) {
            const int count = hi.z() - lo.z() + 1;
            for (int i = lo.x(); i <= hi.x(); ++i)
                for (int j = lo.y(); j <= hi.y(); ++j, values += count)
                    solid.levels(domain.index_to_world({double(i), double(j), double(lo.z())}), step, count, values);
        };
        SampledLeaves sampled(sample);
        result = start_from_field(domain, sampled.crossed_by(near), sampled, "start_from_contours", run);
    });
    return result;
}

FloatGridPtr start_from_level(const Domain& domain, const std::vector<Vec3>& seeds, const LevelRow& level,
                              const RunContext& run) {
    FloatGridPtr result;
    with_threads(run, [&] {
        const double h = domain.voxel_size;
        const Sampler sample = [&](const Coord& lo, const Coord& hi, float* values) {
            // level() takes as long for a row of one value as for one of eight. Rows therefore run along the last axis,
            // or along the middle axis in a layer that is only one voxel thick along the last axis.
            const bool is_layer = lo.z() == hi.z();
            const int count = is_layer ? hi.y() - lo.y() + 1 : hi.z() - lo.z() + 1;
            const Vec3 step = is_layer ? Vec3{0, h, 0} : Vec3{0, 0, h};
            std::array<double, kLeafDim> row;
            for (int i = lo.x(); i <= hi.x(); ++i)
                for (int j = lo.y(); j <= (is_layer ? lo.y() : hi.y()); ++j) {
                    level(domain.index_to_world({double(i), double(j), double(lo.z())}), step, count, row.data());
                    for (int n = 0; n < count; ++n) *values++ = float(row[std::size_t(n)]);
                }
        };
        SampledLeaves sampled(sample);
        result = start_from_field(domain, sampled.crossed_from(domain, seeds, run), sampled, "start_from_level", run);
    });
    return result;
}

FloatGridPtr start_from_grid(const Domain& domain, const FloatGrid& level_set, const RunContext& run) {
    FloatGridPtr result;
    with_threads(run, [&] {
        // Leaves of the domain that intersect a leaf of the level set.
        std::vector<Coord> candidates;
        for (auto leaf = level_set.tree().cbeginLeaf(); leaf; ++leaf) {
            const openvdb::CoordBBox voxels(leaf->origin().offsetBy(-1), leaf->origin().offsetBy(kLeafDim));
            const openvdb::BBoxd world = level_set.transform().indexToWorld(voxels);
            const WorldBox box{{world.min()[0], world.min()[1], world.min()[2]},
                               {world.max()[0], world.max()[1], world.max()[2]}};
            const std::vector<Coord> met = leaves_in(domain, box);
            candidates.insert(candidates.end(), met.begin(), met.end());
        }
        std::sort(candidates.begin(), candidates.end());
        candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
        const detail::ToSource to_source(domain, level_set.transform());
        if (!to_source.shift())
            candidates = filter(candidates, [&](const Coord& o) {
                return detail::may_cross(level_set, to_source.box(o, o.offsetBy(kLeafDim)));
            });
        const Sampler sample = detail::sampler_of(level_set, to_source);
        result = start_from_field(domain, crossed_by(candidates, sample), sample, "start_from_grid", run);
    });
    return result;
}

FloatGridPtr detail::carried_beyond(const FloatGrid& start, const Domain& domain, const Clip& image,
                                    const RunContext& run) {
    constexpr double kLeafRadius = 4.5 * 1.7320508;  // voxels, half of the diagonal of a leaf with its next layer
    const double h = domain.voxel_size;
    // If the start ends at the image's end, its values are valid only from 1.5 voxels inside that end inwards.
    Clip within = image;
    for (HalfSpace& plane : within) plane.offset -= 1.5 * h;
    FloatGridPtr result;
    with_threads(run, [&] {
        std::vector<Coord> candidates = filter(leaves_in(domain, domain.world_box()), [&](const Coord& o) {
            const Vec3 middle = domain.index_to_world({o.x() + 4.0, o.y() + 4.0, o.z() + 4.0});
            return depth_in(within, middle) > -kLeafRadius * h;
        });
        std::vector<Coord> own;
        for (auto leaf = start.tree().cbeginLeaf(); leaf; ++leaf) own.push_back(leaf->origin());
        std::sort(own.begin(), own.end());
        const std::vector<Coord> beside = dilate_leaves(own, 1, domain);
        candidates.insert(candidates.end(), beside.begin(), beside.end());
        std::sort(candidates.begin(), candidates.end());
        candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
        const Sampler sample = [&](const Coord& lo, const Coord& hi, float* values) {
            const auto accessor = start.getConstAccessor();
            for (int i = lo.x(); i <= hi.x(); ++i)
                for (int j = lo.y(); j <= hi.y(); ++j)
                    for (int k = lo.z(); k <= hi.z(); ++k) {
                        const Vec3 at = domain.index_to_world({double(i), double(j), double(k)});
                        if (!(depth_in(within, at) > 0)) {
                            *values++ = accessor.getValue(Coord(i, j, k));
                            continue;
                        }
                        const Vec3 inner = domain.world_to_index(projected(within, at));
                        *values++ =
                            openvdb::tools::BoxSampler::sample(accessor, openvdb::Vec3d(inner[0], inner[1], inner[2]));
                    }
        };
        const std::vector<Coord> crossed = crossed_by(candidates, sample);
        if (!crossed.empty()) result = start_from_field(domain, crossed, sample, "carried_beyond", run);
    });
    return result;
}

}  // namespace covol
