#include "io/chunked/array_chunks.h"

#include <openvdb/math/Half.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace covol::detail {
namespace {

/// Converts stored elements that are `step` elements apart to pixels.
template <typename Stored, typename Pixel, typename Convert>
void convert_row(const char* from, std::uint64_t step, std::uint64_t count, bool swap, char* to,
                 const Convert& convert) {
    for (std::uint64_t n = 0; n < count; ++n) {
        Stored stored;
        std::memcpy(&stored, from + n * step * sizeof(stored), sizeof(stored));
        if (swap) swap_bytes(&stored, 1, sizeof(stored));
        const Pixel pixel = convert(stored);
        std::memcpy(to + n * sizeof(pixel), &pixel, sizeof(pixel));
    }
}

float from_half(std::uint16_t bits) {
    openvdb::math::internal::half value;
    value.setBits(bits);
    return value;
}

void copy_row(const char* from, std::uint64_t step, std::uint64_t count, std::uint64_t width, char* to) {
    if (step == 1)
        std::memcpy(to, from, count * width);
    else
        for (std::uint64_t n = 0; n < count; ++n) std::memcpy(to + n * width, from + n * step * width, width);
}

void convert_row(const ChunkedArray& array, const char* from, std::uint64_t step, std::uint64_t count, char* to) {
    const auto as_double = [](auto value) { return double(value); };
    switch (array.stored_as) {
        case StoredAs::Half: return convert_row<std::uint16_t, float>(from, step, count, array.swap, to, from_half);
        case StoredAs::Int64: return convert_row<std::int64_t, double>(from, step, count, array.swap, to, as_double);
        case StoredAs::UInt64: return convert_row<std::uint64_t, double>(from, step, count, array.swap, to, as_double);
        case StoredAs::Pixels: break;
    }
    copy_row(from, step, count, array.stored_bytes(), to);
    if (array.swap) swap_bytes(to, count, array.stored_bytes());
}

/// The size of a chunk, limited to the size of the image. The limit is needed because the only chunk along an axis may
/// be longer than the image, in a damaged file by any amount.
Index3 chunk_size_of(const ChunkedArray& array, const ArrayAxes& axes, const Index3& size) {
    Index3 chunk;
    for (int a = 0; a < 3; ++a)
        chunk[a] = static_cast<std::int32_t>(std::min<std::uint64_t>(array.chunk[axes.space[a]], size[a]));
    return chunk;
}

}  // namespace

std::uint64_t ChunkedArray::stored_bytes() const { return stored_as == StoredAs::Half ? 2 : pixel_bytes(type); }

std::uint64_t ChunkedArray::chunk_bytes() const {
    std::uint64_t bytes = stored_bytes();
    for (const std::uint64_t n : chunk) bytes *= n;
    return bytes;
}

ArrayAxes describe_axes(const std::string& path, const std::string& letters, const ChunkedArray& array,
                        ImageInfo& info) {
    ArrayAxes axes;
    std::uint64_t size[3] = {};
    for (int a = 0; a < 3; ++a) {
        axes.space[a] = letters.find("xyz"[a]);
        size[a] = array.shape[axes.space[a]];
    }
    info.type = array.type;
    info.geometry.size = require_3d(path, size);
    for (std::size_t d = 0; d < letters.size(); ++d) {
        if (array.shape[d] == 0)
            throw read_error(Errc::InvalidInput, path,
                             "expected at least one element along each axis, got an axis of length 0");
        if (letters[d] == '?' && array.shape[d] != 1)
            throw read_error(Errc::Unsupported, path,
                             "expected only the axes t, c, z, y and x, got another axis of " +
                                 std::to_string(array.shape[d]) + " elements");
        if (letters[d] == 'c') axes.channel = d;
        if (letters[d] == 't') axes.frame = d;
        info.axis_order.insert(0, 1, letters[d] == '?' ? '?' : char(letters[d] - 'a' + 'A'));
    }
    if (axes.channel) info.channels = static_cast<int>(array.shape[*axes.channel]);
    if (axes.frame) info.frames = static_cast<int>(array.shape[*axes.frame]);
    for (int a = 0; a < 3; ++a) info.chunk_size[a] = static_cast<std::int32_t>(array.chunk[axes.space[a]]);
    return axes;
}

ArrayChunks::ArrayChunks(const std::string& path, const ChunkedArray& array, const ArrayAxes& axes, const Index3& size,
                         std::uint64_t channel, std::uint64_t frame)
    : ChunkSource(path, array.type, size, chunk_size_of(array, axes, size)),
      array_(array),
      axes_(axes),
      place_(array.shape.size(), 0) {
    const auto choose = [&](const std::optional<std::size_t>& d, std::uint64_t number) {
        if (!d) return;
        place_[*d] = number / array_.chunk[*d];
        first_ += number % array_.chunk[*d] * array_.strides[*d];
    };
    choose(axes.channel, channel);
    choose(axes.frame, frame);
}

bool ArrayChunks::read(const Index3& chunk, void* out) const {
    std::vector<std::uint64_t> place = place_;
    for (int a = 0; a < 3; ++a) place[axes_.space[a]] = std::uint64_t(chunk[a]);
    const std::optional<Bytes> stored = elements(place);
    if (stored) gather(stored->data(), static_cast<char*>(out));
    return stored.has_value();
}

/// Copies the voxels of this channel and frame from a stored chunk to `out`, i fastest.
void ArrayChunks::gather(const char* elements, char* out) const {
    const Index3& n = chunk_size();
    const std::uint64_t stored = array_.stored_bytes(), row = std::uint64_t(n[0]) * pixel_bytes(array_.type);
    std::array<std::uint64_t, 3> stride;
    for (int a = 0; a < 3; ++a) stride[a] = array_.strides[axes_.space[a]];
    for (std::int32_t k = 0; k < n[2]; ++k)
        for (std::int32_t j = 0; j < n[1]; ++j, out += row) {
            const std::uint64_t from = first_ + std::uint64_t(k) * stride[2] + std::uint64_t(j) * stride[1];
            convert_row(array_, elements + from * stored, stride[0], std::uint64_t(n[0]), out);
        }
}

}  // namespace covol::detail
