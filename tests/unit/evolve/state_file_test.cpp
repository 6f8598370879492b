#include "evolve/state_file.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "covol/error.h"
#include "support/scratch.h"

using covol::Error;
using covol::detail::StateFile;

namespace {

struct State {
    double time = 0;
    std::vector<float> values;
    std::uint8_t fixed[3] = {};
    void exchange(StateFile& file) {
        file.value(time);
        file.list(values);
        file.same(7);
        file.array(fixed, 3);
        file.finish();
    }
};

std::string read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void write(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary | std::ios::trunc).write(text.data(), std::streamsize(text.size()));
}

void load(const std::string& path) {
    State state;
    StateFile file(path, StateFile::Mode::Read);
    state.exchange(file);
}

}  // namespace

TEST_CASE("A state is restored bit by bit from its file") {
    const Scratch folder;
    State written{0.1, {1.5F, -2.25F, std::numeric_limits<float>::denorm_min()}, {1, 2, 255}}, back;
    {
        StateFile file(folder.path("s"), StateFile::Mode::Write);
        written.exchange(file);
    }
    StateFile file(folder.path("s"), StateFile::Mode::Read);
    back.exchange(file);
    CHECK(back.time == written.time);
    CHECK(back.values == written.values);
    CHECK(std::equal(back.fixed, back.fixed + 3, written.fixed));
}

TEST_CASE("A state file that is damaged at any byte, truncated, too long or missing is rejected") {
    const Scratch folder;
    const std::string path = folder.path("s");
    {
        State written{0.1, {1, 2, 3}, {1, 2, 3}};
        StateFile file(path, StateFile::Mode::Write);
        written.exchange(file);
    }
    const std::string sound = read(path);
    REQUIRE_NOTHROW(load(path));
    for (std::size_t n = 0; n < sound.size(); ++n) {
        std::string damaged = sound;
        damaged[n] = char(damaged[n] ^ 0x41);
        write(path, damaged);
        CHECK_THROWS_AS(load(path), Error);
        write(path, sound.substr(0, n));
        CHECK_THROWS_AS(load(path), Error);
    }
    write(path, sound + "x");
    CHECK_THROWS_AS(load(path), Error);
    CHECK_THROWS_AS(load(folder.path("none")), Error);
}
