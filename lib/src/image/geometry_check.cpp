#include "image/geometry_check.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "base/number.h"
#include "covol/error.h"
#include "limits/world_limits.h"

namespace covol::detail {
namespace {

/// Requires axes of length 1 that do not lie in a plane; they may be sheared. @throws Error Unsupported.
void check_direction(const std::string& where, const ImageGeometry& g) {
    constexpr double kTolerance = 1e-3, kMinVolume = 0.05;
    const Matrix3& d = g.direction;
    for (int a = 0; a < 3; ++a) {
        const double length = std::sqrt(d[0][a] * d[0][a] + d[1][a] * d[1][a] + d[2][a] * d[2][a]);
        if (!(std::abs(length - 1) <= kTolerance))
            throw Error(Errc::Unsupported,
                        where + ": direction: expected axes of length 1, got " + number(length) + " along axis " +
                            std::to_string(a),
                        "direction");
    }
    const double volume = std::abs(determinant(d));
    if (!(volume >= kMinVolume))
        throw Error(Errc::Unsupported,
                    where +
                        ": direction: expected axes that span the space, got nearly parallel or coplanar ones "
                        "(their parallelepiped has " +
                        number(volume) + " of a cube's volume, expected at least " + number(kMinVolume) +
                        "); resample the image, for example with SimpleITK's Resample()",
                    "direction");
}

}  // namespace

void check_geometry(const std::string& where, const ImageGeometry& g) {
    const auto refuse = [&](const char* what, const std::string& expected, double got, int axis, const char* advice) {
        throw Error(Errc::InvalidInput,
                    where + ": " + what + ": expected " + expected + ", got " + number(got) + " along axis " +
                        std::to_string(axis) + "; " + advice,
                    what);
    };
    double finest = kLargestLength;
    for (int a = 0; a < 3; ++a) {
        if (!(g.spacing[a] >= kMinLength && g.spacing[a] * g.size[a] <= kLargestLength))
            refuse("spacing",
                   "from " + number(kMinLength) + ", with " + std::to_string(g.size[a]) + " voxels up to " +
                       number(kLargestLength / g.size[a]),
                   g.spacing[a], a, "state it in another unit (`spacing`)");
        finest = std::min(finest, g.spacing[a]);
    }
    const double farthest = farthest_origin(finest);
    for (int a = 0; a < 3; ++a)
        if (!(std::abs(g.origin[a]) <= farthest))
            refuse("origin", "within " + number(farthest) + " of 0", g.origin[a], a,
                   "farther away, neighbouring voxels cannot be distinguished reliably: move the image");
    check_direction(where, g);
}

}  // namespace covol::detail
