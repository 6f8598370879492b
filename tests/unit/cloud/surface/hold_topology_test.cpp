#include "cloud/surface/hold_topology.h"

#include <openvdb/openvdb.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/error.h"
#include "covol/mesh.h"
#include "covol/surface.h"

using namespace covol;

namespace {

constexpr int kSide = 24;

Domain cube() {
    Domain domain;
    domain.max = {kSide - 1, kSide - 1, kSide - 1};
    return domain;
}

/// A level set with the values -1 where inside(i, j, k) is true and 1 elsewhere; all voxels are active.
template <typename Inside>
FloatGridPtr level_set(Inside inside) {
    const FloatGridPtr grid = make_grid(cube(), 3.0F, "u");
    auto at = grid->getAccessor();
    for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j)
            for (int k = 0; k < kSide; ++k) at.setValue({i, j, k}, inside(i, j, k) ? -1.0F : 1.0F);
    return grid;
}

bool is_border(int i, int j, int k) {
    for (const int n : {i, j, k})
        if (n < 2 || n > kSide - 3) return true;
    return false;
}

double radius_at(int i, int j, int k) {
    const double middle = 0.5 * (kSide - 1);
    return std::hypot(i - middle, j - middle, k - middle);
}

double distance_to_ring(int i, int j, int k) {
    const double middle = 0.5 * (kSide - 1);
    return std::hypot(std::hypot(i - middle, j - middle) - 6, k - middle);
}

}  // namespace

TEST_CASE("hold_topology: random targets get the pieces and handles of the rough surface") {
    for (unsigned seed = 1; seed <= 8; ++seed) {
        std::mt19937 random(seed);
        const FloatGridPtr ball = level_set([](int i, int j, int k) { return radius_at(i, j, k) < 7; });
        const FloatGridPtr ring = level_set([](int i, int j, int k) { return distance_to_ring(i, j, k) < 3; });
        const FloatGridPtr noise =
            level_set([&](int i, int j, int k) { return !is_border(i, j, k) && random() % 2 == 0; });
        for (const auto& [rough, genus] : {std::pair{ball, 0}, std::pair{ring, 1}}) {
            const FloatGridPtr held = noise->deepCopy();
            const std::size_t left = cloud::hold_topology(*rough, *held, {});
            CHECK(left > 0);
            const MeshMeasures m = measure(extract_mesh(*held));
            CHECK(m.closed);
            CHECK(m.components == 1);
            CHECK(m.genus == genus);
        }
    }
}

TEST_CASE("hold_topology: a target that differs in more voxels than the limit keeps its topology") {
    const FloatGridPtr small = level_set([](int i, int j, int k) { return radius_at(i, j, k) < 5; });
    const FloatGridPtr large =
        level_set([](int i, int j, int k) { return radius_at(i, j, k) < 7 && radius_at(i, j, k) > 2; });
    std::size_t differ = 0;
    for (auto value = large->cbeginValueOn(); value; ++value)
        differ += (*value < 0) != (small->tree().getValue(value.getCoord()) < 0);
    const FloatGridPtr left = large->deepCopy(), held = large->deepCopy();
    CHECK(cloud::hold_topology(*small, *left, {}, differ - 1) == 0);
    for (auto value = large->cbeginValueOn(); value; ++value)
        REQUIRE(left->tree().getValue(value.getCoord()) == *value);
    CHECK(measure(extract_mesh(*left)).components == 2);  // the surface around the cavity is a component of its own
    CHECK(cloud::hold_topology(*small, *held, {}, differ) > 0);
    CHECK(measure(extract_mesh(*held)).components == 1);
}

TEST_CASE("hold_topology: two pieces are kept apart at the narrowest part of the target") {
    const double middle = 0.5 * (kSide - 1);
    for (const int narrow : {8, 12, 15}) {
        // `target` consists of two blocks and a bar between them, which is thinner at i == narrow. `rough` lacks the
        // bar.
        const auto bar = [&](int i, int j, int k) {
            return std::hypot(j - middle, k - middle) < (i == narrow ? 1.5 : 4);
        };
        const FloatGridPtr target =
            level_set([&](int i, int j, int k) { return !is_border(i, j, k) && (i < 5 || i > 18 || bar(i, j, k)); });
        const FloatGridPtr rough =
            level_set([&](int i, int j, int k) { return !is_border(i, j, k) && (i < 5 || i > 18); });
        std::size_t minimum = 0;
        for (int j = 0; j < kSide; ++j)
            for (int k = 0; k < kSide; ++k) minimum += bar(narrow, j, k);
        CHECK(cloud::hold_topology(*rough, *target, {}) == minimum);
        CHECK(measure(extract_mesh(*target)).components == 2);
    }
}

TEST_CASE("hold_topology: no voxels are added beyond the domain, and a run can be cancelled") {
    const FloatGridPtr rough = level_set([](int, int, int k) { return k < 8; });
    FloatGridPtr target = level_set([](int i, int j, int k) { return k < 12 && radius_at(i, j, k) > 4; });
    const std::size_t all = target->activeVoxelCount();
    // A flood fill continues a solid that the domain cuts off beyond the domain, without end. Here only `target` is
    // continued, by a tile; hold_topology() must not add voxels there.
    target->tree().root().addTile(openvdb::Coord(0, 0, -4096), -3.0F, false);
    static_cast<void>(cloud::hold_topology(*rough, *target, {}));
    CHECK(target->activeVoxelCount() == all);
    CHECK(target->evalActiveVoxelBoundingBox().min() == openvdb::Coord(0, 0, 0));

    const std::atomic<bool> cancel = true;
    RunContext run;
    run.cancel = &cancel;
    try {
        static_cast<void>(cloud::hold_topology(*rough, *level_set([](int, int, int k) { return k < 12; }), run));
        FAIL("not cancelled");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::Cancelled);
    }
}
