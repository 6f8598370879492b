#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "covol/domain.h"
#include "covol/fwd.h"
#include "covol/run.h"

namespace covol {

/// Where an image's voxels lie in the world, as ITK has it (LPS):
/// world = origin + direction * diag(spacing) * (i,j,k), voxel centres at integers.
struct ImageGeometry {
    Index3 size{0, 0, 0};         ///< voxels along i, j, k
    Vec3 spacing{1, 1, 1};        ///< world units, > 0
    Vec3 origin{0, 0, 0};         ///< world position of the centre of voxel (0,0,0)
    Matrix3 direction{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< columns are the axes i, j, k; orthonormal
    std::string unit;             ///< "um", "mm", ... or empty when the file does not say
    bool spacing_known = true;    ///< false: the file states no spacing, and 1 stands in for what is missing

    [[nodiscard]] Vec3 index_to_world(const Vec3& index) const;
    [[nodiscard]] Vec3 world_to_index(const Vec3& world) const;
    /// The smallest box that holds every voxel (cubes, not centres).
    [[nodiscard]] WorldBox world_box() const;
    /// Direction is the identity up to 1e-6.
    [[nodiscard]] bool is_axis_aligned() const;
};

enum class PixelType { UInt8, Int8, UInt16, Int16, UInt32, Int32, Float, Double };

struct ReadImageOptions {
    Vec3 spacing{0, 0, 0};  ///< Replaces the file's spacing where > 0.
    int channel = -1;       ///< Which channel of a hyperstack, from 0; -1: there must be only one.
    int frame = -1;         ///< Which time point of a series, from 0; -1: there must be only one.
};

/// A scalar 3D image in memory, in the file's own pixel type (a byte stays a byte).
class Image {
public:
    [[nodiscard]] const ImageGeometry& geometry() const noexcept { return geometry_; }
    [[nodiscard]] PixelType pixel_type() const noexcept { return type_; }
    [[nodiscard]] const std::string& path() const noexcept { return path_; }
    /// The value of voxel (i,j,k); @pre inside.
    [[nodiscard]] double at(int i, int j, int k) const;

    /// Trilinear samples at the centres of the voxels min..max (inclusive) of `frame`'s lattice;
    /// positions outside the image take the nearest voxel's value.
    /// @param out  (max-min+1) values, k fastest (OpenVDB's leaf order).
    void sample(const Domain& frame, const Index3& min, const Index3& max, float* out) const;

    /// Intensities below which the fractions `low` and `high` of the voxels lie (deterministic;
    /// large images are subsampled on a regular lattice).
    [[nodiscard]] std::array<double, 2> percentiles(double low, double high) const;
    /// Smallest and largest value.
    [[nodiscard]] std::array<double, 2> range() const;

    /// Takes a copy of `values` (i fastest, size[0]*size[1]*size[2]).
    static Image from_values(const ImageGeometry& geometry, const float* values);
    static Image from_values(const ImageGeometry& geometry, const std::uint8_t* values);

private:
    friend Image read_image(const std::string&, const ReadImageOptions&, const RunContext&);
    ImageGeometry geometry_;
    PixelType type_ = PixelType::Float;
    std::string path_;
    std::shared_ptr<const void> data_;  // i fastest
};

/// Reads a multi-page TIFF (ImageJ and OME spacing understood), NRRD, NIfTI or MetaImage.
/// @throws Error Io (cannot be opened or read), InvalidInput (not 3D, empty, NaN or infinite values),
///               Unsupported (colour or vector pixels, an unknown format).
[[nodiscard]] Image read_image(const std::string& path, const ReadImageOptions& options = {},
                               const RunContext& run = {});

/// Only what the header says. @throws as read_image.
[[nodiscard]] ImageGeometry read_image_geometry(const std::string& path, const ReadImageOptions& options = {});

/// Writes values (i fastest) in the geometry's frame: .nrrd, .nii, .nii.gz, .mha, .tif by the name's end; packed,
/// except .nii. A TIFF has spacing and unit (Fiji's way) but no place for an origin or a direction; NIfTI has no unit
/// but the millimetre, the numbers are written as they are.
/// Whole or not at all: to a temporary name beside the target, then renamed.
void write_image(const std::string& path, const ImageGeometry& geometry, const std::int32_t* labels);
void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values);
void write_image(const std::string& path, const ImageGeometry& geometry, const float* values);
/// The same with key/value pairs, which NRRD keeps and the other formats drop.
void write_image(const std::string& path, const ImageGeometry& geometry, const std::uint8_t* values,
                 const std::vector<std::pair<std::string, std::string>>& metadata);

/// What `write_image` can write, judged by the name alone. @throws Error InvalidOptions with the list.
void check_image_extension(const std::string& path);

}  // namespace covol
