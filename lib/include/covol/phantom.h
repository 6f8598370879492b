#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"

namespace covol {

/// A test shape with known truth.
struct PhantomOptions {
    std::string kind = "sphere";  ///< sphere, torus, box, two-spheres, sphere-round, sphere-square, sphere-slit
    int size = 128;               ///< voxels along each axis, >= 16
    int point_count = 3000;       ///< points on the true surface (in the holes, for the spheres with holes)
    double noise = 0.0;           ///< standard deviation of additive Gaussian noise, in units of the contrast
    std::uint64_t seed = 1;
    [[nodiscard]] COVOL_API std::string why_invalid() const;
};
struct Phantom {
    Image image;  ///< uint8, contrast 0..255
    std::vector<Vec3> points;
    std::vector<std::uint8_t> labels;  ///< the solid, in the image's lattice, i fastest
};
[[nodiscard]] COVOL_API Phantom make_phantom(const PhantomOptions& options);
[[nodiscard]] COVOL_API std::vector<std::string> list_phantom_kinds();

}  // namespace covol
