#include <openvdb/openvdb.h>

#include <cmath>
#include <optional>
#include <sstream>

#include "clip/clipped.h"
#include "covol/error.h"
#include "covol/surface.h"
#include "surface/marching_cubes.h"

namespace covol {

TriangleMesh extract_mesh(const FloatGrid& surface, const ExtractOptions& options, const RunContext& run) {
    TriangleMesh mesh;
    require_valid(options, "extract_mesh");
    with_threads(run, [&] {
        std::optional<detail::Uncut> whole;
        if (options.isovalue == 0) whole = detail::uncut(surface, detail::FaceLayer::OnFace);
        mesh = whole ? detail::MarchingCubes(*whole->distance, whole->clip, 0, run).extract()
                     : detail::MarchingCubes(surface, {}, options.isovalue, run).extract();
    });
    if (options.min_component_volume > 0 && !mesh.empty()) {
        const double whole = std::abs(measure(mesh).volume);
        remove_small_components(mesh, options.min_component_volume);
        if (mesh.empty()) {
            std::ostringstream text;
            text << "every piece of the surface has a volume below " << options.min_component_volume
                 << "; the whole surface has " << whole << ", as a cube of edge " << std::cbrt(whole)
                 << "; use a smaller `min_component`";
            throw Error(Errc::InvalidInput, text.str(), "min_component");
        }
    }
    return mesh;
}

}  // namespace covol
