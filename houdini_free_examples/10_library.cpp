// The library's steps, one by one: image and points in, level set, mesh and label image out.
//
//     10_library IMAGE POINTS OUT_PREFIX        writes OUT_PREFIX.vdb, OUT_PREFIX.ply and OUT_PREFIX.nrrd
//
// `covol segment` and covol::segment() do the same more thoroughly; this example shows the steps.
#include <algorithm>
#include <cstdio>
#include <string>

#include "covol/band.h"
#include "covol/distance.h"
#include "covol/edge.h"
#include "covol/error.h"
#include "covol/evolve.h"
#include "covol/image.h"
#include "covol/mesh_io.h"
#include "covol/points.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: 10_library IMAGE POINTS OUT_PREFIX\n");
        return 2;
    }
    try {
        // Read the files. Points are converted to world positions. If points are outside of the image, check_inside()
        // throws an error that suggests a remedy.
        const covol::Image image = covol::read_image(argv[1]);
        const covol::PointCloud cloud = covol::read_points(argv[2]);
        covol::check_inside(cloud, image.geometry());
        std::vector<covol::Vec3> points = covol::to_world(cloud, image.geometry());

        // The domain: isotropic voxels over the image's box. All grids below use its transform.
        const auto& spacing = image.geometry().spacing;
        const double h = *std::min_element(spacing.begin(), spacing.end());
        const covol::Domain domain = covol::make_domain(image.geometry().world_box(), h);
        points = covol::merge_close_points(points, h / 4);

        // 1. Distance to the points, in a tube around them. D, the tag distance, is chosen so that gaps between points
        // that are narrower than 2 D are closed.
        const covol::TagDistanceChoice choice = covol::choose_tag_distance(points, domain, {});
        const double D = choice.tag_distance;
        const covol::DistanceResult d = covol::compute_distance(points, domain, {D + 5 * h});
        std::printf("D = %g (%s)\n", D, choice.reason.c_str());

        // 2. Tagging: voxels that a flood fill from outside cannot reach through {d > D} are inside. The level set u
        // starts as a clamped signed distance.
        covol::BandResult tagged = covol::tag_interior(*d.grid, {D, {}});
        if (tagged.report.leaks)
            std::printf("the points leave gaps; D = %g would hold\n", tagged.report.holding_distance);

        // 3. The edge detector g of the image, computed only within the narrow band.
        const covol::EdgeResult g = covol::detect_edges(image, *tagged.grid);

        // 4. The flow: points, image edges and curvature move u until it is steady.
        covol::FloatGridPtr u = tagged.grid;
        covol::EvolveFields fields;
        fields.distance = d.grid.get();
        fields.edge = g.grid.get();
        const covol::EvolveReport solved = covol::evolve(*u, fields);
        std::printf("%d steps, %s\n", solved.steps, covol::to_string(solved.stop_reason));

        // 5. The zero level of u as a true signed distance, and the mesh and label image made from it.
        const covol::FloatGridPtr surface = covol::extract_surface(*u);
        const covol::TriangleMesh mesh = covol::extract_mesh(*surface);
        const covol::MeshMeasures measures = covol::measure(mesh);
        std::printf("volume %g, area %g, genus %d\n", measures.volume, measures.area, measures.genus);

        const std::string prefix = argv[3];
        covol::write_vdb(prefix + ".vdb", {surface});
        covol::write_mesh(prefix + ".ply", mesh);
        covol::write_image(prefix + ".nrrd", image.geometry(), covol::rasterize(*surface, image.geometry()).data());
        return 0;
    } catch (const covol::Error& error) {
        std::fprintf(stderr, "10_library: %s\n", error.what());
        return 1;
    }
}
