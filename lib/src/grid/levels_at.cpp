#include "grid/levels_at.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace covol::detail {

std::vector<double> levels_at(const FloatGrid& u, std::span<const Vec3> places) {
    std::vector<double> levels(places.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 256), [&](const auto& range) {
        const auto accessor = u.getConstAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            levels[n] = openvdb::tools::BoxSampler::sample(
                accessor, u.worldToIndex(openvdb::Vec3d(places[n][0], places[n][1], places[n][2])));
    });
    return levels;
}

}  // namespace covol::detail
