#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// The meaning of a value of a label image.
struct NamedLabel {
    std::int32_t value = 0;
    std::string name;
    std::array<std::uint8_t, 3> color{187, 187, 187};  ///< red, green, blue
};

/// The voxels of an image to be written, supplied box by box, so that only the boxes being compressed are in memory.
class COVOL_API PixelSource {
public:
    /// @param labels  the values are labels: a voxel of a coarse level gets the most frequent label instead of the mean
    PixelSource(ImageGeometry geometry, PixelType type, bool labels)
        : geometry_(std::move(geometry)), type_(type), is_labels_(labels) {}
    PixelSource(const PixelSource&) = delete;
    PixelSource& operator=(const PixelSource&) = delete;
    virtual ~PixelSource();

    [[nodiscard]] const ImageGeometry& geometry() const noexcept { return geometry_; }
    [[nodiscard]] PixelType type() const noexcept { return type_; }
    [[nodiscard]] bool is_labels() const noexcept { return is_labels_; }

    /// Writes the values of `box`, as numbers of type(), to `out`, i fastest. Called by several threads at once.
    virtual void fill(const VoxelBox& box, void* out) const = 0;
    /// The common value of all voxels of `box`; none if they differ or if that is only known after evaluating each
    /// voxel.
    [[nodiscard]] virtual std::optional<double> uniform(const VoxelBox& box) const;
    /// A range that contains all values; none if that requires evaluating the voxels. It is stored as the display range
    /// of ImageJ.
    [[nodiscard]] virtual std::optional<std::array<double, 2>> range() const;
    /// Called when the values of a box are known, before they are written, from several threads at once; each voxel of
    /// the file is in exactly one such box.
    /// @param values  of the box; null: all voxels have the value `uniform`
    virtual void wrote(const VoxelBox& box, const void* values, double uniform) const;
    /// Key/value pairs for the header of a NRRD file. Some of them may be known only after all voxels are written.
    /// Therefore this is called before the voxels are written, to reserve space for the header, and again at the end,
    /// to overwrite the header, which must not have become longer.
    [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> metadata() const;
    /// The meaning of the values, for OME-Zarr and DICOM.
    [[nodiscard]] virtual std::vector<NamedLabel> label_names() const;

private:
    ImageGeometry geometry_;
    PixelType type_;
    bool is_labels_;
};

/// Whether a folder is an array or a group of Zarr 2 or 3; writing a .zarr replaces only such folders.
[[nodiscard]] COVOL_API bool is_zarr_store(const std::string& folder);

struct WriteImageOptions {
    bool pack = true;  ///< false: .nrrd and .mha are not compressed
    /// File of an image with the same lattice, or empty. A NIfTI file gets that file's qform and sform and their codes
    /// if they describe the lattice; a DICOM segmentation gets its patient and study, and refers to its slices.
    std::string like = {};
    std::optional<int> like_frame = {};  ///< frame of that image, as ReadImageOptions::frame
};

template <>
inline constexpr auto kOptions<WriteImageOptions> = std::tuple{Option{"pack", &WriteImageOptions::pack}};

/// Writes an image as the other overloads of write_image() do, but in boxes of a few MB that are filled and compressed
/// in parallel: memory does not grow with the image. The file does not depend on the number of threads.
///
/// Formats: .nrrd, .nii, .nii.gz, .mha, .tif, .npy; .dcm is a DICOM segmentation (labels only); .zarr is OME-Zarr 0.4
/// in chunks of 128^3 voxels, with coarser levels, each of half the size, down to one chunk. A TIFF above 4000 MiB of
/// voxels is a BigTIFF in tiles of 256 x 256. A folder that is not a Zarr store is never replaced.
/// @throws Error Io, InvalidOptions (extension), Unsupported (larger than the format allows), Cancelled; whatever the
///     source throws. No partial file remains.
COVOL_API void write_image(const std::string& path, const PixelSource& source, const WriteImageOptions& options = {},
                           const RunContext& run = {});

}  // namespace covol
