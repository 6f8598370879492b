#include "image/to_world.h"

#include "covol/error.h"
#include "io/pixels/raw_image.h"

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
                    cloud.source +
                        ": the points refer to the frame of an image, but there is no image; give "
                        "one, or set `points_space = world` if they are lengths",
                    "points_space");
    return cloud.points;
}

double detail::unit_factor(const PointCloud& cloud, const ImageGeometry& geometry) {
    const double own = unit_in_metres(cloud.unit), other = unit_in_metres(geometry.unit);
    return own > 0 && other > 0 && cloud.unit != geometry.unit ? own / other : 1;
}

Vec3 detail::scaled(PointSpace space, const Vec3& p, double factor) {
    if (space == PointSpace::Index) return p;
    return {p[0] * factor, p[1] * factor, space == PointSpace::Slices ? p[2] : p[2] * factor};
}

std::vector<Vec3> to_world(const PointCloud& cloud, const ImageGeometry& geometry) {
    const double factor = detail::unit_factor(cloud, geometry);
    if (cloud.space == PointSpace::World && factor == 1) return cloud.points;
    std::vector<Vec3> world;
    world.reserve(cloud.points.size());
    for (const Vec3& p : cloud.points)
        world.push_back(detail::to_world(cloud.space, detail::scaled(cloud.space, p, factor), geometry));
    return world;
}

}  // namespace covol
