#include "clip/open_ends.h"

#include <algorithm>

#include "clip/half_spaces.h"

namespace covol::detail {

double ImageFace::depth(const Vec3& x) const { return -along(plane, x); }

std::vector<ImageFace> faces_of(const ImageGeometry& geometry) {
    const Clip clip = make_clip(geometry);  // two half-spaces for each axis
    std::vector<ImageFace> faces;
    for (std::size_t n = 0; n < clip.size(); ++n) faces.push_back({clip[n], geometry.spacing[n / 2]});
    return faces;
}

bool on_end_slice(const ImageFace& face, const Vec3& x) {
    const double depth = face.depth(x);
    return depth >= 0 && depth <= face.spacing;
}

std::vector<Vec3> carried_on(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces, double length) {
    std::vector<Vec3> beyond;
    for (const ImageFace& face : faces)
        for (const Vec3& p : points)
            if (on_end_slice(face, p))
                for (double by = face.spacing; by < length + face.spacing; by += face.spacing)
                    beyond.push_back(moved(p, face.plane.normal, by));
    return beyond;
}

std::vector<Vec3> mirrored(const std::vector<Vec3>& points, const std::vector<ImageFace>& faces, double reach) {
    // Mirror images in earlier faces are also mirrored: a body at an edge of the box, between two faces, has three
    // mirror images.
    std::vector<Vec3> all = points;
    for (const ImageFace& face : faces) {
        if (std::none_of(points.begin(), points.end(), [&](const Vec3& p) { return face.depth(p) < reach; })) continue;
        const std::size_t before = all.size();
        for (std::size_t n = 0; n < before; ++n)
            all.push_back(moved(all[n], face.plane.normal, 2 * face.depth(all[n])));
    }
    return {all.begin() + std::ptrdiff_t(points.size()), all.end()};
}

}  // namespace covol::detail
