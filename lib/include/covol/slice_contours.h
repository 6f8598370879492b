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

// Where surfaces meet the slices of an image: what programs for radiotherapy draw and read.
namespace covol {

/// A closed curve in a slice; the last point joins the first.
struct SliceContour {
    int slice = 0;             ///< k of the lattice
    std::vector<Vec3> points;  ///< world units
};

/// The closed curves where a surface meets the slices of a lattice, by marching squares over trilinear samples of the
/// level set that are at most one of its voxels apart. Slices ascend.
///
/// A part with holes is one curve: each hole is joined to the rest by a channel of no width, which is passed there and
/// back ("keyhole", DICOM PS3.3 C.8.8.6.3). Beyond the image the curves follow its end, half a voxel beyond the last
/// centres.
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

/// Writes a DICOM RT structure set: an ROI for each structure. Where `like` is a DICOM series, the patient, the study
/// and the frame of reference are its own, and each contour refers to the slice that it lies in.
/// @param geometry  of the image, whose slices the contours lie in
/// @param like  that image, or empty @param frame  of that image, as ReadImageOptions::frame
/// @throws Error Io, Unsupported (rows and columns that are not perpendicular), Cancelled.
COVOL_API void write_rt_structures(const std::string& path, const std::vector<ContouredStructure>& structures,
                                   const ImageGeometry& geometry, const std::string& like = {},
                                   const std::optional<int>& frame = {}, const RunContext& run = {});

}  // namespace covol
