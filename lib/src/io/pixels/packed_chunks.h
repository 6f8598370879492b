#pragma once
#include <memory>
#include <string>

#include "io/pixels/chunks.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// One channel and frame of a compressed stream.
struct PackedFrame {
    PixelType type = PixelType::UInt8;  ///< type of the image; PixelPlace::type is the type of the stored values
    Index3 size{0, 0, 0};
    std::uint64_t components = 1;  ///< number of values per pixel in the file, of which `channel` is read
    std::uint64_t channel = 0;
    std::uint64_t begin = 0;  ///< number of unpacked bytes before the frame
    bool is_last = true;      ///< the frame is the last one, so only the checksum follows it
};

/// The size in voxels of the chunks into which an image of this size is divided.
Index3 packed_chunk_size(const Index3& size);

/// The chunks of a compressed frame. They are decoded in layers of a few slices, each from the last position before it
/// at which decompression can begin. This function decompresses the stream once up to the end of the frame, to collect
/// these positions and to detect damage. The positions need at most 32 KiB of memory for every 8 MiB of unpacked bytes.
/// @throws Error InvalidInput (damaged, truncated), Io, Cancelled.
std::shared_ptr<const ChunkSource> packed_chunks(const std::string& path, const PixelPlace& place,
                                                 const PackedFrame& frame, const RunContext& run);

}  // namespace covol::detail
