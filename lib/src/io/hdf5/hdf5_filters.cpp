#include "io/hdf5/hdf5_filters.h"

#include <hdf5.h>
#include <lz4.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "io/chunked/zarr_codecs.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

// IDs of filters: https://github.com/HDFGroup/hdf5_plugins/blob/master/docs/RegisteredFilterPlugins.md
constexpr unsigned kLzf = 32000, kBlosc = 32001, kLz4 = 32004, kZstd = 32015;

bool is_packer(unsigned id) {
    return id == H5Z_FILTER_DEFLATE || id == kLzf || id == kBlosc || id == kLz4 || id == kZstd;
}

Error damaged(const std::string& path, const char* codec) {
    return read_error(Errc::InvalidInput, path, std::string("a chunk is damaged: it is not valid ") + codec + " data");
}

/// Reverses the shuffle filter, which stores the first bytes of all elements, then their second bytes, and so on. If
/// the last element is incomplete, the filter leaves its bytes at the end.
Bytes unshuffle(const Bytes& bytes, std::uint64_t width) {
    if (width < 2) width = 1;
    Bytes out(bytes.size());
    const std::uint64_t count = bytes.size() / width;
    for (std::uint64_t b = 0; b < width; ++b) {
        const char* from = bytes.data() + b * count;
        for (std::uint64_t n = 0; n < count; ++n) out.data()[n * width + b] = from[n];
    }
    const std::uint64_t rest = bytes.size() - count * width;
    std::memcpy(out.data() + count * width, bytes.data() + count * width, rest);
    return out;
}

/// Unpacks the format of M. Lehmann's LibLZF: runs of literal bytes, and references to earlier output with 13-bit
/// distances.
Bytes unpack_lzf(const std::string& path, const Bytes& packed, std::uint64_t expected) {
    constexpr unsigned kLongestRun = 32, kLongLength = 7;
    Bytes out(expected);
    const auto* in = reinterpret_cast<const unsigned char*>(packed.data());
    const auto* const end = in + packed.size();
    std::uint64_t made = 0;
    while (in < end) {
        const unsigned control = *in++;
        if (control < kLongestRun) {
            const std::uint64_t length = control + 1;
            if (length > std::uint64_t(end - in) || length > expected - made) throw damaged(path, "LZF");
            std::memcpy(out.data() + made, in, length);
            in += length;
            made += length;
            continue;
        }
        std::uint64_t length = control >> 5U;
        if (length == kLongLength) {
            if (in == end) throw damaged(path, "LZF");
            length += *in++;
        }
        length += 2;
        if (in == end) throw damaged(path, "LZF");
        const std::uint64_t back = ((control & 0x1FU) << 8U) + *in++ + 1;
        if (back > made || length > expected - made) throw damaged(path, "LZF");
        // Bytes are copied one by one, because a reference may overlap the output that it produces.
        for (std::uint64_t n = 0; n < length; ++n, ++made) out.data()[made] = out.data()[made - back];
    }
    out.shrink(made);
    return out;
}

std::uint64_t big_endian(const char* bytes, int width) {
    std::uint64_t value = 0;
    for (int n = 0; n < width; ++n) value = value << 8U | static_cast<unsigned char>(bytes[n]);
    return value;
}

/// Unpacks the format of HDF5's LZ4 filter. All numbers are big-endian: the unpacked size (8 bytes) and the block size
/// (4 bytes), then for each block its packed size (4 bytes) and its data.
Bytes unpack_lz4(const std::string& path, const Bytes& packed, std::uint64_t expected) {
    constexpr std::uint64_t kHeader = 12, kMaxBlock = std::uint64_t(1) << 30;
    if (packed.size() < kHeader || big_endian(packed.data(), 8) != expected) throw damaged(path, "LZ4");
    const std::uint64_t block = big_endian(packed.data() + 8, 4);
    if (block == 0 || block > kMaxBlock) throw damaged(path, "LZ4");
    Bytes out(expected);
    std::uint64_t at = kHeader;
    for (std::uint64_t made = 0; made < expected;) {
        const std::uint64_t here = std::min(block, expected - made);
        if (packed.size() - at < 4) throw damaged(path, "LZ4");
        const std::uint64_t stored = big_endian(packed.data() + at, 4);
        at += 4;
        if (stored > packed.size() - at || stored > kMaxBlock) throw damaged(path, "LZ4");
        if (stored == here)
            std::memcpy(out.data() + made, packed.data() + at, here);
        else if (LZ4_decompress_safe(packed.data() + at, out.data() + made, int(stored), int(here)) != int(here))
            throw damaged(path, "LZ4");
        at += stored;
        made += here;
    }
    return out;
}

Bytes undo(const std::string& path, const Hdf5Filter& filter, Bytes bytes, std::uint64_t expected) {
    switch (filter.id) {
        case H5Z_FILTER_SHUFFLE: return unshuffle(bytes, filter.values.empty() ? 1 : filter.values.front());
        case H5Z_FILTER_DEFLATE: return unpack(path, {ZarrCodec::Deflate}, std::move(bytes), expected);
        case kBlosc: return unpack(path, {ZarrCodec::Blosc}, std::move(bytes), expected);
        case kZstd: return unpack(path, {ZarrCodec::Zstd}, std::move(bytes), expected);
        case kLz4: return unpack_lz4(path, bytes, expected);
        default: return unpack_lzf(path, bytes, expected);
    }
}

}  // namespace

bool can_undo(const std::vector<Hdf5Filter>& filters) {
    int packers = 0;
    for (const Hdf5Filter& filter : filters) {
        if (!is_packer(filter.id) && filter.id != H5Z_FILTER_SHUFFLE) return false;
        packers += is_packer(filter.id) ? 1 : 0;
    }
    return packers < 2;
}

Bytes undo_filters(const std::string& path, const std::vector<Hdf5Filter>& filters, unsigned passed_over, Bytes bytes,
                   std::uint64_t expected) {
    for (std::size_t n = filters.size(); n-- > 0;)
        if ((passed_over >> n & 1U) == 0) bytes = undo(path, filters[n], std::move(bytes), expected);
    if (bytes.size() != expected)
        throw read_error(Errc::InvalidInput, path,
                         "expected a chunk of " + std::to_string(expected) + " bytes, got " +
                             std::to_string(bytes.size()) + "; it is damaged");
    return bytes;
}

}  // namespace covol::detail
