#include "flags/one_label.h"

#include <cstdint>
#include <vector>

namespace covol::tool {

Image only(const Image& labels, int label) {
    const auto [ni, nj, nk] = labels.geometry().size;
    std::vector<std::uint8_t> values;
    values.reserve(std::size_t(ni) * std::size_t(nj) * std::size_t(nk));
    for (int k = 0; k < nk; ++k)
        for (int j = 0; j < nj; ++j)
            for (int i = 0; i < ni; ++i) values.push_back(labels.at(i, j, k) == label ? 1 : 0);
    return Image::from_values(labels.geometry(), values.data());
}

}  // namespace covol::tool
