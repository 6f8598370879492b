#pragma once
#include <cstddef>

#include "covol/options_table.h"

namespace covol::tool {

/// Of the programs, beside those of the library.
struct InputOptions {
    std::size_t max_points = 2500000;  ///< of a cloud without an image; 0: all
    int guess_label = 0;               ///< of a mask with several labels the one to correct; 0: there is only one
};

}  // namespace covol::tool

template <>
inline constexpr auto covol::kOptions<covol::tool::InputOptions> =
    std::tuple{Option{"most_points", &tool::InputOptions::max_points, kNotNegative, points_alone(Group::Clouds),
                      "of larger clouds so many points are used, evenly spread over the surface; 0: all"},
               Option{"guess_label", &tool::InputOptions::guess_label, kNotNegative, with_image(Group::ReadingMarks),
                      "of a mask with several labels the one to correct; the others stay", "the only one"}};
