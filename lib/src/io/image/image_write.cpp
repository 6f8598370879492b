// Images to files.
#include <string>

#include "base/file.h"
#include "covol/error.h"
#include "covol/image.h"
#include "io/image/image_formats.h"
#include "io/image/tiff.h"

namespace covol {
namespace {

constexpr const char* kWritable = ".nrrd, .nii, .nii.gz, .mha or .tif";

bool is_tiff(const std::string& path) {
    const std::string extension = detail::extension(path);
    return extension == ".tif" || extension == ".tiff";
}

void write_values(const std::string& path, const ImageGeometry& geometry, PixelType type, const void* values,
                  const detail::ImageMetadata& metadata = {}) {
    check_image_extension(path);
    for (int a = 0; a < 3; ++a)
        if (geometry.size[a] < 1 || !(geometry.spacing[a] > 0))
            throw Error(Errc::InvalidInput, "write_image: " + path + ": expected voxels along every axis, got " +
                                                detail::size_text(geometry.size));
    detail::write_atomically(path, [&](const std::string& temporary) {
        if (is_tiff(path))
            detail::write_tiff(temporary, geometry, type, values);
        else
            detail::write_itk(temporary, geometry, type, values, metadata);
    });
}

}  // namespace

void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels) {
    write_values(path, geometry, PixelType::Int32, labels);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values) {
    write_values(path, geometry, PixelType::UInt8, values);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values,
                 const std::vector<std::pair<std::string, std::string>>& metadata) {
    write_values(path, geometry, PixelType::UInt8, values, metadata);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels,
                 const std::vector<std::pair<std::string, std::string>>& metadata) {
    write_values(path, geometry, PixelType::Int32, labels, metadata);
}

void write_image(const std::string& path, const ImageGeometry& geometry, const float* values) {
    write_values(path, geometry, PixelType::Float, values);
}

void check_image_extension(const std::string& path) {
    const std::string extension = detail::extension(path);
    for (const char* known : {".nrrd", ".nii", ".nii.gz", ".mha", ".tif", ".tiff"})
        if (extension == known) return;
    throw Error(Errc::InvalidOptions,
                "write_image: " + path + ": expected a name ending in " + kWritable + ", got '" + extension + "'");
}

}  // namespace covol
