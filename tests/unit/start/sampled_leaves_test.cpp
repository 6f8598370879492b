#include "start/sampled_leaves.h"

#include <openvdb/openvdb.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "covol/start.h"
#include "grid/leaf_band.h"
#include "redistance/signed_distance.h"
#include "support/clouds.h"

using namespace covol;
using namespace covol::test;

namespace {

const Domain kDomain = make_domain({{0, 0, 0}, {48, 47, 46}}, 1.0);

using Level = std::function<double(const Vec3&)>;

/// The start from all values of the level set in the domain, without skipping leaves.
FloatGridPtr start_from_all(const Level& level) {
    const Domain& domain = kDomain;
    FloatGridPtr all = make_grid(domain, 100, "all");
    auto values = all->getAccessor();
    for (int i = domain.min[0] - 9; i <= domain.max[0] + 9; ++i)
        for (int j = domain.min[1] - 9; j <= domain.max[1] + 9; ++j)
            for (int k = domain.min[2] - 9; k <= domain.max[2] + 9; ++k)
                values.setValue({i, j, k}, float(level(world_of(domain, {i, j, k}))));
    return start_from_grid(domain, *all);
}

double box(const Vec3& x, double low, double high) {
    double out = -1e9;
    for (const double v : x) out = std::max({out, low - v, v - high});
    return out;
}

double ball(const Vec3& x, const Vec3& center, double radius) {
    return std::hypot(x[0] - center[0], x[1] - center[1], x[2] - center[2]) - radius;
}

struct Body {
    const char* name;
    Level level;
    std::vector<Vec3> seeds;
};

std::vector<Body> bodies() {
    return {
        Body{"a ball",
             [](const Vec3& x) {
                 return ball(x, {21.3, 19.9, 23.1}, 13.7);
             },
             {{35, 20, 23}}},
        Body{"a box, its faces between leaves", [](const Vec3& x) { return box(x, 7.5, 31.5); }, {{7.5, 20, 20}}},
        Body{
            "a box, its faces at the first voxels of leaves", [](const Vec3& x) { return box(x, 8, 32); }, {{8, 9, 9}}},
        Body{"a cavity, with a seed of its own",
             [](const Vec3& x) {
                 return std::max(box(x, 3.2, 44.7), -ball(x, {24, 24, 24}, 8.1));
             },
             {{3, 20, 20}, {24, 24, 32}}},
        Body{"a folded sheet",
             [](const Vec3& x) {
                 return std::max(std::sin(0.3 * x[0]) * std::cos(0.3 * x[1]) +
                                     std::sin(0.3 * x[1]) * std::cos(0.3 * x[2]) +
                                     std::sin(0.3 * x[2]) * std::cos(0.3 * x[0]),
                                 0.1 * ball(x, {24, 24, 24}, 19.3));
             },
             {{24, 24, 24}, {24, 24, 43}, {24, 43, 24}, {43, 24, 24}}},
        Body{"a speck beside its seed's leaf",
             [](const Vec3& x) {
                 return ball(x, {20.2, 20.1, 20.3}, 1.2);
             },
             {{15, 20, 20}}}};
}

LevelRow row_of(const Level& level, std::atomic<int>& rows) {
    return [level, &rows](const Vec3& from, const Vec3& step, int count, double* values) {
        for (int n = 0; n < count; ++n)
            values[n] = level({from[0] + n * step[0], from[1] + n * step[1], from[2] + n * step[2]});
        ++rows;
    };
}

}  // namespace

TEST_CASE("A start from a function evaluated on parts of leaves equals the start from all its values") {
    const Body body = GENERATE(from_range(bodies()));
    INFO(body.name);
    std::atomic<int> rows{0};
    const FloatGridPtr start = start_from_level(kDomain, body.seeds, row_of(body.level, rows));
    CHECK(identical(*start, *start_from_all(body.level)));
}

TEST_CASE("Signed distances computed from sampled parts of the crossed leaves equal those from all values") {
    using namespace covol::detail;
    const Body body = GENERATE(from_range(bodies()));
    INFO(body.name);
    const Sampler sample = [&](const Coord& lo, const Coord& hi, float* values) {
        for (auto voxel = CoordBBox(lo, hi).begin(); voxel; ++voxel)
            *values++ = float(body.level(world_of(kDomain, *voxel)));
    };
    std::vector<Coord> all;
    for (int n = 0; n < 6 * 6 * 6; ++n) all.emplace_back(n / 36 * kLeafDim, n / 6 % 6 * kLeafDim, n % 6 * kLeafDim);
    SampledLeaves all_leaves(sample), crossed_leaves(sample);
    const std::vector<Coord> crossed = all_leaves.crossed_by(all);
    REQUIRE(crossed_leaves.crossed_by(crossed) == crossed);

    const std::vector<Coord> beside = dilate_leaves(crossed, 1, kDomain);
    const Sampler parts = crossed_leaves.sampler(beside);
    const LeafBand band(beside);
    const CoordBBox box = box_of(kDomain);
    const auto distance = [&](const Sampler& values) {
        LeafArray<float> phi(band.size(), 0.0F);
        std::vector<LeafMask> inside;
        for (std::size_t leaf = 0; leaf < band.size(); ++leaf) {
            values(band.origin(leaf), band.origin(leaf).offsetBy(kLeafDim - 1), phi.leaf(leaf));
            inside.push_back(mask_in_box(band.origin(leaf), box));
        }
        return signed_distance(band, phi, inside, box, 3, {});
    };
    const LeafArray<float> expected = distance(sample), found = distance(parts);
    int wrong = 0;
    for (std::size_t n = 0; n < band.size() * kLeafSize; ++n) wrong += expected.leaf(0)[n] != found.leaf(0)[n];
    CHECK(wrong == 0);
}

TEST_CASE("Near a surface, a function is evaluated in less than two thirds of the rows of its leaves") {
    const Domain domain = make_domain({{0, 0, 0}, {96, 96, 96}}, 1.0);
    std::atomic<int> rows{0};
    const FloatGridPtr start = start_from_level(domain, {{78, 48, 48}},
                                                row_of(
                                                    [](const Vec3& x) {
                                                        return ball(x, {48.1, 47.7, 48.2}, 30);
                                                    },
                                                    rows));
    std::vector<openvdb::Coord> crossed;
    for (auto leaf = start->tree().cbeginLeaf(); leaf; ++leaf) crossed.push_back(leaf->origin());
    const std::size_t whole = 64 * detail::dilate_leaves(crossed, 1, domain).size();
    INFO(rows << " rows, " << whole << " in all of those leaves");
    CHECK(3 * std::size_t(rows) < 2 * whole);
}
