#pragma once
#include <cmath>
#include <vector>

#include "covol/image.h"

// A small image in an oblique frame, whose voxels all have different values.
namespace covol::test {

inline ImageGeometry oblique() {
    ImageGeometry g;
    g.size = {7, 6, 5};
    g.spacing = {0.5, 0.75, 2.0};
    g.origin = {10, -20, 30};
    const double c = std::cos(0.3), s = std::sin(0.3);
    g.direction = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
    return g;
}

template <typename T>
std::vector<T> ramp(const ImageGeometry& g) {
    std::vector<T> values;
    for (int k = 0; k < g.size[2]; ++k)
        for (int j = 0; j < g.size[1]; ++j)
            for (int i = 0; i < g.size[0]; ++i) values.push_back(static_cast<T>(i + 10 * j + 40 * k));
    return values;
}

}  // namespace covol::test
