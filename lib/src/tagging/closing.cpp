// Morphological closing of a tagged body: the exterior, grown back by the tag distance.
#include <openvdb/openvdb.h>

#include <algorithm>

#include "covol/band.h"
#include "covol/distance.h"
#include "covol/error.h"
#include "grid/flood_tiles.h"
#include "redistance/redistance.h"
#include "tagging/heuristics.h"

namespace covol {

FloatGridPtr close_by_ball(const FloatGrid& band, double tag_distance, const RunContext& run) {
    const Domain domain = domain_of(band);
    const double h = domain.voxel_size, reach = kClosing.reach_voxels * h;
    const detail::InterfacePatches tagged = detail::find_interface(band, domain, detail::DomainEnd::Open, run);
    if (tagged.patches.empty()) return nullptr;
    std::vector<Vec3> surface(tagged.patches.size());
    for (std::size_t n = 0; n < surface.size(); ++n) {
        const detail::Patch& p = tagged.patches[n];
        surface[n] = domain.index_to_world(
            {p.origin[0] + double(p.center[0]), p.origin[1] + double(p.center[1]), p.origin[2] + double(p.center[2])});
    }
    // Inside the tagged body D - d is the signed distance to the closing; outside it anything positive will do.
    const FloatGridPtr grown = compute_distance(surface, domain, {tag_distance + reach}, run).grid;
    const auto D = static_cast<float>(tag_distance);
    const auto inside = band.getConstAccessor();
    bool any = false;
    for (auto leaf = grown->tree().beginLeaf(); leaf; ++leaf)
        for (auto v = leaf->beginValueAll(); v; ++v) {
            const float value = inside.getValue(v.getCoord()) < 0.0F ? D - *v : D;
            any |= value < 0.0F;
            v.setValue(std::min(value, static_cast<float>(reach)));
        }
    if (!any) return nullptr;
    grown->tree().root().setBackground(static_cast<float>(reach), false);
    detail::flood_tiles(*grown, domain);
    FloatGridPtr closed;
    with_threads(run, [&] {
        closed = detail::redistance(*grown, domain, kClosing.half_width, detail::DomainEnd::Open, "band", run);
    });
    return closed;
}

}  // namespace covol
