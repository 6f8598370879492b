#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/image/tiff_handle.h"
#include "io/image/tiff_stack.h"
#include "io/pixels/chunks.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// A page (directory) of a TIFF.
struct TiffPage {
    std::uint64_t offset = 0;  ///< position of the directory in the file
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 0, format = 0, samples = 0;

    [[nodiscard]] bool same_kind(const TiffPage& o) const {
        return width == o.width && height == o.height && bits == o.bits && format == o.format && samples == o.samples;
    }
    [[nodiscard]] std::string to_text() const {
        return std::to_string(width) + " x " + std::to_string(height) + " with " + std::to_string(samples) +
               " sample(s) of " + std::to_string(bits) + " bits in sample format " + std::to_string(format);
    }
    [[nodiscard]] std::uint64_t row_bytes() const { return std::uint64_t(width) * samples * (bits / 8); }
    [[nodiscard]] std::uint64_t bytes() const { return row_bytes() * height; }
};

TiffPage current_page(const Tiff& tiff);

/// Opens a file for reading; the maximum size of a block of memory that libtiff allocates is derived from the file's
/// size. @throws Error Io, InvalidInput.
std::unique_ptr<Tiff> open_for_reading(const std::string& path);

/// All full-resolution pages, which must all have the same properties. @throws Error Unsupported, InvalidInput.
std::vector<TiffPage> list_pages(const std::string& path, const Tiff& tiff);

/// Reads the columns and rows of `box`, one sample of each pixel, from the current page of `tiff`. @return false if the
/// page is damaged or truncated.
bool read_page_part(const Tiff& tiff, const TiffPage& page, const VoxelBox& box, std::uint64_t sample, char* out);

/// One channel and frame of a TIFF.
struct TiffFrame {
    std::string path;
    PixelType type = PixelType::UInt8;
    Index3 size{0, 0, 0};
    TiffPage kind;                         ///< properties that all pages have
    std::uint64_t sample = 0;              ///< index of the sample that is read of each pixel
    std::vector<std::string> files;        ///< paths of the files of the image
    std::vector<TiffStack::Plane> slices;  ///< the file and page of each slice
    /// If not 0, position in the file of the first of several contiguous slices that have a single directory.
    std::uint64_t contiguous = 0;
    bool swapped = false;  ///< contiguous slices have the opposite of this machine's byte order
};

/// The size of chunks in voxels. Chunks are one or several tiles, or parts of strips, of at least about 64 KiB. The
/// current page of `tiff` has to be one of the frame's pages.
Index3 tiff_chunk_size(const Tiff& tiff, const TiffFrame& frame);
std::shared_ptr<const ChunkSource> tiff_chunks(const TiffFrame& frame, const Index3& chunk_size);

}  // namespace covol::detail
