// Uses only the public headers of covol: makes a start from a sphere, extracts its surface and its mesh, and measures
// the mesh; and catches an exception that the library throws.
#include <cmath>
#include <cstdio>
#include <string>

#include "covol/compare.h"
#include "covol/distance.h"
#include "covol/edge.h"
#include "covol/error.h"
#include "covol/mesh_cleanup.h"
#include "covol/mesh_io.h"
#include "covol/phantom.h"
#include "covol/pipeline.h"
#include "covol/render.h"
#include "covol/start.h"
#include "covol/vdb_io.h"
#include "covol/version.h"

namespace {

bool catches_errors() {
    try {
        (void)covol::read_image("no_such_image.tif");
    } catch (const covol::Error& error) {
        return error.code() == covol::Errc::Io;
    }
    return false;
}

}  // namespace

int main() {
    if (covol::version() != std::string(COVOL_VERSION_STRING) || !catches_errors()) return 2;
    const covol::Domain domain = covol::make_domain({{-2, -2, -2}, {2, 2, 2}}, 0.1);
    const covol::FloatGridPtr start = covol::start_from_sphere(domain, {0, 0, 0}, 1.0);
    const covol::TriangleMesh mesh = covol::extract_mesh(*covol::extract_surface(*start));
    const covol::MeshMeasures measures = covol::measure(mesh);
    const double expected = 4.0 / 3.0 * std::acos(-1.0);
    std::printf("volume %.4f of %.4f, %s\n", measures.volume, expected, measures.closed ? "closed" : "open");
    return measures.closed && std::abs(measures.volume / expected - 1) < 0.02 ? 0 : 1;
}
