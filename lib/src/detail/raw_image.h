#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>

#include "covol/image.h"

namespace covol::detail {

/// What the readers of the single file formats hand to read_image().
struct RawImage {
    ImageGeometry geometry;
    PixelType type = PixelType::Float;
    std::shared_ptr<void> data;  ///< i fastest; null when only the header was asked for
};

/// Calls visit(T{}) with the C++ type of `type`.
template <typename Visitor>
decltype(auto) with_pixel_type(PixelType type, Visitor&& visit) {
    switch (type) {
        case PixelType::UInt8: return visit(std::uint8_t{});
        case PixelType::Int8: return visit(std::int8_t{});
        case PixelType::UInt16: return visit(std::uint16_t{});
        case PixelType::Int16: return visit(std::int16_t{});
        case PixelType::UInt32: return visit(std::uint32_t{});
        case PixelType::Int32: return visit(std::int32_t{});
        case PixelType::Float: return visit(float{});
        case PixelType::Double: break;
    }
    return visit(double{});
}

inline std::uint64_t pixel_bytes(PixelType type) {
    return with_pixel_type(type, [](auto pixel) { return std::uint64_t(sizeof(pixel)); });
}

/// "512 x 512 x 58"
std::string size_text(const Index3& size);

/// @throws Error InvalidInput unless the image has at least two voxels along each axis.
void require_3d(const std::string& path, const std::uint64_t (&size)[3]);

/// Memory for size voxels, after a check that a file of `file_bytes` can hold that many at all (0: unknown, the data
/// lies in another file) and that the machine can.
/// @throws Error InvalidInput, Unsupported.
std::shared_ptr<void> allocate_pixels(const std::string& path, std::uint64_t voxels, PixelType type,
                                      std::uint64_t file_bytes);

/// Where a file keeps its pixels. NIfTI's and MetaImage's are read here and not by ITK, whose readers fill up what a
/// truncated file lacks without a word; NIfTI's moreover takes a.nii's pixels for a.nii.gz where both exist.
struct PixelPlace {
    std::string path;
    std::uint64_t file_offset = 0;  ///< of the pixels, or of the packed stream
    std::uint64_t skip = 0;         ///< unpacked bytes before the pixels
    bool packed = false;            ///< gzip or zlib
    bool swap = false;              ///< the other byte order
    PixelType type = PixelType::UInt8;
    double slope = 1;  ///< pixel = slope * stored + intercept
    double intercept = 0;
};

/// Reads `count` bytes; false when there are fewer, or the packed stream is damaged.
bool read_bytes(const PixelPlace& place, std::uint64_t count, void* out);

/// Reads `count` pixels as `type`; false as above.
bool read_pixels(const PixelPlace& place, std::uint64_t count, PixelType type, void* out);

/// Reverses the bytes of each of `count` values of `width` bytes.
void swap_bytes(void* data, std::uint64_t count, std::uint64_t width);

/// "um" for every spelling of the micrometre, "mm", ...; the text itself when it is no unit that we know.
std::string normal_unit(const std::string& text);

/// Length of a unit in metres; 0 when unknown.
double unit_in_metres(const std::string& normal_unit);

}  // namespace covol::detail
