#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/chunked/zarr_store.h"

namespace covol::detail {

/// A codec that packs the bytes of a chunk.
enum class ZarrCodec {
    Blosc,
    Zstd,
    Deflate,  ///< zlib or gzip, according to the stream's header
    Lz4,      ///< as in numcodecs: the unpacked size in 4 bytes, then one LZ4 block
    Crc32c    ///< does not pack, but appends a checksum
};

/// The codec that has this name in the metadata of a Zarr 2 or 3 array. @param path  of the metadata, for messages
/// @throws Error Unsupported.
ZarrCodec zarr_codec(const std::string& path, const std::string& name);

/// Upper bound for the packed size of `unpacked` bytes, for all codecs.
std::uint64_t max_packed_bytes(std::uint64_t unpacked);

/// Reverses the codecs, beginning with the last one. Sizes are checked before memory is allocated.
/// @param path  of the file that contains `packed`
/// @throws Error InvalidInput unless `packed` is valid and is unpacked to `expected` bytes.
Bytes unpack(const std::string& path, const std::vector<ZarrCodec>& codecs, Bytes packed, std::uint64_t expected);

/// The checksum of RFC 3720, appendix B.4 (Castagnoli's polynomial).
std::uint32_t crc32c(const void* bytes, std::uint64_t count);

/// A little-endian number at `bytes`.
std::uint32_t little_endian_32(const char* bytes);
/// Checks the crc32c at the end of the bytes and removes it. @throws Error InvalidInput if it is wrong.
void take_crc32c(const std::string& path, const std::string& what, Bytes& bytes);

}  // namespace covol::detail
