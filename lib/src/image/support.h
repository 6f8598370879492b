#pragma once
#include <cstddef>
#include <vector>

#include "covol/image.h"

namespace covol::detail {

/// Whether an image varies more at some places than beside them, whatever it shows there, a step or a line.
struct ImageSupport {
    std::size_t places = 0;  ///< that lie in the image, with the windows beside them
    double fraction =
        0;             ///< probability that the range of values at a place exceeds that beside a place; ties are half
    double error = 0;  ///< of `share`, standard
};

/// Compares the range of the nearest voxels within two steps of each place along its normal with the same about the
/// points five steps before and behind it: the area under the curve of receiver operating characteristics, by ranks
/// (Mann and Whitney), with the error of two samples of one distribution.
/// @param places, normals  world units, as many of both; normals of length 1
/// @param step  world units; where a voxel is longer along a normal, its length there is taken
/// @throws Error as Image::load().
[[nodiscard]] ImageSupport measure_support(const Image& image, const std::vector<Vec3>& places,
                                           const std::vector<Vec3>& normals, double step, const RunContext& run);

/// What a border is: the slope between two brightnesses, or the middle of a line, which has none and whose sides have
/// two.
enum class BorderKind { Slope, Line };

/// Where an image has its strongest border, on the mean of lines across a surface: marks on a border have it where they
/// are.
struct StrongestBorder {
    std::size_t lines = 0;  ///< that count: with the surface, and the place of the strongest border, in the image
    double fraction = 1;    ///< of the mean strength there that the surface has, within a step; its sign does not count
    int at = 0;             ///< steps from the surface, along the normals
    double errors = 0;      ///< standard errors of the mean that both differ by
};

/// Mean strength of a border at whole steps up to ten before and behind each place along its normal; from nearest
/// voxels. The strength of a slope is the difference of two voxels on each side, that of a line the difference of its
/// brightness from that two voxels before and behind. Arguments and errors as of measure_support().
[[nodiscard]] StrongestBorder find_strongest_border(const Image& image, const std::vector<Vec3>& places,
                                                    const std::vector<Vec3>& normals, double step, BorderKind kind,
                                                    const RunContext& run);

}  // namespace covol::detail
