#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "covol/api.h"
#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

namespace detail {
class ChunkedVoxels;
}

/// The position of an image's voxels in the world, as in ITK (LPS):
/// world = origin + direction * diag(spacing) * (i,j,k), voxel centres at integers.
struct ImageGeometry {
    Index3 size{0, 0, 0};                                  ///< voxels along i, j, k
    Vec3 spacing{1, 1, 1};                                 ///< world units, > 0
    Vec3 origin{0, 0, 0};                                  ///< world position of the centre of voxel (0,0,0)
    Matrix3 direction{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< columns are the axes i, j, k; orthonormal
    std::string unit;                                      ///< "um", "mm", ... or empty if the file states no unit
    bool spacing_known = true;  ///< false: the file states no spacing for some axis, and 1 is used instead

    [[nodiscard]] COVOL_API Vec3 index_to_world(const Vec3& index) const;
    [[nodiscard]] COVOL_API Vec3 world_to_index(const Vec3& world) const;
    /// The smallest box that contains every voxel (whole voxels, not only their centres).
    [[nodiscard]] COVOL_API WorldBox world_box() const;
    /// Whether `direction` is the identity, up to 1e-6.
    [[nodiscard]] COVOL_API bool is_axis_aligned() const;
    [[nodiscard]] double smallest_spacing() const { return std::min({spacing[0], spacing[1], spacing[2]}); }
};

enum class PixelType { UInt8, Int8, UInt16, Int16, UInt32, Int32, Float, Double };

/// The name of the type: "uint8", ..., "float", "double".
[[nodiscard]] COVOL_API const char* to_string(PixelType type);
/// Number of bytes of one pixel.
[[nodiscard]] COVOL_API std::size_t bytes_of(PixelType type);

/// The voxels min..max of an image, inclusive.
struct VoxelBox {
    Index3 min{0, 0, 0};
    Index3 max{-1, -1, -1};

    [[nodiscard]] Index3 size() const { return {max[0] - min[0] + 1, max[1] - min[1] + 1, max[2] - min[2] + 1}; }
    [[nodiscard]] COVOL_API bool contains(const Index3& voxel) const;
    friend bool operator==(const VoxelBox&, const VoxelBox&) = default;
};

struct ReadImageOptions {
    std::optional<Vec3> spacing;  ///< world units, > 0; automatic: the spacing in the file
    /// index of the channel to be read, from 0; automatic: the only channel, and an error if there are several
    std::optional<int> channel;
    /// index of the time point to be read, from 0; automatic: the only time point, and an error if there are several
    std::optional<int> frame;
    /// Reads only the voxels that interpolation within this box needs: those in the box and one more on every side.
    std::optional<WorldBox> roi = {};
    /// If a coarse level of a pyramid states no translation, it is moved by half the difference between its spacing and
    /// that of the finest level. This position is right if its voxels are means of voxels of the finest level.
    bool correct_level_shift = false;
};

template <>
inline constexpr auto kOptions<ReadImageOptions> =
    std::tuple{Option{"spacing", &ReadImageOptions::spacing, kPositiveLength, Group::Input,
                      "voxel spacing, instead of the file's"},
               Option{"channel", &ReadImageOptions::channel, kNotNegative, Group::Input,
                      "channel of an image with several channels, counted from 0"},
               Option{"frame", &ReadImageOptions::frame, kNotNegative, Group::Input,
                      "time point of an image with several time points, counted from 0"},
               Option{"roi", &ReadImageOptions::roi, Group::Input, "read only this box, in world coordinates"},
               Option{"correct_level_shift", &ReadImageOptions::correct_level_shift, Group::Input,
                      "align a coarse level of an OME-Zarr image with the finest level if it states no translation"}};

/// Statistics of an image whose file stores it in chunks, that is, in separately compressed boxes.
struct ChunkCount {
    Index3 size{0, 0, 0};     ///< voxels of a chunk along i, j, k
    std::uint64_t read = 0;   ///< number of chunks that were read and decoded
    std::uint64_t total = 0;  ///< number of chunks of the whole image
};

/// Voxels in their memory layout.
struct VoxelView {
    PixelType type = PixelType::Float;
    std::shared_ptr<const void> first;            ///< voxel (0,0,0); keeps the memory alive
    std::array<std::int64_t, 3> stride{1, 0, 0};  ///< pixels from one voxel to the next along i, j, k; of any sign
};

/// A scalar 3D image in the file's own pixel type (a byte remains a byte).
///
/// Its geometry is always that of the whole image; with ReadImageOptions::roi only a box of voxels is held. Large files
/// whose pixels have the same layout as in memory are mapped, so that only accessed parts take memory. Each chunk of a
/// large image in chunks is read when one of its voxels is first requested, and then kept; if the chunk is damaged, the
/// function that requested the voxel throws. Such files must not be changed during the lifetime of the image.
class Image {
public:
    [[nodiscard]] const ImageGeometry& geometry() const noexcept { return geometry_; }
    [[nodiscard]] PixelType pixel_type() const noexcept { return type_; }
    [[nodiscard]] const std::string& path() const noexcept { return path_; }
    /// The box of voxels that can be accessed.
    [[nodiscard]] const VoxelBox& held() const noexcept { return held_; }
    /// The value of voxel (i,j,k). @pre held() contains the voxel
    [[nodiscard]] COVOL_API double at(int i, int j, int k) const;
    /// Copies the values of a box of voxels to `out`, i fastest. @pre held() contains the box
    COVOL_API void copy(const VoxelBox& box, float* out) const;
    /// How many chunks were read; none if the image is not read in chunks.
    [[nodiscard]] COVOL_API std::optional<ChunkCount> chunks() const;

