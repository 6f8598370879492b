#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/image.h"
#include "io/chunked/zarr_store.h"
#include "io/pixels/chunks.h"

namespace covol::detail {

/// How the elements are stored: with a pixel type, or with another type that is converted when it is read.
enum class StoredAs { Pixels, Half, Int64, UInt64 };  ///< Half is converted to Float, 64-bit integers to Double

/// An array with any number of dimensions that is stored in chunks of equal size.
struct ChunkedArray {
    PixelType type = PixelType::UInt8;
    StoredAs stored_as = StoredAs::Pixels;
    bool swap = false;  ///< the byte order is not that of this machine
    std::vector<std::uint64_t> shape;
    std::vector<std::uint64_t> chunk;  ///< size of a chunk in elements, along each dimension
    std::vector<std::uint64_t>
        strides;      ///< distance in elements between neighbours within a chunk, along each dimension
    double fill = 0;  ///< value of the elements in chunks that the file does not have

    [[nodiscard]] std::uint64_t stored_bytes() const;  ///< bytes of an element
    [[nodiscard]] std::uint64_t chunk_bytes() const;   ///< bytes of an unpacked chunk
};

/// The indices of the dimensions that are the axes x, y, z, and of the dimensions for channels and frames if the array
/// has them.
struct ArrayAxes {
    std::array<std::size_t, 3> space{};
    std::optional<std::size_t> channel, frame;
};

/// Sets size, channels, frames, order and chunk size in `info`. `letters` has one letter for each dimension: x, y, z,
/// c, t, or ? for a dimension with a single element. @throws Error InvalidInput, Unsupported, with `path`.
ArrayAxes describe_axes(const std::string& path, const std::string& letters, const ChunkedArray& array,
                        ImageInfo& info);

/// The chunks of one channel and frame of an array. Dimensions that are not in ArrayAxes must have a single element.
class ArrayChunks : public ChunkSource {
public:
    [[nodiscard]] bool read(const Index3& chunk, void* out) const final;
    [[nodiscard]] double fill_value() const noexcept final { return array_.fill; }

protected:
    ArrayChunks(const std::string& path, const ChunkedArray& array, const ArrayAxes& axes, const Index3& size,
                std::uint64_t channel, std::uint64_t frame);

    /// The stored bytes, chunk_bytes() of them, of the chunk at the position `place` in the grid of chunks; empty if
    /// the file has no such chunk.
    /// @throws Error as read().
    [[nodiscard]] virtual std::optional<Bytes> elements(const std::vector<std::uint64_t>& place) const = 0;

private:
    void gather(const char* elements, char* out) const;

    const ChunkedArray array_;
    const ArrayAxes axes_;
    /// Position in the grid of chunks of the chunks with this channel and frame; read() sets the spatial dimensions.
    std::vector<std::uint64_t> place_;
    std::uint64_t first_ = 0;  ///< index within a chunk of the first element of this channel and frame
};

}  // namespace covol::detail
