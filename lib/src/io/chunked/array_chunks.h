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

/// An array with any number of dimensions, in chunks of one size.
struct ChunkedArray {
    PixelType type = PixelType::UInt8;
    StoredAs stored_as = StoredAs::Pixels;
    bool swap = false;  ///< the byte order is not that of this machine
    std::vector<std::uint64_t> shape;
    std::vector<std::uint64_t> chunk;  ///< elements along each dimension
    std::vector<std::uint64_t>
        strides;      ///< distance in elements between neighbours within a chunk, along each dimension
    double fill = 0;  ///< value of missing chunks

    [[nodiscard]] std::uint64_t stored_bytes() const;  ///< bytes of an element
    [[nodiscard]] std::uint64_t chunk_bytes() const;   ///< bytes of an unpacked chunk
};

/// The indices of the dimensions that are the axes x, y, z, and of those for channels and frames if there are any.
struct ArrayAxes {
    std::array<std::size_t, 3> space{};
    std::optional<std::size_t> channel, frame;
};

/// Sets size, channels, frames, order and chunk size of an image. `letters` has one letter for each dimension: x, y, z,
/// c, t, or ? for a dimension with a single element. @throws Error InvalidInput, Unsupported, with `path`.
ArrayAxes describe_axes(const std::string& path, const std::string& letters, const ChunkedArray& array,
                        ImageInfo& info);

/// The chunks of one channel and frame of an array. Dimensions that are not named in ArrayAxes have one element.
class ArrayChunks : public ChunkSource {
public:
    [[nodiscard]] bool read(const Index3& chunk, void* out) const final;
    [[nodiscard]] double fill_value() const noexcept final { return array_.fill; }

protected:
    ArrayChunks(const std::string& path, const ChunkedArray& array, const ArrayAxes& axes, const Index3& size,
                std::uint64_t channel, std::uint64_t frame);

    /// The stored bytes, chunk_bytes() of them, of the chunk at this position in the grid; empty if the chunk is
    /// missing.
    /// @throws Error as read().
    [[nodiscard]] virtual std::optional<Bytes> elements(const std::vector<std::uint64_t>& place) const = 0;

private:
    void gather(const char* elements, char* out) const;

    const ChunkedArray array_;
    const ArrayAxes axes_;
    std::vector<std::uint64_t> place_;  ///< position of the channel and frame in the grid of chunks
    std::uint64_t first_ = 0;           ///< index within a chunk of the first element of this channel and frame
};

}  // namespace covol::detail
