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
#include "surface/rasterizer.h"

namespace covol {
namespace {

/// The part of a solid that lies in the clip. The solid's own surface ends at the domain's last voxels; if there is
/// none, the solid fills the domain.
FloatGridPtr clipped_surface(const FloatGrid& u, const Domain& domain, const Clip& clip, const RunContext& run) {
    const std::optional<detail::Uncut> whole = detail::uncut(u, detail::FaceLayer::InPlace);
    // Near the cut, the nearest point of the uncut solid's surface may lie beyond the cut, so a wider domain is used.
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
    const auto [ni, nj, nk] = geometry.size;
    std::vector<std::uint8_t> labels(std::size_t(ni) * std::size_t(nj) * std::size_t(nk), 0);
    with_threads(run, [&, ni = ni, nj = nj, nk = nk] {
        const detail::Rasterizer rasterizer(surface, geometry);
        tbb::parallel_for(0, nk, [&](int k) {
            rasterizer.fill({{0, 0, k}, {ni - 1, nj - 1, k}}, label, labels.data() + std::size_t(k) * nj * ni);
        });
    });
    return labels;
}

}  // namespace covol
