#include "io/chunked/zarr_codecs.h"

#include <blosc.h>
#include <lz4.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <limits>

#include "base/text.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

/// Packed bytes, the file that they come from, and the maximum size after unpacking.
struct Packed {
    const std::string& path;
    const Bytes& bytes;
    std::uint64_t maximum;  ///< maximum number of unpacked bytes

    [[nodiscard]] Error damaged(const char* codec, const std::string& what) const {
        return read_error(Errc::InvalidInput, path, std::string("damaged ") + codec + " data: " + what);
    }
    /// @throws Error InvalidInput if a header claims more bytes than the maximum.
    void check_claim(const char* codec, std::uint64_t claimed) const {
        if (claimed > maximum)
            throw damaged(codec, "expected at most " + std::to_string(maximum) +
                                     " bytes when unpacked, but its header claims " + std::to_string(claimed));
    }
};

/// Maximum number of unpacked bytes for one packed byte. Deflate encodes at most 258 bytes in two bits, LZ4 adds at
/// most 255 to a length with each byte, zstd encodes a block of 128 KiB in at least 4 bytes. Blosc has the ratio of
/// zstd, because it may use zstd.
std::uint64_t max_unpacked_of_byte(ZarrCodec codec) {
    switch (codec) {
        case ZarrCodec::Deflate: return 1032;
        case ZarrCodec::Lz4: return 255;
        case ZarrCodec::Blosc:
        case ZarrCodec::Zstd: return 32768;
        case ZarrCodec::Crc32c: break;
    }
    return 1;
}

/// Rejects a chunk whose packed bytes are too few for `packed.maximum` unpacked bytes, before memory is allocated.
/// @throws Error InvalidInput.
void check_ratio(const Packed& packed, ZarrCodec codec) {
    if (packed.maximum / max_unpacked_of_byte(codec) > packed.bytes.size())
        throw packed.damaged("packed", std::to_string(packed.bytes.size()) + " bytes cannot hold a chunk of " +
                                           std::to_string(packed.maximum));
}

Bytes unpack_blosc(const Packed& packed) {
    std::size_t claimed = 0;
    const Bytes& in = packed.bytes;
    // Blosc's functions do not check that the header is complete before they read it.
    if (in.size() < BLOSC_MIN_HEADER_LENGTH) throw packed.damaged("blosc", "its header is truncated");
    if (blosc_cbuffer_validate(in.data(), in.size(), &claimed) != 0)
        throw packed.damaged("blosc", "its header does not match its size of " + std::to_string(in.size()) + " bytes");
    packed.check_claim("blosc", claimed);
    Bytes out(claimed);
    const int got = blosc_decompress_ctx(in.data(), out.data(), out.size(), 1);
    if (got < 0 || std::uint64_t(got) != claimed) {
        const char* library = blosc_cbuffer_complib(in.data());
        throw packed.damaged("blosc", "it cannot be unpacked; its codec is " +
                                          std::string(library == nullptr ? "unknown to this libblosc" : library));
    }
    return out;
}

Bytes unpack_zstd(const Packed& packed) {
    const Bytes& in = packed.bytes;
    const unsigned long long claimed = ZSTD_getFrameContentSize(in.data(), in.size());
    if (claimed == ZSTD_CONTENTSIZE_ERROR) throw packed.damaged("zstd", "it has no header");
    // `claimed` is only a check: the data may consist of several frames, and a frame that was written as a stream does
    // not state its size. The output is therefore allocated with the maximum size.
    if (claimed != ZSTD_CONTENTSIZE_UNKNOWN) packed.check_claim("zstd", claimed);
    Bytes out(packed.maximum);
    const std::size_t got = ZSTD_decompress(out.data(), out.size(), in.data(), in.size());
    if (ZSTD_isError(got) != 0) throw packed.damaged("zstd", ZSTD_getErrorName(got));
    out.shrink(got);
    return out;
}

Bytes unpack_deflate(const Packed& packed) {
    const Bytes& in = packed.bytes;
    constexpr int kAnyHeader = 15 + 32;
    constexpr std::uint64_t kPiece = 1U << 30;
    z_stream stream{};
    if (inflateInit2(&stream, kAnyHeader) != Z_OK)
        throw read_error(Errc::InvalidInput, packed.path, "zlib could not be initialised");
    const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
    Bytes out(packed.maximum);
    char more = 0;  // receives one byte when `out` is full, so that excess output is detected
    std::uint64_t read = 0, written = 0;
    for (bool ended = false; !ended;) {
        const std::uint64_t room = out.size() - written, left = in.size() - read;
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in.data() + read));
        stream.avail_in = static_cast<uInt>(std::min(left, kPiece));
        stream.next_out = reinterpret_cast<Bytef*>(room > 0 ? out.data() + written : &more);
        stream.avail_out = static_cast<uInt>(room > 0 ? std::min(room, kPiece) : 1);
        const uInt in_before = stream.avail_in, out_before = stream.avail_out;
        const int status = inflate(&stream, Z_NO_FLUSH);
        const std::uint64_t taken = in_before - stream.avail_in, made = out_before - stream.avail_out;
        read += taken;
        if (room == 0 && made > 0)
            throw packed.damaged(
                "zlib", "expected at most " + std::to_string(packed.maximum) + " bytes when unpacked, got more");
        written += made;
        if (status == Z_STREAM_END) {
            // The data may consist of several gzip streams, one after another.
            ended = read == in.size();
            if (!ended && inflateReset(&stream) != Z_OK) throw packed.damaged("zlib", "zlib could not continue");
        } else if (status != Z_OK || (taken == 0 && made == 0)) {
            throw packed.damaged("zlib", stream.msg != nullptr ? stream.msg : "the stream is truncated");
        }
    }
    out.shrink(written);
    return out;
}

