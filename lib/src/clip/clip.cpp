#include "covol/clip.h"

#include <openvdb/openvdb.h>

#include <cmath>
#include <string>

#include "base/matrix.h"

namespace covol {
namespace {

std::string clip_key(std::size_t n) { return "covol_clip_" + std::to_string(n); }

}  // namespace

Clip make_clip(const WorldBox& box) {
    Clip clip;
    for (int a = 0; a < 3; ++a) {
        Vec3 up{0, 0, 0}, down{0, 0, 0};
        up[a] = 1;
        down[a] = -1;
        clip.push_back({down, -box.min[a]});
        clip.push_back({up, box.max[a]});
    }
    return clip;
}

Clip make_clip(const ImageGeometry& geometry) {
    if (geometry.is_axis_aligned()) return make_clip(geometry.world_box());
    // If the axes are sheared, the normals of the faces are not parallel to them; they are the rows of the inverse
    // matrix.
    const Matrix3 normals = detail::inverse(geometry.direction);
    Clip clip;
    for (int a = 0; a < 3; ++a) {
        const double length = std::hypot(normals[a][0], normals[a][1], normals[a][2]);
        for (const double side : {-1.0, 1.0}) {
            Vec3 index{0, 0, 0};
            index[a] = side < 0 ? -0.5 : geometry.size[a] - 0.5;
            const Vec3 at = geometry.index_to_world(index);
            HalfSpace plane;
            for (int b = 0; b < 3; ++b) {
                plane.normal[b] = side * normals[a][b] / length;
                plane.offset += plane.normal[b] * at[b];
            }
            clip.push_back(plane);
        }
    }
    return clip;
}

void set_clip(FloatGrid& grid, const Clip& clip) {
    for (std::size_t n = 0; grid[clip_key(n)]; ++n) grid.removeMeta(clip_key(n));
    for (std::size_t n = 0; n < clip.size(); ++n) {
        const Vec3& v = clip[n].normal;
        grid.insertMeta(clip_key(n), openvdb::Vec4DMetadata(openvdb::Vec4d(v[0], v[1], v[2], clip[n].offset)));
    }
}

Clip clip_of(const FloatGrid& grid) {
    Clip clip;
    for (;;) {
        const auto plane = grid.getMetadata<openvdb::Vec4DMetadata>(clip_key(clip.size()));
        if (!plane) return clip;
        const openvdb::Vec4d& v = plane->value();
        clip.push_back({{v[0], v[1], v[2]}, v[3]});
    }
}

}  // namespace covol
