#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/chunked/zarr_store.h"

namespace covol::detail {

/// What packs the bytes of a chunk.
enum class ZarrCodec {
    Blosc,
    Zstd,
    Deflate,  ///< zlib or gzip: the stream's header says which
    Lz4,      ///< numcodecs': a block behind its size
    Crc32c    ///< a checksum behind the bytes
};

/// By the name in an array's metadata, of Zarr 2 or 3. @throws Error Unsupported, with `path`, the metadata's.
ZarrCodec zarr_codec(const std::string& path, const std::string& name);

/// More than this no codec makes of so many bytes.
std::uint64_t max_packed_bytes(std::uint64_t unpacked);

/// Undoes the codecs, the last first. Sizes are compared before memory is taken.
/// @param path  of the file that `packed` stands in
/// @throws Error InvalidInput unless all of it is sound and gives `expected` bytes.
Bytes unpack(const std::string& path, const std::vector<ZarrCodec>& codecs, Bytes packed, std::uint64_t expected);

/// The checksum of RFC 3720, appendix B.4 (Castagnoli's polynomial).
std::uint32_t crc32c(const void* bytes, std::uint64_t count);

/// A little-endian number at `bytes`.
std::uint32_t little_endian_32(const char* bytes);
/// Takes a crc32c off the end. @throws Error InvalidInput when it is wrong.
void take_crc32c(const std::string& path, const std::string& what, Bytes& bytes);

}  // namespace covol::detail
