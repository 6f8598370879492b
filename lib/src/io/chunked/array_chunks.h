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

/// How elements that are no pixels are stored.
enum class StoredAs { Pixels, Half, Int64, UInt64 };  ///< halfs are told as Float, 64-bit integers as Double

/// An array of any number of dimensions, in chunks of one size.
struct ChunkedArray {
    PixelType type = PixelType::UInt8;
    StoredAs stored_as = StoredAs::Pixels;
    bool swap = false;  ///< the other byte order
    std::vector<std::uint64_t> shape;
    std::vector<std::uint64_t> chunk;    ///< elements along each dimension
    std::vector<std::uint64_t> strides;  ///< elements of a chunk between neighbours along each dimension
    double fill = 0;                     ///< of chunks that are missing

    [[nodiscard]] std::uint64_t stored_bytes() const;  ///< of an element
    [[nodiscard]] std::uint64_t chunk_bytes() const;   ///< of a chunk, unpacked
};

/// Which dimensions of an array are the axes x, y, z, and its channels and frames where it has them.
struct ArrayAxes {
    std::array<std::size_t, 3> space{};
    std::optional<std::size_t> channel, frame;
};

/// Sets size, channels, frames, order and chunk size of an image with one letter for each dimension: x, y, z, c, t, or
/// ? for one of a single element. @throws Error InvalidInput, Unsupported, with `path`.
ArrayAxes describe_axes(const std::string& path, const std::string& letters, const ChunkedArray& array,
                        ImageInfo& info);

/// The chunks of one channel and frame. Dimensions that are no axes have one element.
class ArrayChunks : public ChunkSource {
public:
    [[nodiscard]] bool read(const Index3& chunk, void* out) const final;
    [[nodiscard]] double fill_value() const noexcept final { return array_.fill; }

protected:
    ArrayChunks(const std::string& path, const ChunkedArray& array, const ArrayAxes& axes, const Index3& size,
                std::uint64_t channel, std::uint64_t frame);

    /// The chunk at this place of the grid: chunk_bytes(), as they are stored; nothing where there is none.
    /// @throws Error as read().
    [[nodiscard]] virtual std::optional<Bytes> elements(const std::vector<std::uint64_t>& place) const = 0;

private:
    void gather(const char* elements, char* out) const;

    const ChunkedArray array_;
    const ArrayAxes axes_;
    std::vector<std::uint64_t> place_;  ///< of the channel and frame on the grid of chunks
    std::uint64_t first_ = 0;           ///< their first element in a chunk
};

}  // namespace covol::detail