    /// Trilinear samples at the centres of the voxels min..max (inclusive) of `frame`'s lattice; positions outside the
    /// image take the nearest voxel's value.
    /// @param out  (max-min+1) values, k fastest (OpenVDB's leaf order).
    /// @throws Error InvalidInput if the samples need voxels of the image that are not held.
    COVOL_API void sample(const Domain& frame, const Index3& min, const Index3& max, float* out) const;

    /// Announces which parts of `frame`'s lattice will be requested from sample(): for a large image in chunks, the
    /// necessary chunks are decoded now, in the file's order and in parallel, instead of one by one on request. For
    /// other images this does nothing.
    /// @throws Error InvalidInput (a damaged file), Io, Cancelled, InvalidOptions (needs more than run.memory_budget).
    COVOL_API void load(const Domain& frame, const std::vector<VoxelBox>& boxes, const RunContext& run = {}) const;
    /// Decodes in parallel the chunks that samples at these world positions will need. Does nothing for an image whose
    /// chunks are not read on request.
    COVOL_API void load(const std::vector<Vec3>& places, const RunContext& run = {}) const;
    /// Decodes in parallel the chunks of a box of held voxels that will be requested from copy() or at(). Does nothing
    /// for an image whose chunks are not read on request.
    COVOL_API void load(const VoxelBox& box, const RunContext& run = {}) const;

    /// Returns the accessed pages of a mapped file to the system; they are read again on request. Does nothing for
    /// images that are not mapped.
    COVOL_API void release() const;

    /// Intensities below which the fractions `low` and `high` of the held voxels lie. Large images are subsampled on a
    /// regular lattice. For large images in chunks, the chunks that have been read so far are used; if none has been
    /// read, up to 27 on a regular lattice are read.
    [[nodiscard]] COVOL_API std::array<double, 2> percentiles(double low, double high) const;
    /// Minimum and maximum of the held voxels: for a large mapped file, of some slices only; for an image in chunks, of
    /// the chunks that percentiles() uses.
    [[nodiscard]] COVOL_API std::array<double, 2> range() const;
    /// The held voxels as a separate image, which shares their memory.
    [[nodiscard]] COVOL_API Image cropped() const;
    /// The same voxels with another geometry; the memory is shared. @throws Error InvalidInput if the sizes
    /// differ.
    [[nodiscard]] COVOL_API Image placed(const ImageGeometry& geometry) const;

    /// An image with a copy of `values` (i fastest; size[0]*size[1]*size[2] of them).
    COVOL_API static Image from_values(const ImageGeometry& geometry, const float* values);
    COVOL_API static Image from_values(const ImageGeometry& geometry, const std::uint8_t* values);
    /// An image that uses the given voxels without a copy; they must not change during the lifetime of the image.
    /// @throws Error InvalidInput (fewer than two voxels along an axis, an invalid spacing or origin, values that are
    ///     not finite), Unsupported (axes that are not perpendicular).
    [[nodiscard]] COVOL_API static Image from_view(const ImageGeometry& geometry, const VoxelView& voxels);
    /// The held voxels, without a copy; none for an image whose chunks are read on request.
    [[nodiscard]] COVOL_API std::optional<VoxelView> view() const;

private:
    friend Image read_image(const std::string&, const ReadImageOptions&, const RunContext&);
    template <typename T>
    [[nodiscard]] const T* row(int j, int k) const;
    template <typename T>
    static Image copy_of(const ImageGeometry& geometry, PixelType type, const T* values);
    void require_finite() const;
    template <typename T>
    [[nodiscard]] std::vector<T> values_of_chunks(double maximum) const;
    [[nodiscard]] VoxelBox in_file(const VoxelBox& held) const;
    void expect_slice(int k) const;
    void forget_slice(int k) const;
    [[nodiscard]] std::uint64_t slice_bytes() const;

