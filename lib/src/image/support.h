#pragma once
#include <cstddef>
#include <vector>

#include "covol/image.h"

namespace covol::detail {

/// Whether an image varies more at certain places, due to a step or a line of intensity, than beside them.
struct ImageSupport {
    std::size_t places = 0;  ///< number of places whose window and at least one window beside it lie in the image
    double fraction = 0;     ///< probability that the range at a place exceeds a range beside one; ties count half
    double error = 0;        ///< standard error of `fraction`
};

/// Compares the range of the nearest voxels' values within two steps of each place along its normal with the ranges
/// around the points five steps before and behind it. The result is the area under the receiver operating
/// characteristic, computed from ranks (Mann and Whitney), with the standard error for two samples of the same
/// distribution.
/// @param places, normals  world units, the same number of both; normals of length 1
/// @param step  world units; if a voxel is longer along a normal, its length is used instead
/// @throws Error as Image::load().
[[nodiscard]] ImageSupport measure_support(const Image& image, const std::vector<Vec3>& places,
                                           const std::vector<Vec3>& normals, double step, const RunContext& run);

/// The kind of a border: the slope between two intensities, or the middle of a line, which has no slope itself but one
/// on each side.
enum class BorderKind { Slope, Line };

/// The position of the strongest border, in the mean over lines across a surface. If the marks of the surface are on a
/// border, this position is 0.
struct StrongestBorder {
    /// number of lines used: those on which both the surface and the strongest border are in the image
    std::size_t lines = 0;
    /// absolute mean strength of the strongest border within one step of the surface, divided by that of the strongest
    /// border at any position
    double fraction = 1;
    int at = 0;  ///< position of the strongest border in steps from the surface, along the normals
    /// mean over the lines of the difference between the strengths of these two borders, in standard errors
    double errors = 0;
};

/// Computes the mean strength of a border at whole steps up to ten before and behind each place along its normal, from
/// nearest voxels. The strength of a slope is the difference between two values on each side, that of a line the
/// difference between its intensity and the intensity two steps before and behind. Arguments and errors as in
/// measure_support().
[[nodiscard]] StrongestBorder find_strongest_border(const Image& image, const std::vector<Vec3>& places,
                                                    const std::vector<Vec3>& normals, double step, BorderKind kind,
                                                    const RunContext& run);

}  // namespace covol::detail
