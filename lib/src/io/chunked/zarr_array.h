#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/chunked/array_chunks.h"
#include "io/chunked/zarr_codecs.h"

namespace covol::detail {

/// How the chunks of a Zarr 3 array are grouped into shards: files that hold several chunks and an index of their
/// positions. https://zarr-specs.readthedocs.io/en/latest/v3/codecs/sharding-indexed/
struct ZarrShards {
    std::vector<std::uint64_t> counts;  ///< chunks of a shard along each dimension; empty if each chunk is a file
    bool index_at_end = true;
    bool index_has_checksum = false;
    bool index_is_big_endian = false;
};

/// The metadata of an array.
/// https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html, https://zarr-specs.readthedocs.io/en/latest/v3/core/
struct ZarrArray : ChunkedArray {
    std::string folder;
    std::string metadata;  ///< path of the file with the metadata of the array
    int version = 2;
    std::vector<ZarrCodec> codecs;
    ZarrShards shards;
    std::string key_begin;  ///< beginning of the name of each chunk's file, such as "c/"
    char separator = '.';
    std::vector<std::string> dimension_names;  ///< empty, or one for each dimension

    /// The path of the file with the chunk or shard at this position in the grid of chunks or shards.
    [[nodiscard]] std::string file_of(const std::vector<std::uint64_t>& place) const;
};

/// Whether a folder is an array of a Zarr store; false for groups and other folders.
bool is_zarr_array(const std::string& folder);

/// @throws Error InvalidInput, Io, Unsupported.
ZarrArray read_zarr_array(const std::string& folder);

}  // namespace covol::detail
