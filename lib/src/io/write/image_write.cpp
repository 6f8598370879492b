// write_image() and the checks that all formats need.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>

#include "base/file.h"
#include "base/number.h"
#include "covol/error.h"
#include "covol/image.h"
#include "covol/image_stream.h"
#include "files/atomic.h"
#include "io/chunked/zarr.h"
#include "io/dicom/dicom_segmentation.h"
#include "io/pixels/raw_image.h"
#include "io/write/image_writers.h"

namespace covol {
namespace {

using detail::pixel_bytes;

constexpr const char* kWritable = ".nrrd, .nii, .nii.gz, .mha, .tif, .ome.tif, .npy, .zarr or .dcm";

using Metadata = std::vector<std::pair<std::string, std::string>>;

/// An image whose voxels are all in memory.
class DenseSource : public PixelSource {
public:
    DenseSource(const ImageGeometry& geometry, PixelType type, bool labels, const void* values, Metadata metadata = {})
        : PixelSource(geometry, type, labels),
          values_(static_cast<const char*>(values)),
          metadata_(std::move(metadata)) {}

    void fill(const VoxelBox& box, void* out) const override {
        const Index3 whole = geometry().size, size = box.size();
        const std::uint64_t width = pixel_bytes(type()), row = std::uint64_t(size[0]) * width;
        auto* next = static_cast<char*>(out);
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j, next += row) {
                const std::uint64_t line = std::uint64_t(k) * std::uint64_t(whole[1]) + std::uint64_t(j);
                const std::uint64_t first = line * std::uint64_t(whole[0]) + std::uint64_t(box.min[0]);
                std::memcpy(next, values_ + first * width, row);
            }
    }
    [[nodiscard]] Metadata metadata() const override { return metadata_; }
    [[nodiscard]] std::optional<std::array<double, 2>> range() const override {
        return detail::with_pixel_type(type(), [&](auto pixel) {
            const auto* first = reinterpret_cast<const decltype(pixel)*>(values_);
            const auto [low, high] = std::minmax_element(first, first + detail::voxel_count(geometry().size));
            return std::array<double, 2>{double(*low), double(*high)};
        });
    }

private:
    const char* values_;
    Metadata metadata_;
};

bool is_ome_tiff(const std::string& path) {
    const std::string name = std::filesystem::path(path).stem().string();
    return detail::extension(name) == ".ome";
}

/// The maximum displacement of a voxel along an axis of the lattice, in voxels, if the geometry is rounded to single
/// precision. It is evaluated at the corners of the image.
double moved_by_rounding(const ImageGeometry& geometry) {
    double maximum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index, rounded;
        for (int a = 0; a < 3; ++a) index[a] = (corner >> a & 1) != 0 ? geometry.size[a] - 1 : 0;
        for (int a = 0; a < 3; ++a) {
            rounded[a] = double(float(geometry.origin[a]));
            for (int b = 0; b < 3; ++b)
                rounded[a] += double(float(geometry.direction[a][b] * geometry.spacing[b])) * index[b];
        }
        const Vec3 found = geometry.world_to_index(rounded);
        for (int a = 0; a < 3; ++a) maximum = std::max(maximum, std::abs(found[a] - index[a]));
    }
    return maximum;
}

/// Warns if single precision, in which NIfTI-1 stores positions, is too coarse because the image is far from 0. @throws
/// Error Unsupported if voxels would be displaced by more than half a voxel
void check_precision(const std::string& path, const ImageGeometry& geometry, const RunContext& run) {
    // [voxels] Displacements above kMaxReported are reported; those above kMax are errors.
    constexpr double kMaxReported = 0.01, kMax = 0.5;
    const double moved = moved_by_rounding(geometry);
    const std::string what = path + ": NIfTI-1 stores positions in single precision, which displaces voxels by up to " +
                             detail::number(moved) + " of their size at this distance from 0";
    if (moved > kMax) throw Error(Errc::Unsupported, what + "; write .nrrd or .mha, which store double precision");
    if (moved > kMaxReported) run.warn(what + "; .nrrd and .mha store double precision");
}

