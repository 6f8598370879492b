#include "covol/surface.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "clip/clipped.h"
#include "covol/clip.h"
#include "covol/error.h"
#include "grid/leaf_band.h"
#include "redistance/redistance.h"

namespace covol {
namespace {

using detail::kLeafDim;
using openvdb::Coord;

/// Asks, voxel by voxel along a row of an image, whether a level set is negative there.
class RowSampler {
public:
    explicit RowSampler(const FloatGrid& grid)
        : accessor_(grid.getConstAccessor()), certain_(1.8F * static_cast<float>(grid.voxelSize()[0])) {}

    /// Sets out[n] to the label for the positions from + n * step (index space), n < count, that are inside.
    void fill(const openvdb::Vec3d& from, const openvdb::Vec3d& step, int count, std::uint8_t label,
              std::uint8_t* out) {
        for (int n = 0; n < count;) {
            const openvdb::Vec3d at = from + double(n) * step;
            const Coord base = Coord::floor(at);
            int run = 1;
            float value = 0;
            if (const auto* leaf = accessor_.probeConstLeaf(base)) {
                value = leaf->getValue(base);
            } else {
                value = accessor_.getValue(base);
                run = std::min(count - n, steps_inside_block(at, base, step));
            }
            // Within a cell a distance changes by less than sqrt(3) voxels.
            if (std::abs(value) < certain_) {
                run = 1;
                value = interpolate(at, base);
            }
            if (value < 0) std::fill_n(out + n, run, label);
            n += run;
        }
    }

private:
    /// How many positions from `at` on lie in the tile-sized block of 8^3 around `base`, at least 1.
    static int steps_inside_block(const openvdb::Vec3d& at, const Coord& base, const openvdb::Vec3d& step) {
        double steps = std::numeric_limits<std::int32_t>::max();
        for (int a = 0; a < 3; ++a) {
            const int low = base[a] & ~(kLeafDim - 1);
            // A margin keeps rounding from taking a position of the next block along.
            if (step[a] > 1e-12) steps = std::min(steps, (low + kLeafDim - 1e-6 - at[a]) / step[a]);
            if (step[a] < -1e-12) steps = std::min(steps, (low + 1e-6 - at[a]) / step[a]);
        }
        return steps > 0 ? 1 + static_cast<int>(steps) : 1;
    }

    float interpolate(const openvdb::Vec3d& at, const Coord& base) {
        const float x = static_cast<float>(at[0] - base[0]), y = static_cast<float>(at[1] - base[1]),
                    z = static_cast<float>(at[2] - base[2]);
        const auto along_z = [&](int i, int j) {
            const float a = accessor_.getValue(base.offsetBy(i, j, 0)), b = accessor_.getValue(base.offsetBy(i, j, 1));
            return a + z * (b - a);
        };
        const auto along_y = [&](int i) {
            const float a = along_z(i, 0);
            return a + y * (along_z(i, 1) - a);
        };
        const float a = along_y(0);
        return a + x * (along_y(1) - a);
    }

    FloatGrid::ConstAccessor accessor_;
    float certain_;
};

/// Every corner of the lattice's box, half a voxel beyond the last centres, lies in the clip.
bool lies_within(const ImageGeometry& geometry, const Clip& clip) {
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index;
        for (int a = 0; a < 3; ++a) index[a] = (corner >> a & 1) != 0 ? geometry.size[a] - 1.0 : 0.0;
        if (detail::depth_in(clip, geometry.index_to_world(index)) > 0) return false;
    }
    return true;
}

/// The solid in the clip. Its wall ends at the domain's last voxels; a solid without one fills the domain.
FloatGridPtr clipped_surface(const FloatGrid& u, const Domain& domain, const Clip& clip, const RunContext& run) {
    const std::optional<detail::Uncut> whole = detail::uncut(u, detail::FaceLayer::InPlace);
    // What is near the cut may be nearest to what the wall would be beyond it.
    const Domain wide = whole ? widened(domain, detail::kCarriedOn - 1) : domain;
    FloatGridPtr wall;
    try {
        wall = detail::redistance(whole ? *whole->distance : u, wide, kHalfWidthVoxels, detail::DomainEnd::Open,
                                  "surface", run);
    } catch (const Error& error) {
        const openvdb::CoordBBox all({wide.min[0], wide.min[1], wide.min[2]}, {wide.max[0], wide.max[1], wide.max[2]});
        if (error.code() != Errc::InvalidInput ||
            !(u.tree().getValue({domain.min[0], domain.min[1], domain.min[2]}) < 0))
            throw;
        const auto width = static_cast<float>(kHalfWidthVoxels * domain.voxel_size);
        wall = make_grid(wide, width, "surface");
        wall->fill(all, -width, false);
        wall->setGridClass(openvdb::GRID_LEVEL_SET);
    }
    FloatGridPtr solid = detail::clipped(wall, wide, clip);
    set_domain(*solid, domain);
    return solid;
}

}  // namespace

FloatGridPtr extract_surface(const FloatGrid& u, const RunContext& run) {
    const Domain domain = domain_of(u);
    FloatGridPtr result;
    const Clip clip = clip_of(u);
    with_threads(run, [&] {
        result = clip.empty()
                     ? detail::redistance(u, domain, kHalfWidthVoxels, detail::DomainEnd::Closed, "surface", run)
                     : clipped_surface(u, domain, clip, run);
    });
    return result;
}

FloatGridPtr to_fog_volume(const FloatGrid& surface) {
    FloatGridPtr fog = surface.deepCopy();
    openvdb::tools::sdfToFogVolume(*fog);
    fog->setName("density");
    return fog;
}

std::vector<std::uint8_t> rasterize(const FloatGrid& surface, const ImageGeometry& geometry, std::uint8_t label,
                                    const RunContext& run) {
    const Domain domain = domain_of(surface);
    const auto to_index = [&](double i, double j, double k) {
        const Vec3 at = domain.world_to_index(geometry.index_to_world({i, j, k}));
        return openvdb::Vec3d(at[0], at[1], at[2]);
    };
    const auto [ni, nj, nk] = geometry.size;
    const openvdb::Vec3d step = to_index(1, 0, 0) - to_index(0, 0, 0);
    std::vector<std::uint8_t> labels(std::size_t(ni) * std::size_t(nj) * std::size_t(nk), 0);
    with_threads(run, [&, ni = ni, nj = nj, nk = nk] {
        const std::optional<detail::Uncut> whole = detail::uncut(surface, detail::FaceLayer::InPlace);
        const Clip clip = whole ? clip_of(surface) : Clip{};
        const bool all_within = lies_within(geometry, clip);
        tbb::parallel_for(0, nk, [&](int k) {
            RowSampler sampler(whole ? *whole->distance : surface);
            for (int j = 0; j < nj; ++j) {
                std::uint8_t* row = labels.data() + (std::size_t(k) * nj + j) * ni;
                sampler.fill(to_index(0, j, k), step, ni, label, row);
                for (int i = 0; i < ni && !all_within; ++i)
                    if (row[i] != 0 &&
                        detail::depth_in(clip, geometry.index_to_world({double(i), double(j), double(k)})) > 0)
                        row[i] = 0;
            }
        });
    });
    return labels;
}

}  // namespace covol
