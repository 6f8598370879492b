#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "covol/error.h"
#include "covol/image.h"

namespace covol::detail {

class ChunkedVoxels;
class ChunkSource;

/// Voxels of an open file: either `data` points to the first voxel of the requested box, or `chunks` has all voxels of
/// the image.
struct Pixels {
    std::shared_ptr<const void> data;
    std::array<std::int64_t, 3> stride{1, 0, 0};  ///< distance in pixels between neighbours along i, j, k
    bool mapped = false;
    std::shared_ptr<const ChunkedVoxels> chunks{};
    std::optional<ChunkCount> chunk_count{};  ///< empty if the image is not stored in chunks
};

/// The part of an image that is read; it must be within the image.
struct PixelRequest {
    VoxelBox box;
    std::uint64_t channel = 0;
    std::uint64_t frame = 0;
};

/// An image file whose header has been read and checked. One class for each family of formats.
class ImageFile {
public:
    ImageFile() = default;
    ImageFile(const ImageFile&) = delete;
    ImageFile& operator=(const ImageFile&) = delete;
    virtual ~ImageFile() = default;

    [[nodiscard]] const ImageInfo& info() const noexcept { return info_; }
    /// Reads (or maps) the voxels of the request's box, in this machine's byte order and as info().type. Calls
    /// run.check() from time to time. @throws Error InvalidInput (damaged, truncated), Unsupported (too large), Io.
    [[nodiscard]] virtual Pixels read(const PixelRequest& request, const RunContext& run) = 0;
    /// Number of bytes that read() allocates: the size of the whole box, unless a format overrides this.
    [[nodiscard]] virtual std::uint64_t bytes_to_hold(const PixelRequest& request) const;

    /// The chunks of a channel and frame, each of which can be decoded separately; null if the file is not stored in
    /// chunks.
    [[nodiscard]] virtual std::shared_ptr<const ChunkSource> chunk_source(const PixelRequest& request) const;
    /// The coarser levels of a pyramid, finest first, as names that read_image() accepts.
    [[nodiscard]] virtual std::vector<std::string> coarser_levels() const { return {}; }

    /// Files that are read in addition to the file that the caller named, or the files of the folder that the caller
    /// named.
    [[nodiscard]] const std::vector<std::string>& files() const noexcept { return files_; }
    void refer_to(std::vector<std::string> files) { files_ = std::move(files); }

protected:
    ImageInfo info_;

private:
    std::vector<std::string> files_;
};

/// Calls visit(T{}), where T is the C++ type that corresponds to `type`.
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

/// The size as a text, such as "512 x 512 x 58".
std::string size_text(const Index3& size);

std::uint64_t voxel_count(const Index3& size);

/// All voxels of an image of this size.
VoxelBox whole_box(const Index3& size);

/// Strides of voxels that are stored contiguously, i fastest.
std::array<std::int64_t, 3> dense_strides(const Index3& size);

/// An Error whose message begins with "PATH: ".
Error read_error(Errc code, const std::string& path, const std::string& what, const std::string& option = {});

/// The error for a voxel that is NaN or infinite.
Error not_finite(const std::string& path, const Index3& voxel);

/// Converts the size of an image. @throws Error InvalidInput if it has fewer than two voxels along an axis (a 2D image
/// is not read, not even as one slice), or so many voxels that only a damaged header can claim them.
Index3 require_3d(const std::string& path, const std::uint64_t (&size)[3]);

/// Allocates memory for the pixels, after checking that a file of `file_bytes` bytes can contain them (0: no check,
/// because the size is unknown) and that the memory of the machine suffices. @throws Error InvalidInput, Unsupported.
std::shared_ptr<void> allocate_pixels(const std::string& path, std::uint64_t pixels, PixelType type,
                                      std::uint64_t file_bytes);

/// Position of the pixels in a file, frame after frame, i fastest. ITK's readers are not used for such pixels: they
/// read the whole file, and report no error if a truncated file lacks pixels. Moreover, ITK's NIfTI reader uses the
/// pixels of a.nii for a.nii.gz if both exist.
struct PixelPlace {
    std::string path;
    std::uint64_t file_offset = 0;  ///< position in bytes of the pixels, or of the packed stream
    std::uint64_t skip = 0;         ///< number of unpacked bytes before the pixels
    bool packed = false;            ///< the pixels are a stream packed by gzip or zlib
    bool swap = false;              ///< the byte order is not that of this machine
    bool half = false;              ///< 16-bit floats, converted to Float
    PixelType type = PixelType::UInt8;
    double slope = 1;  ///< pixel = slope * stored + intercept
    double intercept = 0;
    std::uint64_t frame_gap = 0;  ///< number of unpacked bytes between frames

    [[nodiscard]] std::uint64_t stored_bytes() const { return half ? 2 : pixel_bytes(type); }
    [[nodiscard]] bool as_stored() const { return !swap && !half && slope == 1 && intercept == 0; }
};

/// Reads the first `count` bytes of the pixels; returns false if there are fewer, or if the compressed stream is
/// damaged.
bool read_bytes(const PixelPlace& place, std::uint64_t count, void* out);

/// Converts every `step`th of the stored values (in this machine's byte order) to pixels: slope * stored + intercept.
void convert_pixels(const PixelPlace& place, const void* stored, std::uint64_t step, std::uint64_t count,
                    PixelType type, void* out);

/// An image whose pixels are at `place`: info.channels interleaved, info.frames one after another. @throws Error
/// InvalidInput if the file is too short.
std::unique_ptr<ImageFile> open_placed(const std::string& path, const ImageInfo& info, const PixelPlace& place);

/// Maps `bytes` bytes of a file at `offset` into memory; the file must be large enough. @throws Error Io.
std::shared_ptr<const void> map_file(const std::string& path, std::uint64_t offset, std::uint64_t bytes);

/// Whether a part of an image of this size is mapped or decoded on demand; smaller parts are read as a whole.
bool is_worth_mapping(std::uint64_t bytes);

/// Advises the operating system to read mapped pages in advance.
void prefetch_pages(const void* begin, std::uint64_t bytes);

/// Releases the physical memory of mapped pages; they are read from the file again when they are accessed.
void release_pages(const void* begin, std::uint64_t bytes);

/// Reverses the bytes of each of `count` values of `width` bytes.
void swap_bytes(void* data, std::uint64_t count, std::uint64_t width);

/// Covol's name of a unit, for example "um" for every spelling of the micrometre; empty for pixels, voxels and the
/// "reference frame" of OME. If the text is not a known unit, it is returned in lower case and without enclosing blanks
/// and quotes.
std::string normal_unit(const std::string& text);

/// Length in metres of a unit as returned by normal_unit(); 0 if the unit is unknown.
double unit_in_metres(const std::string& normal_unit);

}  // namespace covol::detail
