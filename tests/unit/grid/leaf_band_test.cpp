#include "grid/leaf_band.h"

#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <set>
#include <vector>

using namespace covol::detail;

TEST_CASE("LeafBand: neighbours are those of a plain search, near the origin and where keys wrap around") {
    const int center = GENERATE(0, 1 << 23, -(1 << 23), (1 << 23) - 8);
    // Leaves are drawn at random within this many leaves of the centre. With 2 all of them are present, with 6 there
    // are some gaps, and with 40 they are far apart.
    const int width = GENERATE(2, 6, 40);
    INFO("around " << center << ", " << width);
    std::mt19937_64 random(5);
    std::uniform_int_distribution<int> step(-width, width - 1);
    std::set<Coord> drawn;
    for (int n = 0; n < 900; ++n)
        drawn.insert(Coord(center) + Coord(step(random) * kLeafDim, step(random) * kLeafDim, step(random) * kLeafDim));
    const LeafBand band(std::vector<Coord>(drawn.begin(), drawn.end()));

    std::map<Coord, std::int32_t> leaf_at;
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf) leaf_at[band.origin(leaf)] = std::int32_t(leaf);
    REQUIRE(leaf_at.size() == drawn.size());
    const auto expected = [&](const Coord& origin) {
        const auto found = leaf_at.find(origin);
        return found == leaf_at.end() ? band.none() : found->second;
    };
    int wrong = 0;
    for (std::size_t leaf = 0; leaf < band.size(); ++leaf)
        for (int slot = 0; slot < 27; ++slot) {
            const Coord origin = neighbour_origin(band.origin(leaf), slot);
            wrong += band.neighbours(leaf)[slot] != expected(origin);
            wrong += band.find(origin) != expected(origin);
        }
    CHECK(wrong == 0);
    CHECK(neighbour_origin({8, 16, 24}, neighbour_slot(-1, 0, 1)) == Coord(0, 16, 32));
}
