#include "image/to_world.h"

#include "covol/error.h"

namespace covol {

Vec3 detail::to_world(PointSpace space, const Vec3& p, const ImageGeometry& geometry) {
    const Vec3& h = geometry.spacing;
    switch (space) {
        case PointSpace::Index: return geometry.index_to_world(p);
        case PointSpace::Local: return geometry.index_to_world({p[0] / h[0], p[1] / h[1], p[2] / h[2]});
        case PointSpace::Slices: return geometry.index_to_world({p[0] / h[0], p[1] / h[1], p[2]});
        default: return p;
    }
}

std::vector<Vec3> to_world(const PointCloud& cloud) {
    if (cloud.space != PointSpace::World)
        throw Error(Errc::InvalidInput,
                    "to_world: " + cloud.source +
                        ": the points are in an image's own frame, and there is no image; give "
                        "one, or `points_space = world` for points in lengths",
                    "points_space");
    return cloud.points;
}

std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry& geometry) {
    if (cloud.space == PointSpace::World) return cloud.points;
    std::vector<Vec3> world;
    world.reserve(cloud.points.size());
    for (const Vec3& p : cloud.points) world.push_back(detail::to_world(cloud.space, p, geometry));
    return world;
}

}  // namespace covol
