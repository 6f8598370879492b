// Zarr stores, intact and damaged. tests/cli/zarr_test.py reads what zarr-python writes.
#include <catch2/catch.hpp>
#include <cstring>
#include <nlohmann/json.hpp>

#include "covol/image.h"
#include "support/scratch.h"
#include "unit/io/chunked/zarr_stores.h"

using namespace covol;
namespace fs = std::filesystem;

namespace {

const std::vector<std::string> kCodecs{"",          "zstd",       "zlib",      "lz4", "blosc-blosclz",
                                       "blosc-lz4", "blosc-zlib", "blosc-zstd"};

/// The expected value of voxel (i,j,k) in the stores of zarr_stores.h.
int voxel(int i, int j, int k) {
    const std::string bytes = zarr_stores::random_bytes(1024, unsigned(k / 8 * 4 + j / 8 * 2 + i / 8));
    std::uint16_t value = 0;
    std::memcpy(&value, bytes.data() + 2 * ((k % 8 * 8 + j % 8) * 8 + i % 8), 2);
    return value;
}

std::vector<std::string> files_of(const std::string& folder) {
    std::vector<std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    return files;
}

struct Outcomes {
    int read = 0, refused = 0;
};

/// Reads the store with `bytes` in place of a file's content; exceptions other than covol::Error are passed on to the
/// test.
void try_with(const std::string& store, const std::string& file, const std::string& bytes, Outcomes& outcomes) {
    const std::string good = bytes_of(file);
    std::ofstream(file, std::ios::binary) << bytes;
    try {
        const Image image = read_image(store);
        static_cast<void>(image.range());
        ++outcomes.read;
    } catch (const Error& error) {
        CHECK(std::string(error.what()).find(": ") != std::string::npos);
        ++outcomes.refused;
    }
    std::ofstream(file, std::ios::binary) << good;
}

std::string mutated(const std::string& good, std::mt19937& random) {
    std::string bad = good;
    switch (random() % 4) {
        case 0: bad.resize(random() % good.size()); break;
        case 1: bad.insert(random() % good.size(), 1 + random() % 20, static_cast<char>(random())); break;
        default:
            for (unsigned flips = 0; flips <= random() % 4; ++flips)
                bad[random() % (random() % 2 == 0 ? std::min<std::size_t>(40, bad.size()) : bad.size())] ^=
                    static_cast<char>(1U << random() % 8);
    }
    return bad;
}

/// A value of an unexpected type or range.
nlohmann::json odd_value(std::mt19937& random) {
    static const std::vector<nlohmann::json> kValues{nullptr,
                                                     true,
                                                     0,
                                                     1,
                                                     -1,
                                                     2147483647,
                                                     4294967296U,
                                                     18446744073709551615U,
                                                     1e308,
                                                     0.5,
                                                     "",
                                                     "..",
                                                     "../../x",
                                                     "/etc",
                                                     "NaN",
                                                     nlohmann::json::array(),
                                                     nlohmann::json::object(),
                                                     {1, 2, 3},
                                                     {0, 0, 0},
                                                     {1000000, 1000000, 1000000},
                                                     {16, 16},
                                                     "F",
                                                     "<f8",
                                                     "0x7fc00000"};
    return kValues[random() % kValues.size()];
}

}  // namespace

TEST_CASE("Zarr: each codec returns the voxels that were written") {
    const Scratch scratch;
    std::vector<std::string> stores;
    for (const std::string& codec : kCodecs) stores.push_back(zarr_stores::write_2(scratch.path("a" + codec), codec));
    stores.push_back(zarr_stores::write_3(scratch.path("v3")));
    for (const std::string& store : stores) {
        INFO(store);
        const bool shards = store == stores.back();
        const Image image = read_image(store);
        CHECK(image.geometry().spacing == (shards ? Vec3{1, 1, 1} : Vec3{0.5, 0.5, 2}));
        CHECK(image.geometry().origin == (shards ? Vec3{0, 0, 0} : Vec3{3, 2, 1}));
        for (const Index3& v : {Index3{0, 0, 0}, Index3{1, 2, 3}, Index3{15, 15, 15}, Index3{7, 8, 9}})
            CHECK(image.at(v[0], v[1], v[2]) == voxel(v[0], v[1], v[2]));
        CHECK(image.at(12, 3, 13) == (shards ? 7 : voxel(12, 3, 13)));  // chunk 5 of the shard is missing
        CHECK(image.chunks()->read == 8);
        ReadImageOptions options;
        options.roi = shards ? WorldBox{{1, 1, 1}, {3, 3, 3}} : WorldBox{{4, 3, 4}, {4.5, 3.5, 5}};
        CHECK(read_image(store, options).chunks()->read == 1);
    }
}

