#include "covol/page_data.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "covol/error.h"
#include "report/encoding.h"
#include "report/mesh_codec.h"

namespace covol {
namespace {

constexpr double kMostCode = 65535;
constexpr int kFast = 1;  // zlib's level: a person waits for it

template <typename T>
void append(std::vector<std::uint8_t>& bytes, T value) {
    static_assert(sizeof(T) == 4);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, 4);
    for (int n = 0; n < 4; ++n) bytes.push_back(std::uint8_t(bits >> (8 * n)));
}

}  // namespace

PageSlice make_page_slice(const Image& image, int axis, int at, int step, const std::array<double, 2>& range,
                          const RunContext& run) {
    if (axis < 0 || axis > 2) throw Error(Errc::InvalidOptions, "slice: expected an axis 0, 1 or 2");
    const VoxelBox& held = image.held();
    const std::size_t along = std::size_t(axis), right = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
    if (at < held.min[along] || at > held.max[along] || step < 1 || step > (1 << 20))
        throw Error(Errc::InvalidOptions, "slice: it lies outside of the image");
    VoxelBox slice = held;
    slice.min[along] = slice.max[along] = at;
    if (image.chunks()) image.load(slice, run);
    const int across = slice.size()[right], rows = slice.size()[down];
    PageSlice coded{(across + step - 1) / step, (rows + step - 1) / step, {}};
    std::vector<std::uint8_t> bytes(2 * std::size_t(coded.width) * std::size_t(coded.height));
    const double scale = range[1] > range[0] ? kMostCode / (range[1] - range[0]) : 0;
    tbb::parallel_for(0, coded.height, [&](int y) {
        VoxelBox box = slice;
        box.min[down] = slice.min[down] + y * step;
        box.max[down] = std::min(box.min[down] + step - 1, slice.max[down]);
        const int lines = box.max[down] - box.min[down] + 1;
        std::vector<float> values(std::size_t(across) * std::size_t(lines));
        image.copy(box, values.data());
        std::uint8_t* out = bytes.data() + 2 * std::size_t(y) * std::size_t(coded.width);
        for (int x = 0; x < coded.width; ++x) {
            const int first = x * step, last = std::min(first + step, across);
            double sum = 0;
            for (int line = 0; line < lines; ++line)
                for (int n = first; n < last; ++n)
                    sum += double(values[std::size_t(line) * std::size_t(across) + std::size_t(n)]);
            const double mean = sum / (double(last - first) * lines);
            const auto code = std::uint16_t(std::lround(std::clamp((mean - range[0]) * scale, 0.0, kMostCode)));
            *out++ = std::uint8_t(code & 255U);
            *out++ = std::uint8_t(code >> 8U);
        }
    });
    coded.bytes = detail::deflated(bytes, kFast);
    return coded;
}

std::string make_page_mesh(const TriangleMesh& mesh) {
    const detail::CodedMesh coded = detail::encode(mesh);
    std::vector<std::uint8_t> bytes;
    bytes.reserve(48 + coded.positions.size() + coded.corners.size());
    append(bytes, coded.vertex_count);
    append(bytes, coded.triangle_count);
    for (const float x : coded.min) append(bytes, x);
    for (const float x : coded.max) append(bytes, x);
    append(bytes, std::uint32_t(coded.positions.size()));
    append(bytes, std::uint32_t(coded.corners.size()));
    bytes.insert(bytes.end(), coded.positions.begin(), coded.positions.end());
    bytes.insert(bytes.end(), coded.corners.begin(), coded.corners.end());
    return detail::deflated(bytes, kFast);
}

}  // namespace covol
