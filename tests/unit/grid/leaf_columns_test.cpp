#include "grid/leaf_columns.h"

#include <catch2/catch.hpp>
#include <random>
#include <vector>

using namespace covol::detail;

TEST_CASE("spread: a leaf mask grows through faces only, as by a plain flood fill") {
    std::mt19937_64 random(1);
    std::uniform_int_distribution<int> percent(0, 99), any(0, kLeafSize - 1);
    for (int round = 0; round < 300; ++round) {
        const int density = 10 + round % 9 * 10;
        LeafMask open{}, mask{};
        for (int at = 0; at < kLeafSize; ++at)
            if (percent(random) < density) set_on(open, at);
        const int start = any(random);
        set_on(open, start);
        set_on(mask, start);

        LeafMask expected = mask;
        std::vector<int> stack{start};
        while (!stack.empty()) {
            const int at = stack.back();
            stack.pop_back();
            for (const int shift : {6, 3, 0})
                for (const int sign : {-1, 1}) {
                    const int c = (at >> shift & 7) + sign, next = at + sign * (1 << shift);
                    if (c < 0 || c > 7 || !is_on(open, next) || is_on(expected, next)) continue;
                    set_on(expected, next);
                    stack.push_back(next);
                }
        }
        spread(mask, open);
        REQUIRE(mask == expected);
    }
}
