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

// Boxes of voxels, packed in parallel and written in their order.
namespace covol::detail {

/// How a block's bytes are packed.
enum class BlockPacking {
    None,
    Gzip,   ///< deflated up to a byte's border: blocks behind each other are one stream; with the CRC-32
    Adler,  ///< the same with the Adler-32
    Zlib    ///< each a whole stream of zlib's
};

struct PackedBlock {
    std::string bytes;
    std::uint32_t check = 0;     ///< of what is packed
    std::uint64_t unpacked = 0;  ///< bytes
    bool is_zero = false;        ///< all of it
};

/// A box of the image, and the lattice that its voxels are put into: where that is larger, the rest is 0.
struct BlockPlace {
    VoxelBox box;
    Index3 stored;  ///< voxels along i, j, k
};

/// Fills and packs boxes of a source. What is uniform is packed once.
class BlockPacker {
public:
    BlockPacker(const PixelSource& source, BlockPacking packing) : source_(source), packing_(packing) {}

    /// Hands the blocks 0 to count - 1 to `take`, in this order.
    void pack_all(std::uint64_t count, const std::function<BlockPlace(std::uint64_t)>& place,
                  const std::function<void(std::uint64_t, const PackedBlock&)>& take, const RunContext& run);

    /// Some bytes, packed as the voxels are.
    [[nodiscard]] PackedBlock packed(const std::string& bytes) const;

private:
    using Shared = std::shared_ptr<const PackedBlock>;
    [[nodiscard]] Shared pack(const BlockPlace& place);

    const PixelSource& source_;
    const BlockPacking packing_;
    std::mutex lock_;
    std::map<std::pair<double, std::uint64_t>, Shared> uniform_;  // by value and bytes
};

/// Puts voxels of a box that lie behind each other into a larger lattice; the rest becomes 0. Both i fastest.
/// @param values  as many bytes as the lattice has; the box's come first, the others are 0
/// @param width  bytes of a voxel
void spread(const Index3& size, const Index3& stored, std::uint64_t width, char* values);

/// Sets `count` values of a type to one value.
void fill_value(PixelType type, double value, std::uint64_t count, void* out);

}  // namespace covol::detail