TEST_CASE("Zarr: random damage in a chunk does not crash, and a chunk of wrong length is an error with its path") {
    const Scratch scratch;
    for (const std::string& codec : kCodecs) {
        INFO(codec);
        const std::string store = zarr_stores::write_2(scratch.path("a" + codec), codec);
        std::mt19937 random(3);
        Outcomes outcomes;
        for (const std::string& file : files_of(store + "/0")) {
            const std::string good = bytes_of(file);
            for (int n = 0; n < 40; ++n) try_with(store, file, mutated(good, random), outcomes);
        }
        CHECK(outcomes.refused >= (codec.empty() ? 100 : 150));
        const std::string chunk = store + "/0/0.1.0", good = bytes_of(chunk);
        for (const std::string& bad :
             {std::string(), good.substr(0, 3), good.substr(0, good.size() / 2), good + good}) {
            std::ofstream(chunk, std::ios::binary) << bad;
            INFO(bad.size());
            const std::string message = message_of([&] { static_cast<void>(read_image(store)); });
            CHECK(message.find("0/0.1.0: ") != std::string::npos);
        }
    }
}

TEST_CASE("Zarr: a chunk larger than the array is cropped, and a size that its bytes cannot hold is an error") {
    const Scratch scratch;
    const std::string store = scratch.path("a");
    for (const std::string& codec : kCodecs) {
        INFO(codec);
        zarr_stores::write(store + "/.zarray", zarr_stores::metadata_2(5, 8, "<u2", codec, "7"));
        zarr_stores::write(store + "/0.0.0", zarr_stores::pack(codec, zarr_stores::random_bytes(1024, 0)));
        const Image image = read_image(store);
        CHECK(image.chunks()->size == Index3{5, 5, 5});
        for (const Index3& v : {Index3{0, 0, 0}, Index3{4, 0, 0}, Index3{0, 4, 0}, Index3{1, 2, 4}, Index3{4, 4, 4}})
            CHECK(image.at(v[0], v[1], v[2]) == voxel(v[0], v[1], v[2]));
        // The metadata now claims a chunk of 256 MiB. The store does not contain it, and its few bytes cannot decode to
        // it.
        zarr_stores::write(store + "/.zarray", zarr_stores::metadata_2(5, 512, "<u2", codec, "7"));
        CHECK(message_of([&] { static_cast<void>(read_image(store)); }).find("0.0.0: ") != std::string::npos);
        if (!codec.empty())
            CHECK(message_of([&] { static_cast<void>(read_image(store)); }).find("cannot hold") != std::string::npos);
        fs::remove(store + "/0.0.0");
        CHECK(read_image(store).range() == std::array<double, 2>{7, 7});
        CHECK(read_image(store).chunks()->size == Index3{5, 5, 5});
    }
}

TEST_CASE("Zarr: at most a tenth of randomly damaged shards can be read") {
    const Scratch scratch;
    const std::string store = zarr_stores::write_3(scratch.path("v3")), shard = store + "/c/0/0/0";
    std::mt19937 random(4);
    Outcomes outcomes;
    for (int n = 0; n < 400; ++n) try_with(store, shard, mutated(bytes_of(shard), random), outcomes);
    // Some damaged files can be read: a bit was flipped twice, or the bytes that changed belong to no chunk.
    CHECK(outcomes.read <= 40);
}