Bytes unpack_lz4(const Packed& packed) {
    const Bytes& in = packed.bytes;
    constexpr std::uint64_t kHeader = 4;
    if (in.size() < kHeader || in.size() > std::uint64_t(std::numeric_limits<int>::max()))
        throw packed.damaged(
            "lz4", "expected a header of 4 bytes and at most 2 GiB, got " + std::to_string(in.size()) + " bytes");
    const std::uint64_t claimed = little_endian_32(in.data());
    packed.check_claim("lz4", claimed);
    Bytes out(claimed);
    const int got = LZ4_decompress_safe(in.data() + kHeader, out.data(), int(in.size() - kHeader), int(claimed));
    if (got < 0 || std::uint64_t(got) != claimed)
        throw packed.damaged(
            "lz4", "it cannot be unpacked to the " + std::to_string(claimed) + " bytes that its header claims");
    return out;
}

constexpr std::array<std::uint32_t, 256> crc32c_table() {
    constexpr std::uint32_t kReversed = 0x82F63B78;
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t n = 0; n < 256; ++n) {
        std::uint32_t value = n;
        for (int bit = 0; bit < 8; ++bit) value = (value >> 1U) ^ ((value & 1U) != 0 ? kReversed : 0U);
        table[n] = value;
    }
    return table;
}

}  // namespace

ZarrCodec zarr_codec(const std::string& path, const std::string& name) {
    // In Zarr 3, the names of Zarr 2's codecs have this prefix, unless Zarr 3 specifies the codec itself.
    constexpr const char* kPrefix = "numcodecs.";
    const std::string own = name.starts_with(kPrefix) ? name.substr(std::string_view(kPrefix).size()) : name;
    if (own == "blosc") return ZarrCodec::Blosc;
    if (own == "zstd") return ZarrCodec::Zstd;
    if (own == "zlib" || own == "gzip") return ZarrCodec::Deflate;
    if (own == "lz4") return ZarrCodec::Lz4;
    if (own == "crc32c") return ZarrCodec::Crc32c;
    throw read_error(Errc::Unsupported, path,
                     "expected uncompressed chunks, or chunks compressed with blosc, zstd, zlib, gzip or lz4, got " +
                         quote(name) + "; write it with one of these");
}

std::uint64_t max_packed_bytes(std::uint64_t unpacked) {
    // Codecs enlarge incompressible data by headers and by a few per cent, far less than the factor of two that is
    // allowed here.
    constexpr std::uint64_t kHeaders = 1U << 16;
    return 2 * unpacked + kHeaders;
}

std::uint32_t crc32c(const void* bytes, std::uint64_t count) {
    static constexpr std::array<std::uint32_t, 256> kTable = crc32c_table();
    const auto* next = static_cast<const unsigned char*>(bytes);
    std::uint32_t value = 0xFFFFFFFF;
    for (std::uint64_t n = 0; n < count; ++n) value = kTable[(value ^ next[n]) & 0xFFU] ^ (value >> 8U);
    return ~value;
}

std::uint32_t little_endian_32(const char* bytes) {
    std::uint32_t value = 0;
    for (int n = 3; n >= 0; --n) value = value << 8U | static_cast<unsigned char>(bytes[n]);
    return value;
}

void take_crc32c(const std::string& path, const std::string& what, Bytes& bytes) {
    constexpr std::uint64_t kWidth = 4;
    if (bytes.size() < kWidth) throw read_error(Errc::InvalidInput, path, what + " is too short for its crc32c");
    bytes.shrink(bytes.size() - kWidth);
    if (crc32c(bytes.data(), bytes.size()) != little_endian_32(bytes.data() + bytes.size()))
        throw read_error(Errc::InvalidInput, path, what + " is damaged: its crc32c does not match");
}

Bytes unpack(const std::string& path, const std::vector<ZarrCodec>& codecs, Bytes packed, std::uint64_t expected) {
    for (std::size_t n = codecs.size(); n-- > 0;) {
        const Packed piece{path, packed, n == 0 ? expected : max_packed_bytes(expected)};
        if (n == 0) check_ratio(piece, codecs[n]);
        switch (codecs[n]) {
            case ZarrCodec::Blosc: packed = unpack_blosc(piece); break;
            case ZarrCodec::Zstd: packed = unpack_zstd(piece); break;
            case ZarrCodec::Deflate: packed = unpack_deflate(piece); break;
            case ZarrCodec::Lz4: packed = unpack_lz4(piece); break;
            case ZarrCodec::Crc32c: take_crc32c(path, "the chunk", packed); break;
        }
    }
    if (packed.size() != expected)
        throw read_error(Errc::InvalidInput, path,
                         "expected a chunk of " + std::to_string(expected) + " bytes, got " +
                             std::to_string(packed.size()) +
                             "; it is damaged, or its metadata belongs to another array");
    return packed;
}

}  // namespace covol::detail
