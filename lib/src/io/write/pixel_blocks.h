#pragma once
#include <zlib.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "covol/image_stream.h"

// Writes images as blocks (boxes of voxels), which are packed in parallel and written in order.
namespace covol::detail {

/// How a block's bytes are packed.
enum class BlockPacking {
    None,
    /// Each block is a part of a Deflate stream and ends at the end of a byte, so that consecutive blocks form one
    /// stream; `check` is the CRC-32.
    Gzip,
    Adler,  ///< as Gzip, but `check` is the Adler-32
    Zlib    ///< each block is a complete zlib stream
};

struct PackedBlock {
    std::string bytes;
    std::uint32_t check = 0;     ///< checksum of the unpacked bytes
    std::uint64_t unpacked = 0;  ///< unpacked size in bytes
    bool is_zero = false;        ///< whether all bytes are 0
};

/// A box of the image, and the size of the block in which its voxels are stored. The block may be larger than the box,
/// as tiles and chunks at the end of an image are; its other voxels are then 0.
struct BlockPlace {
    VoxelBox box;
    Index3 stored;  ///< size of the block in voxels along i, j, k
};

/// Fills and packs boxes of a source. Boxes in which all voxels have the same value are packed once for each value and
/// size.
class BlockPacker {
public:
    BlockPacker(const PixelSource& source, BlockPacking packing) : source_(source), packing_(packing) {}

    /// Packs the blocks 0 to count - 1, and passes them to `take` in this order.
    void pack_all(std::uint64_t count, const std::function<BlockPlace(std::uint64_t)>& place,
                  const std::function<void(std::uint64_t, const PackedBlock&)>& take, const RunContext& run);

    /// Packs bytes that are not voxels, such as a header, in the same way.
    [[nodiscard]] PackedBlock packed(const std::string& bytes) const;

private:
    using Shared = std::shared_ptr<const PackedBlock>;
    [[nodiscard]] Shared pack(const BlockPlace& place);

    const PixelSource& source_;
    const BlockPacking packing_;
    std::mutex lock_;
    std::map<std::pair<double, std::uint64_t>, Shared> uniform_;  // packed uniform blocks by value and size in bytes
};

/// Moves the contiguous voxels of a box of `size` voxels to their positions in a larger lattice of `stored` voxels,
/// whose other voxels become 0. In both, i is the fastest axis.
/// @param values  as many bytes as the lattice has; initially the box's voxels, followed by zeros
/// @param width  bytes of a voxel
void pad_rows(const Index3& size, const Index3& stored, std::uint64_t width, char* values);

/// Sets `count` values of this type to `value`.
void fill_value(PixelType type, double value, std::uint64_t count, void* out);

}  // namespace covol::detail
