#include "detail/dense_volume.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace covol::detail {
namespace {

/// One line: the lower envelope of the parabolas (x - i)^2 + f[i], evaluated at each i.
struct Line {
    explicit Line(int n) : f(n), apex(n), from(n) {}

    void transform() {
        const int n = int(f.size());
        int last = -1;
        for (int i = 0; i < n; ++i) {
            if (f[i] >= kNowhere) continue;
            double start = -1e30;
            while (last >= 0) {
                const int other = apex[last];
                start = (double(f[i]) + double(i) * i - double(f[other]) - double(other) * other) / (2.0 * (i - other));
                if (start > from[last]) break;
                --last;
            }
            if (last < 0) start = -1e30;
            apex[++last] = i;
            from[last] = start;
        }
        if (last < 0) return;
        result.resize(f.size());
        for (int i = 0, piece = 0; i < n; ++i) {
            while (piece < last && from[piece + 1] < i) ++piece;
            const double way = i - apex[piece];
            result[i] = static_cast<float>(way * way + double(f[apex[piece]]));
        }
        f.swap(result);
    }

    std::vector<float> f, result;
    std::vector<int> apex;
    std::vector<double> from;
};

}  // namespace

DenseVolume<float> squared_distance(const DenseMask& mask, bool value) {
    DenseVolume<float> d(mask.size, kNowhere);
    for (std::size_t n = 0; n < mask.values.size(); ++n)
        if ((mask.values[n] != 0) == value) d.values[n] = 0.0F;
    const std::size_t step[3] = {std::size_t(mask.size[1]) * std::size_t(mask.size[2]), std::size_t(mask.size[2]), 1};
    for (int a = 0; a < 3; ++a) {
        const int b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
        tbb::parallel_for(0, mask.size[b], [&](int j) {
            Line line(mask.size[a]);
            for (int k = 0; k < mask.size[c]; ++k) {
                float* begin = d.values.data() + std::size_t(j) * step[b] + std::size_t(k) * step[c];
                for (int i = 0; i < mask.size[a]; ++i) line.f[i] = begin[std::size_t(i) * step[a]];
                line.transform();
                for (int i = 0; i < mask.size[a]; ++i) begin[std::size_t(i) * step[a]] = line.f[i];
            }
        });
    }
    return d;
}

}  // namespace covol::detail
