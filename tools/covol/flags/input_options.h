#pragma once
#include <cstddef>

#include "covol/options_table.h"

namespace covol::tool {

/// Options of the program and of the Python module that the library does not have.
struct InputOptions {
    std::size_t max_points = 2500000;  ///< maximum number of points of a cloud without an image; 0: all
    int guess_label = 0;               ///< label to correct in a mask with several labels; 0: the only label
};

}  // namespace covol::tool

template <>
inline constexpr auto covol::kOptions<covol::tool::InputOptions> = std::tuple{
    Option{"most_points", &tool::InputOptions::max_points, kNotNegative, points_alone(Group::Clouds),
           "maximum number of points that are used; larger clouds are thinned evenly over the surface; 0: all"},
    Option{"guess_label", &tool::InputOptions::guess_label, kNotNegative, with_image(Group::ReadingMarks),
           "label to correct in a mask with several labels; the other labels stay unchanged", "the only label"}};
