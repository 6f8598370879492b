#include "grid/levels_at.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace covol::detail {
namespace {

double sample(const FloatGrid::ConstAccessor& accessor, const FloatGrid& u, const Vec3& place) {
    return double(
        openvdb::tools::BoxSampler::sample(accessor, u.worldToIndex(openvdb::Vec3d(place[0], place[1], place[2]))));
}

}  // namespace

double level_at(const FloatGrid& u, const Vec3& place) { return sample(u.getConstAccessor(), u, place); }

std::vector<double> levels_at(const FloatGrid& u, std::span<const Vec3> places) {
    std::vector<double> levels(places.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 256), [&](const auto& range) {
        const auto accessor = u.getConstAccessor();
        for (std::size_t n = range.begin(); n != range.end(); ++n) levels[n] = sample(accessor, u, places[n]);
    });
    return levels;
}

}  // namespace covol::detail
