#include "flags/world_points.h"

#include <cmath>

namespace covol::tool {
namespace {

/// Of the points that `all` ends with. Lists are made once a file has something for them.
void add_hints(const PointCloud& cloud, const std::vector<Vec3>& world, WorldPoints& all) {
    const std::size_t before = all.points.size() - world.size();
    std::vector<Vec3>& normals = all.hints.normals;
    std::vector<Vec3>& to_sensor = all.hints.to_sensor;
    if (!cloud.normals.empty()) {
        normals.resize(before);
        normals.insert(normals.end(), cloud.normals.begin(), cloud.normals.end());
    }
    if (cloud.sensor) {
        to_sensor.resize(before);
        for (const Vec3& p : world) {
            const Vec3 d{(*cloud.sensor)[0] - p[0], (*cloud.sensor)[1] - p[1], (*cloud.sensor)[2] - p[2]};
            const double length = std::hypot(d[0], d[1], d[2]);
            to_sensor.push_back(length > 0 ? Vec3{d[0] / length, d[1] / length, d[2] / length} : Vec3{0, 0, 0});
        }
    }
    for (std::vector<Vec3>* list : {&normals, &to_sensor})
        if (!list->empty()) list->resize(all.points.size());
}

}  // namespace

void add_cloud(const PointCloud& cloud, const ImageGeometry* geometry, WorldPoints& all, const RunContext& run) {
    const std::vector<Vec3> world = geometry != nullptr ? to_world(cloud, *geometry) : to_world(cloud);
    if (geometry != nullptr) check_inside(cloud, *geometry, run);
    all.points.insert(all.points.end(), world.begin(), world.end());
    add_hints(cloud, world, all);
    all.rules.push_back(cloud.rule);
}

}  // namespace covol::tool
