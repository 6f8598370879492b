// Compares the kernel for the nearest points in a leaf with plain loops that compute the same.
#include "distance/nearest_kernel.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>

using covol::detail::NearestBlock;

namespace {

struct StoredPoint {
    float x = NearestBlock::kFar, y = NearestBlock::kFar, z = NearestBlock::kFar;
};

void set(NearestBlock& block, int i, int j, int k, const StoredPoint& point, int index) {
    const int at = NearestBlock::offset(i, j, k);
    block.x[at] = point.x;
    block.y[at] = point.y;
    block.z[at] = point.z;
    block.index[at] = index;
}

/// Squared distance from the point that is stored at the voxel `holder` to the voxel `place`.
double squared(const NearestBlock& block, const std::array<int, 3>& holder, const std::array<int, 3>& place) {
    const int at = NearestBlock::offset(holder[0], holder[1], holder[2]);
    const double x = block.x[at] - place[0], y = block.y[at] - place[1], z = block.z[at] - place[2];
    return x * x + y * y + z * z;
}

std::unique_ptr<NearestBlock> no_points() {
    auto block = std::make_unique<NearestBlock>();
    for (int i = -1; i <= 8; ++i)
        for (int j = -1; j <= 8; ++j)
            for (int k = -1; k <= 8; ++k) set(*block, i, j, k, {}, -1);
    return block;
}

/// Whether a voxel of the halo beyond a face of the block would get a nearer point, at a squared distance of at most
/// `reach`. Face 2a is at the minimum coordinate along axis a, face 2a + 1 at the maximum. A halo voxel takes points
/// from three voxels of the face: the one beside it, and that one's neighbours along the axis `across`.
bool improves_halo(const NearestBlock& block, int face, double reach) {
    const int axis = face / 2, across = axis == 0 ? 1 : 0, along = axis == 2 ? 1 : 2;
    const int own = face % 2 == 0 ? 0 : 7, halo = face % 2 == 0 ? -1 : 8;
    for (int r = 0; r < 8; ++r)
        for (int n = 0; n < 8; ++n) {
            std::array<int, 3> place{};
            place[axis] = halo;
            place[across] = r;
            place[along] = n;
            const double known = squared(block, place, place);
            for (int step = -1; step <= 1; ++step) {
                std::array<int, 3> holder = place;
                holder[axis] = own;
                holder[across] = r + step;
                const double offered = squared(block, holder, place);
                if (offered < known && offered <= reach) return true;
            }
        }
    return false;
}

}  // namespace

TEST_CASE("improved_faces: the faces that offer the halo a nearer point are those of a plain loop") {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> place(-3.0F, 10.0F);
    std::uniform_int_distribution<int> voxel(-1, 8), kind(0, 9);
    std::array<int, 6> found_in{}, unimproved{};
    for (int round = 0; round < 4000; ++round) {
        const auto block = no_points();
        // One or two points, each at a random voxel of the block or of the halo around it.
        for (int count = 1 + round % 2; count > 0; --count)
            set(*block, voxel(random), voxel(random), voxel(random), {place(random), place(random), place(random)},
                count);
        const double reach = kind(random) == 0 ? 4.0 : 400.0;
        const unsigned improved = covol::detail::improved_faces(*block, float(reach));
        for (int face = 0; face < 6; ++face) {
            const bool expected = improves_halo(*block, face, reach);
            INFO("round " << round << ", face " << face);
            REQUIRE((improved >> face & 1U) == unsigned(expected));
            ++(expected ? found_in : unimproved)[face];
        }
        REQUIRE(improved < 64);
    }
    for (int face = 0; face < 6; ++face) {
        CHECK(found_in[face] > 100);
        CHECK(unimproved[face] > 100);
    }
}

TEST_CASE("sweep_nearest: a single point reaches every voxel of the leaf") {
    for (const std::array<int, 3>& from :
         {std::array{0, 0, 0}, {7, 7, 7}, {3, 0, 7}, {-1, 4, 4}, {4, 8, 2}, {5, 2, -1}}) {
        const auto block = no_points();
        const StoredPoint point{float(from[0]) + 0.2F, float(from[1]) - 0.3F, float(from[2]) + 0.1F};
        set(*block, from[0], from[1], from[2], point, 7);
        covol::detail::sweep_nearest(*block);
        std::array<float, 512> distances{};
        covol::detail::squared_distances(*block, distances.data());
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                for (int k = 0; k < 8; ++k) {
                    REQUIRE(block->index[NearestBlock::offset(i, j, k)] == 7);
                    const double x = i - point.x, y = j - point.y, z = k - point.z;
                    REQUIRE(distances[(i * 8 + j) * 8 + k] == Approx(x * x + y * y + z * z).epsilon(1e-5));
                }
    }
}

TEST_CASE("sweep_nearest: each voxel gets the nearer of two points, except for at most 0.2 % of the voxels") {
    std::mt19937 random(9);
    std::uniform_real_distribution<float> place(-0.5F, 7.5F);
    int wrong = 0, all = 0;
    for (int round = 0; round < 200; ++round) {
        const auto block = no_points();
        std::array<StoredPoint, 2> points{};
        for (int n = 0; n < 2; ++n) {
            points[n] = {place(random), place(random), place(random)};
            const std::array<int, 3> voxel{int(std::lround(points[n].x)), int(std::lround(points[n].y)),
                                           int(std::lround(points[n].z))};
            if (block->index[NearestBlock::offset(voxel[0], voxel[1], voxel[2])] >= 0) points[n] = points[0];
            set(*block, voxel[0], voxel[1], voxel[2], points[n], n);
        }
        covol::detail::sweep_nearest(*block);
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                for (int k = 0; k < 8; ++k) {
                    const auto off = [&](const StoredPoint& p) {
                        return (i - p.x) * (i - p.x) + (j - p.y) * (j - p.y) + (k - p.z) * (k - p.z);
                    };
                    const float nearest = std::min(off(points[0]), off(points[1]));
                    const int held = block->index[NearestBlock::offset(i, j, k)];
                    REQUIRE(held >= 0);
                    wrong += off(points[held]) > nearest + 1e-4F;
                    ++all;
                }
    }
    CHECK(wrong < 0.002 * all);
}

TEST_CASE("store_points: points are stored as by a plain loop, and changes within reach are flagged") {
    std::mt19937 random(6);
    std::uniform_real_distribution<float> place(-3.0F, 10.0F);
    std::uniform_int_distribution<int> index(0, 2);
    constexpr float kReach = 20;
    for (const bool all : {false, true}) {
        const auto block = no_points();
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                for (int k = 0; k < 8; ++k)
                    set(*block, i, j, k, {place(random), place(random), place(random)}, index(random));
        std::array<std::int32_t, 512> nearest{};
        for (std::int32_t& n : nearest) n = index(random);
        const auto before = nearest;
        std::array<std::uint64_t, 8> changed{};
        covol::detail::store_points(*block, kReach, all, nearest.data(), changed.data());
        int found_in = 0;
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                for (int k = 0; k < 8; ++k) {
                    const std::size_t at = std::size_t((i * 8 + j) * 8 + k);
                    const std::int32_t now = block->index[NearestBlock::offset(i, j, k)];
                    REQUIRE(nearest[at] == now);
                    const bool is_changed =
                        (all || now != before[at]) && squared(*block, {i, j, k}, {i, j, k}) <= double(kReach);
                    REQUIRE((changed[std::size_t(i)] >> (8 * j + k) & 1) == std::uint64_t(is_changed));
                    found_in += is_changed;
                }
        CHECK(found_in > 50);
        CHECK(found_in < 450);
    }
}
