#include "covol/intensity.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "covol/surface.h"

namespace covol {
namespace {

/// The box of the image's held voxels that the surface may enclose; none if there is no such voxel.
std::optional<VoxelBox> voxels_within(const Image& image, const FloatGrid& surface) {
    const openvdb::CoordBBox active = surface.evalActiveVoxelBoundingBox();
    if (active.empty()) return {};
    Vec3 low{}, high{};
    for (int corner = 0; corner < 8; ++corner) {
        openvdb::Vec3d at;
        for (int a = 0; a < 3; ++a) at[a] = (corner >> a & 1) != 0 ? active.max()[a] : active.min()[a];
        const openvdb::Vec3d world = surface.indexToWorld(at);
        const Vec3 index = image.geometry().world_to_index({world[0], world[1], world[2]});
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = corner == 0 ? index[a] : std::min(low[a], index[a]);
            high[a] = corner == 0 ? index[a] : std::max(high[a], index[a]);
        }
    }
    const VoxelBox& held = image.held();
    VoxelBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        box.min[a] = int(std::clamp(std::floor(low[a]), double(held.min[a]), held.max[a] + 1.0));
        box.max[a] = int(std::clamp(std::ceil(high[a]), held.min[a] - 1.0, double(held.max[a])));
        if (box.max[a] < box.min[a]) return {};
    }
    return box;
}

}  // namespace

double count_voxels_around(const Image& image, const FloatGrid& surface) {
    const std::optional<VoxelBox> box = voxels_within(image, surface);
    if (!box) return 0;
    const Index3 size = box->size();
    return double(size[0]) * size[1] * size[2];
}

IntensityStatistics measure_intensity(const Image& image, const FloatGrid& surface, const RunContext& run) {
    IntensityStatistics result;
    const std::optional<VoxelBox> all = voxels_within(image, surface);
    if (!all) return result;
    // Only a few slices are read at a time, so that the whole image is never in memory. Sums are taken relative to the
    // first value to avoid cancellation.
    const double slice = double(all->size()[0]) * all->size()[1];
    const int layers = std::max(1, int(std::min(double(all->size()[2]), double(1 << 22) / slice)));
    double shift = 0, sum = 0, squares = 0;
    std::vector<float> values;
    for (int k = all->min[2]; k <= all->max[2]; k += layers) {
        run.check();
        VoxelBox box = *all;
        box.min[2] = k;
        box.max[2] = std::min(k + layers - 1, all->max[2]);
        image.load(box, run);
        const std::vector<std::uint8_t> inside = rasterize(surface, cropped(image.geometry(), box), 1, run);
        values.resize(inside.size());
        image.copy(box, values.data());
        for (std::size_t n = 0; n < inside.size(); ++n) {
            if (inside[n] == 0) continue;
            if (result.voxels++ == 0) shift = values[n];
            const double off = values[n] - shift;
            sum += off;
            squares += off * off;
        }
    }
    if (result.voxels == 0) return result;
    const double count = double(result.voxels);
    result.mean = shift + sum / count;
    result.standard_deviation = std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
    return result;
}

}  // namespace covol