TEST_CASE("Zarr: damaged metadata is an error or is read, without a crash") {
    const Scratch scratch;
    for (const std::string& store :
         {zarr_stores::write_2(scratch.path("v2"), "zstd"), zarr_stores::write_3(scratch.path("v3"))}) {
        std::mt19937 random(5);
        Outcomes outcomes;
        for (const std::string& file : files_of(store)) {
            const std::string name = fs::path(file).filename().string();
            if (!name.starts_with(".z") && name != "zarr.json") continue;
            const std::string good = bytes_of(file);
            for (int n = 0; n < 200; ++n) try_with(store, file, mutated(good, random), outcomes);
            const nlohmann::json whole = nlohmann::json::parse(good), flat = whole.flatten();
            for (const auto& [place, value] : flat.items())
                for (int n = 0; n < 12; ++n) {
                    nlohmann::json bad = whole;
                    // The value is replaced, or every fourth time the object or array that contains it.
                    nlohmann::json::json_pointer at(place);
                    if (n % 4 == 3 && !at.parent_pointer().empty()) at = at.parent_pointer();
                    bad[at] = odd_value(random);
                    INFO(bad.dump());
                    try_with(store, file, bad.dump(), outcomes);
                }
        }
        CHECK(outcomes.refused > 300);
        CHECK(outcomes.read > 10);
    }
}

TEST_CASE("Zarr: metadata that is too large, too deep or no JSON, or that claims too large a size, is rejected") {
    const Scratch scratch;
    const std::string store = scratch.path("a");
    const auto message = [&](const std::string& text) {
        zarr_stores::write(store + "/.zarray", text);
        return message_of([&] { static_cast<void>(read_image(store)); });
    };
    CHECK(message(std::string(100000, '[')).find("deep") != std::string::npos);
    CHECK(message("{\"a\":").find("not valid JSON, from byte 6 on") != std::string::npos);
    CHECK(message("[]").find("expected a JSON object") != std::string::npos);
    fs::resize_file(store + "/.zarray", std::uintmax_t(65) << 20);
    CHECK(message_of([&] { static_cast<void>(read_image(store)); }).find("64 MiB at most") != std::string::npos);
    // The size that the metadata claim is compared with the file before any memory is allocated.
    CHECK(message(zarr_stores::metadata_2(1 << 20, 8, "|u1", "")).find("claims") != std::string::npos);
    CHECK(message(zarr_stores::metadata_2(2048, 2048, "|u1", "")).find("1 GiB at most") != std::string::npos);
}

TEST_CASE("Zarr: a shard with more than 2^22 chunks is rejected") {
    const Scratch scratch;
    const std::string store = zarr_stores::write_3(scratch.path("v3"));
    const std::string whole = bytes_of(store + "/zarr.json");
    const auto message = [&](int side) {
        nlohmann::json meta = nlohmann::json::parse(whole);
        meta["shape"] = {side, 128, 128};
        meta["chunk_grid"]["configuration"]["chunk_shape"] = meta["shape"];
        meta["codecs"][0]["configuration"]["chunk_shape"] = {1, 1, 1};
        zarr_stores::write(store + "/zarr.json", meta.dump());
        return message_of([&] { static_cast<void>(read_image_info(store)); });
    };
    CHECK(message(256).empty());
    CHECK(message(257).find("expected at most 4194304 chunks in a shard") != std::string::npos);
}

TEST_CASE("Zarr: a store that is removed while it is read is an error, not an image of fill values") {
    const Scratch scratch;
    const std::string store = scratch.path("large");
    std::string meta = zarr_stores::metadata_2(1024, 64, "|u1", "");
    zarr_stores::write(store + "/.zarray", meta);
    const Image image = read_image(store);
    CHECK(image.at(0, 0, 0) == 0);
    fs::rename(store, scratch.path("moved"));
    CHECK(image.at(1, 1, 1) == 0);
    CHECK(code_of([&] { static_cast<void>(image.at(500, 0, 0)); }, store + "/0.0.7: ") == Errc::Io);
}
