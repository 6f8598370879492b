#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/geometry.h"
#include "covol/error.h"
#include "covol/page_data.h"
#include "report/encoding.h"

namespace covol {
namespace {

constexpr double kMaxOfCode = 65535;
constexpr int kFastest = 1;  // zlib's level of compression: a user waits for the slice
constexpr int kMaxPixels = 1024;
// [pixels] Side of the square tiles in which the slice is computed: the box of voxels around a tile is small, whatever
// the slice's direction.
constexpr int kTile = 32;
constexpr double kMaxOfTile = 1e7;  // maximum number of voxels in a tile's box for the box to be read as a whole

Vec3 place_of(const ObliqueRequest& wanted, double x, double y) {
    Vec3 place{};
    for (std::size_t a = 0; a < 3; ++a) place[a] = wanted.first[a] + x * wanted.right[a] + y * wanted.down[a];
    return place;
}

/// The voxels of a level between two positions, given as the level's indices, and around them; limited to the level.
VoxelBox box_around(const Vec3& low, const Vec3& high, const Index3& size) {
    VoxelBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        const double last = size[a] - 1;
        box.min[a] = int(std::clamp(std::floor(low[a]), 0.0, last));
        box.max[a] = int(std::clamp(std::floor(high[a]) + 1, 0.0, last));
    }
    return box;
}

/// Interpolates between the voxels of a box; beyond the box, the nearest value in it is used.
double sample(const std::vector<float>& values, const VoxelBox& box, const Vec3& place) {
    const Index3 size = box.size();
    std::array<std::size_t, 3> at{}, next{};
    Vec3 part{};
    for (std::size_t a = 0; a < 3; ++a) {
        const double x = std::clamp(place[a] - box.min[a], 0.0, double(size[a] - 1));
        at[a] = std::size_t(std::min(std::floor(x), double(std::max(0, size[a] - 2))));
        next[a] = std::min(at[a] + 1, std::size_t(size[a] - 1));
        part[a] = x - double(at[a]);
    }
    const auto value = [&](std::size_t i, std::size_t j, std::size_t k) {
        return double(values[(k * std::size_t(size[1]) + j) * std::size_t(size[0]) + i]);
    };
    const auto row = [&](std::size_t j, std::size_t k) {
        return value(at[0], j, k) * (1 - part[0]) + value(next[0], j, k) * part[0];
    };
    const auto layer = [&](std::size_t k) { return row(at[1], k) * (1 - part[1]) + row(next[1], k) * part[1]; };
    return layer(at[2]) * (1 - part[2]) + layer(next[2]) * part[2];
}

}  // namespace

PageSlice make_oblique_slice(const ImageLevels& image, const ObliqueRequest& wanted, const std::array<double, 2>& range,
                             const RunContext& run) {
    for (const Vec3* const v : {&wanted.first, &wanted.right, &wanted.down})
        if (!(length(*v) < 1e9)) throw Error(Errc::InvalidOptions, "oblique slice: expected finite numbers");
    if (wanted.count < 1 || wanted.count > kMaxPixels)
        throw Error(Errc::InvalidOptions, "oblique slice: expected 1 to " + std::to_string(kMaxPixels) +
                                              " pixels along each side, got " + std::to_string(wanted.count));
    const double pixel = std::clamp(std::min(length(wanted.right), length(wanted.down)), 1.0, double(1 << 20));
    // The size of a pixel, in voxels, is rounded down to a power of two, because the factors of levels usually are
    // powers of two.
    const std::size_t at = image.level_for(1 << int(std::floor(std::log2(pixel))));
    const ImageLevels::Level& level = image.levels()[at];
    const Index3& whole = image.levels().front().size;
    const auto in_level = [&](Vec3 place) {
        for (std::size_t a = 0; a < 3; ++a) place[a] = (place[a] + 0.5) / level.factor[a] - 0.5;
        return place;
    };
    const auto is_inside = [&](const Vec3& place) {
        for (std::size_t a = 0; a < 3; ++a)
            if (!(place[a] >= -0.5 && place[a] <= whole[a] - 0.5)) return false;
        return true;
    };
    const auto count = std::size_t(wanted.count);
    std::vector<std::uint8_t> bytes(2 * count * count);
    const double scale = range[1] > range[0] ? kMaxOfCode / (range[1] - range[0]) : 0;
    const int tiles = (wanted.count + kTile - 1) / kTile;
    tbb::parallel_for(0, tiles * tiles, [&](int tile) {
        if (run.cancelled()) return;
        const int x0 = tile % tiles * kTile, y0 = tile / tiles * kTile;
        const int x1 = std::min(wanted.count, x0 + kTile) - 1, y1 = std::min(wanted.count, y0 + kTile) - 1;
        Vec3 low{}, high{};
        for (const int corner : {0, 1, 2, 3}) {
            const Vec3 place = in_level(place_of(wanted, corner % 2 == 0 ? x0 : x1, corner < 2 ? y0 : y1));
            for (std::size_t a = 0; a < 3; ++a) {
                low[a] = corner == 0 ? place[a] : std::min(low[a], place[a]);
                high[a] = corner == 0 ? place[a] : std::max(high[a], place[a]);
            }
        }
        for (std::size_t a = 0; a < 3; ++a)
            if (high[a] < -0.5 || low[a] > level.size[a] - 0.5) return;
        const VoxelBox box = box_around(low, high, level.size);
        const Index3 size = box.size();
        // If pixels are so far apart that the box is too large, the voxels of each pixel are read separately.
        const bool is_whole = double(size[0]) * size[1] * size[2] <= kMaxOfTile;
        std::vector<float> values;
        const auto load = [&](const VoxelBox& part) {
            const Index3 of = part.size();
            values.resize(std::size_t(of[0]) * std::size_t(of[1]) * std::size_t(of[2]));
            image.copy(at, part, values.data(), run);
        };
        if (is_whole) load(box);
        for (int y = y0; y <= y1; ++y)
            for (int x = x0; x <= x1; ++x) {
                const Vec3 fine = place_of(wanted, x, y);
                if (!is_inside(fine)) continue;
                const Vec3 place = in_level(fine);
                const VoxelBox own = is_whole ? box : box_around(place, place, level.size);
                if (!is_whole) load(own);
                const double value = sample(values, own, place);
                const auto code = std::uint16_t(std::lround(std::clamp((value - range[0]) * scale, 0.0, kMaxOfCode)));
                const std::size_t n = 2 * (std::size_t(y) * count + std::size_t(x));
                bytes[n] = std::uint8_t(code & 255U);
                bytes[n + 1] = std::uint8_t(code >> 8U);
            }
    });
    run.check();
    PageSlice coded{wanted.count, wanted.count, *std::max_element(level.factor.begin(), level.factor.end()), {}};
    coded.bytes = detail::deflated(bytes, kFastest);
    return coded;
}

}  // namespace covol