/// Warns about properties of the geometry that the format cannot store.
void warn_of_losses(const std::string& path, const ImageGeometry& geometry, const RunContext& run) {
    const std::string extension = detail::extension(path);
    const bool is_tiff = extension == ".tif" || extension == ".tiff";
    if ((is_tiff || extension == ".zarr") && !geometry.is_axis_aligned())
        run.warn(path + ": the image is rotated, and " +
                 (!is_tiff            ? "OME-Zarr 0.4"
                  : is_ome_tiff(path) ? "OME-TIFF"
                                      : "TIFF") +
                 " cannot store that: voxel indices remain the same, but world coordinates differ; write .nrrd or "
                 ".nii.gz to keep the direction");
    if (extension == ".nii" || extension == ".nii.gz") check_precision(path, geometry, run);
    if (is_ome_tiff(path) && geometry.origin != Vec3{0, 0, 0})
        run.warn(path +
                 ": OME-TIFF cannot store the image's origin: the first voxel is placed at 0; .tif, .nrrd "
                 "and others keep the origin");
    if (extension == ".npy")
        run.warn(path + ": NumPy's format stores only the voxels, without spacing, unit, origin and direction");
}

}  // namespace

bool is_zarr_store(const std::string& folder) { return detail::is_zarr(folder); }

void write_image(const std::string& given, const PixelSource& source, const WriteImageOptions& options,
                 const RunContext& run) {
    require_valid(options, "write_image");
    const std::string path = detail::without_end_slash(given);
    check_image_extension(path);
    const ImageGeometry& geometry = source.geometry();
    for (int a = 0; a < 3; ++a)
        if (geometry.size[a] < 1 || !(geometry.spacing[a] > 0))
            throw Error(Errc::InvalidInput,
                        path + ": expected at least one voxel and a positive spacing along each axis, got " +
                            detail::size_text(geometry.size) + " voxels with the spacing " +
                            detail::number(geometry.spacing[0]) + ", " + detail::number(geometry.spacing[1]) + ", " +
                            detail::number(geometry.spacing[2]));
    const std::string extension = detail::extension(path);
    warn_of_losses(path, geometry, run);
    with_threads(run, [&] {
        if (extension == ".zarr")
            detail::write_folder_atomically(path, is_zarr_store(path), [&](const std::string& temporary) {
                detail::write_ome_zarr(temporary, std::filesystem::path(path).filename().string(), source, run);
            });
        else if (extension == ".dcm")
            detail::write_dicom_segmentation(path, source, options, run);
        else
            detail::write_atomically(path, [&](const std::string& temporary) {
                if (extension == ".tif" || extension == ".tiff")
                    detail::write_tiff(temporary, source, is_ome_tiff(path), run);
                else
                    detail::write_raw(temporary, extension, source, options, run);
            });
    });
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels) {
    write_image(path, DenseSource(geometry, PixelType::Int32, true, labels));
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values) {
    write_image(path, DenseSource(geometry, PixelType::UInt8, false, values));
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values,
                 const Metadata& metadata) {
    write_image(path, DenseSource(geometry, PixelType::UInt8, true, values, metadata));
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels,
                 const Metadata& metadata) {
    write_image(path, DenseSource(geometry, PixelType::Int32, true, labels, metadata));
}

void write_image(const std::string& path, const ImageGeometry& geometry, const float* values) {
    write_image(path, DenseSource(geometry, PixelType::Float, false, values));
}

void check_image_extension(const std::string& path) {
    const std::string extension = detail::extension(detail::without_end_slash(path));
    for (const char* known : {".nrrd", ".nii", ".nii.gz", ".mha", ".tif", ".tiff", ".npy", ".zarr", ".dcm"})
        if (extension == known) return;
    throw Error(Errc::InvalidOptions, path + ": expected a name ending in " + kWritable + ", got '" + extension + "'");
}

}  // namespace covol
