#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/run.h"

// Contours of surfaces in the slices of an image, for programs for radiotherapy.
namespace covol {

/// A closed curve in a slice; the last point is connected to the first.
struct SliceContour {
    int slice = 0;             ///< index k of the slice
    std::vector<Vec3> points;  ///< world units
};

/// The closed curves in which a surface intersects the slices of a lattice, by marching squares over trilinear samples
/// of the level set, at most one voxel of the level set apart. In ascending order of the slices.
///
/// A section with holes is one curve: each hole is connected to the outline by a channel of zero width, which is
/// traversed in both directions ("keyhole", DICOM PS3.3 C.8.8.6.3). Surfaces that extend beyond the image are cut at
/// its end, half a voxel beyond the last centres.
/// @param surface  a signed distance, negative inside
/// @throws Error Cancelled.
[[nodiscard]] COVOL_API std::vector<SliceContour> outline_slices(const FloatGrid& surface,
                                                                 const ImageGeometry& geometry,
                                                                 const RunContext& run = {});

/// The contours of one structure.
struct ContouredStructure {
    std::string name;
    std::array<std::uint8_t, 3> color{187, 187, 187};  ///< red, green, blue
    std::vector<SliceContour> contours;
};

/// Writes a DICOM RT structure set with an ROI for each structure. If `like` is a DICOM series, patient, study and
/// frame of reference are those of the series, and each contour refers to the slice in which it lies.
/// @param geometry  of the image in whose slices the contours lie
/// @param like   file of that image, or empty
/// @param frame  of that image, as ReadImageOptions::frame
/// @throws Error Io, Unsupported (rows and columns that are not perpendicular), Cancelled.
COVOL_API void write_rt_structures(const std::string& path, const std::vector<ContouredStructure>& structures,
                                   const ImageGeometry& geometry, const std::string& like = {},
                                   const std::optional<int>& frame = {}, const RunContext& run = {});

}  // namespace covol
