#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/options_table.h"

namespace covol {

/// A test shape whose true surface is known.
struct PhantomOptions {
    std::string kind = "sphere";  ///< sphere, torus, box, two-spheres, sphere-round, sphere-square, sphere-slit
    int size = 128;               ///< voxels along each axis, >= 16
    int point_count = 3000;  ///< number of points on the true surface; for the spheres with holes, in the holes only
    double noise = 0.0;      ///< standard deviation of additive Gaussian noise, relative to the contrast of 255
    std::uint64_t seed = 1;
};
struct Phantom {
    Image image;  ///< uint8, from 0 (dark) to 255 (bright)
    std::vector<Vec3> points;
    std::vector<std::uint8_t> labels;  ///< voxels of the solid, on the image's lattice, i fastest
};
[[nodiscard]] COVOL_API Phantom make_phantom(const PhantomOptions& options);
[[nodiscard]] COVOL_API std::vector<std::string> list_phantom_kinds();

template <>
inline constexpr auto kOptions<PhantomOptions> = std::tuple{
    Option{"size", &PhantomOptions::size, between(16, 2048), Group::Input, "voxels along each axis"},
    Option{"count", &PhantomOptions::point_count, kNotNegative, Group::Input, "number of points"},
    Option{"noise", &PhantomOptions::noise, kNotNegative, Group::Input, "standard deviation, in units of the contrast"},
    Option{"seed", &PhantomOptions::seed, Range{}, Group::Input, "seed of the random numbers"},
    Rule<PhantomOptions>{"kind", "one of list_phantom_kinds()",
                         [](const PhantomOptions& o) { return std::ranges::count(list_phantom_kinds(), o.kind) > 0; }}};

}  // namespace covol
