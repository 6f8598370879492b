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

// Blocks (boxes of voxels), which are packed in parallel and written in order.
namespace covol::detail {

/// How a block's bytes are packed.
enum class BlockPacking {
    None,
    Gzip,   ///< deflated, ends at a byte, so that consecutive blocks form one stream; `check` is the CRC-32
    Adler,  ///< as Gzip, but `check` is the Adler-32
    Zlib    ///< each block is a complete zlib stream
};

struct PackedBlock {
    std::string bytes;
    std::uint32_t check = 0;     ///< checksum of the unpacked bytes
    std::uint64_t unpacked = 0;  ///< unpacked size in bytes
    bool is_zero = false;        ///< whether all bytes are 0
};

/// A box of the image, and the size of the lattice in which its voxels are stored; the remaining voxels of that lattice
/// are 0.
struct BlockPlace {
    VoxelBox box;
    Index3 stored;  ///< voxels along i, j, k
};

/// Fills and packs boxes of a source. Uniform boxes of the same value and size are packed once.
class BlockPacker {
public:
    BlockPacker(const PixelSource& source, BlockPacking packing) : source_(source), packing_(packing) {}

    /// Packs the blocks 0 to count - 1, and passes them to `take` in this order.
    void pack_all(std::uint64_t count, const std::function<BlockPlace(std::uint64_t)>& place,
                  const std::function<void(std::uint64_t, const PackedBlock&)>& take, const RunContext& run);

    /// Packs bytes that are not voxels in the same way.
    [[nodiscard]] PackedBlock packed(const std::string& bytes) const;

private:
    using Shared = std::shared_ptr<const PackedBlock>;
    [[nodiscard]] Shared pack(const BlockPlace& place);

    const PixelSource& source_;
    const BlockPacking packing_;
    std::mutex lock_;
    std::map<std::pair<double, std::uint64_t>, Shared> uniform_;  // packed uniform blocks by value and size in bytes
};

/// Moves the contiguous voxels of a box to their places in a larger lattice; the other voxels become 0. In both, i is
/// fastest.
/// @param values  as many bytes as the lattice has; initially the box's voxels, followed by zeros
/// @param width  bytes of a voxel
void pad_rows(const Index3& size, const Index3& stored, std::uint64_t width, char* values);

/// Sets `count` values of this type to `value`.
void fill_value(PixelType type, double value, std::uint64_t count, void* out);

}  // namespace covol::detail