    ImageGeometry geometry_;
    PixelType type_ = PixelType::Float;
    std::string path_;
    VoxelBox held_;
    std::shared_ptr<const void> data_;             // points to voxel held_.min
    std::array<std::int64_t, 3> stride_{1, 0, 0};  // pixels from one voxel to the next along i, j, k
    bool mapped_ = false;
    std::shared_ptr<const detail::ChunkedVoxels> chunks_;  // used instead of data_ for an image that is read in chunks
    Index3 first_{0, 0, 0};                                // index in the file of voxel held_.min
    std::optional<ChunkCount> chunk_count_;
};

/// The information in the header of an image file.
struct ImageInfo {
    ImageGeometry geometry;
    PixelType type = PixelType::Float;
    std::string format;                                   ///< "ImageJ TIFF", "NIfTI-1", ...
    std::string axis_order;                               ///< order of the axes in the file, fastest first: "XYCZT"
    int channels = 1;                                     ///< ReadImageOptions::channel chooses one of them
    int frames = 1;                                       ///< ReadImageOptions::frame chooses one of them
    std::vector<std::string> channel_names;               ///< empty, or one for each channel
    std::array<bool, 3> spacing_known{true, true, true};  ///< for each axis: whether the file states its spacing
    /// Header fields that were used, with their values as in the file.
    std::vector<std::pair<std::string, std::string>> fields;
    /// Memory that read_image() takes; 0 if it maps the file or reads chunks on request.
    std::uint64_t bytes_to_hold = 0;
    Index3 chunk_size{0, 0, 0};       ///< voxels of a chunk; 0: the image is not read in chunks
    std::vector<std::string> levels;  ///< names and sizes of a pyramid's levels, the finest first; empty: no pyramid
};

/// Reads a 3D image: TIFF (including descriptions by ImageJ, OME and tifffile; BigTIFF, tiles, several files), NRRD,
/// NIfTI, MetaImage, MRC, ICS, NumPy (.npy), a DICOM series (its folder, or one of its files), OME-Zarr and Zarr 2 and
/// 3 (the folder of the image, or of one level), HDF5 (Imaris, BigDataViewer, ITK's, or a dataset:
/// "FILE.h5:/path/to/dataset"), a float grid of a .vdb file ("FILE.vdb:name", or its first one; the image is the box
/// of its active voxels). Warns if a file states no spacing.
/// @throws Error Io (cannot be opened or read), InvalidInput (not 3D, empty, NaN or infinite values; a roi outside of
/// the image), Unsupported (several channels, frames or series and none chosen: the message lists them; an unknown
/// format).
[[nodiscard]] COVOL_API Image read_image(const std::string& path, const ReadImageOptions& options = {},
                                         const RunContext& run = {});

/// Reads only the header and returns its geometry; options.roi is ignored. @throws as read_image().
[[nodiscard]] COVOL_API ImageGeometry read_image_geometry(const std::string& path, const ReadImageOptions& options = {},
                                                          const RunContext& run = {});

/// Reads only the header and returns its information. @throws as read_image(), but channel and frame need not be
/// chosen.
[[nodiscard]] COVOL_API ImageInfo read_image_info(const std::string& path, const ReadImageOptions& options = {},
                                                  const RunContext& run = {});

/// The voxels that read_image() holds for `roi`. @throws Error InvalidInput if `roi` does not intersect the image.
[[nodiscard]] COVOL_API VoxelBox voxels_around(const ImageGeometry& geometry, const WorldBox& roi);

/// The geometry of the part of the image that consists of the voxels in `box`.
[[nodiscard]] COVOL_API ImageGeometry cropped(const ImageGeometry& geometry, const VoxelBox& box);

/// Writes an image with this geometry and these values (i fastest) as .nrrd, .nii, .nii.gz, .mha or .tif, by the file
/// extension; compressed, except .nii. A TIFF has spacing, unit and origin (as Fiji writes them) but cannot store a
/// direction; NIfTI stores only the units m, mm and um. Lengths are written as they are, in whatever unit. The file is
/// written completely or not at all: under a temporary name in the same folder, then renamed.
COVOL_API void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels);
COVOL_API void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values);
COVOL_API void write_image(const std::string& path, const ImageGeometry& geometry, const float* values);
/// Writes an image as the functions above do, with key/value pairs, which only NRRD stores.
COVOL_API void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values,
                           const std::vector<std::pair<std::string, std::string>>& metadata);
COVOL_API void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels,
                           const std::vector<std::pair<std::string, std::string>>& metadata);

/// Checks by the name alone that `write_image` can write the file. @throws Error InvalidOptions with the list of
/// extensions.
COVOL_API void check_image_extension(const std::string& path);

}  // namespace covol
