#include "covol/domain.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "covol/error.h"

namespace covol {
namespace {

constexpr const char* kMinKey = "covol_domain_min";
constexpr const char* kMaxKey = "covol_domain_max";
constexpr double kMaxVoxelsPerAxis = 1 << 30;
// Maximum index of a voxel: the keys by which leaves are sorted cover this many voxels on either side of voxel 0.
constexpr double kFarthestVoxel = 1 << 23;
constexpr double kAnchorVoxels = 1 << 22;

std::string to_text(const WorldBox& b) {
    std::ostringstream s;
    s << "(" << b.min[0] << ", " << b.min[1] << ", " << b.min[2] << ") to (" << b.max[0] << ", " << b.max[1] << ", "
      << b.max[2] << ")";
    return s.str();
}

void require_extent(const WorldBox& box) {
    for (int a = 0; a < 3; ++a)
        if (!(box.max[a] > box.min[a]) || !std::isfinite(box.max[a] - box.min[a]))
            throw Error(Errc::InvalidInput, "domain: expected a box with a positive extent, got " + to_text(box));
}

void require_voxel_size(double voxel_size) {
    // OpenVDB treats transforms whose determinant is below 3e-15 as singular; the determinant is the cube of the voxel
    // size.
    constexpr double kMin = 1.5e-5;
    if (voxel_size >= kMin && std::isfinite(voxel_size)) return;
    std::ostringstream text;
    text << "`voxel_size`: expected >= " << kMin << ", got " << voxel_size;
    if (voxel_size > 0 && voxel_size < kMin)
        text << ", less than OpenVDB supports; use a smaller unit of length (`spacing` of the image, `points_scale` of "
                "points)";
    throw Error(Errc::InvalidOptions, text.str(), "voxel_size");
}

}  // namespace

Vec3 Domain::index_to_world(const Vec3& index) const {
    return {origin[0] + voxel_size * index[0], origin[1] + voxel_size * index[1], origin[2] + voxel_size * index[2]};
}

Vec3 Domain::world_to_index(const Vec3& world) const {
    return {(world[0] - origin[0]) / voxel_size, (world[1] - origin[1]) / voxel_size,
            (world[2] - origin[2]) / voxel_size};
}

WorldBox Domain::world_box() const {
    WorldBox box;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = origin[a] + voxel_size * (min[a] - 0.5);
        box.max[a] = origin[a] + voxel_size * (max[a] + 0.5);
    }
    return box;
}

bool Domain::contains(const Vec3& world) const {
    const WorldBox box = world_box();
    for (int a = 0; a < 3; ++a)
        if (!(world[a] >= box.min[a] && world[a] <= box.max[a])) return false;
    return true;
}

std::int64_t Domain::voxel_count() const {
    std::int64_t n = 1;
    for (int a = 0; a < 3; ++a) n *= std::max<std::int64_t>(0, std::int64_t(max[a]) - min[a] + 1);
    return n;
}

Domain make_domain(const WorldBox& box, double voxel_size) {
    require_voxel_size(voxel_size);
    require_extent(box);
    Domain domain;
    domain.voxel_size = voxel_size;
    for (int a = 0; a < 3; ++a) {
        const double length = box.max[a] - box.min[a];
        // Without the tolerance, rounding errors could enlarge a box of exactly n voxels to n + 1.
        const double cells = std::max(1.0, std::ceil(length / voxel_size - 1e-6 * std::max(1.0, length / voxel_size)));
        if (cells > kMaxVoxelsPerAxis)
            throw Error(Errc::InvalidInput, to_text(box) + " has more than 2^30 voxels of size " +
                                                std::to_string(voxel_size) + " along an axis; use a larger voxel size");
        domain.origin[a] = 0.5 * (box.min[a] + box.max[a]) - 0.5 * (cells - 1) * voxel_size;
        domain.max[a] = static_cast<std::int32_t>(cells) - 1;
    }
    return domain;
}

Domain covering(const Domain& lattice, const WorldBox& box) {
    require_voxel_size(lattice.voxel_size);
    require_extent(box);
    Domain domain = lattice;
    for (int a = 0; a < 3; ++a) {
        // A face of the box that coincides with a face between voxels may differ from it by rounding errors. Without
        // the tolerance `slack`, a further layer of voxels would then be added.
        const double length = (box.max[a] - box.min[a]) / lattice.voxel_size, slack = 1e-6 * std::max(1.0, length);
        const double first = std::floor((box.min[a] - lattice.origin[a]) / lattice.voxel_size + 0.5 + slack);
        const double last = std::ceil((box.max[a] - lattice.origin[a]) / lattice.voxel_size - 0.5 - slack);
        if (!(first > -kFarthestVoxel && last < kFarthestVoxel))
            throw Error(Errc::InvalidInput,
                        to_text(box) + " reaches more than 2^23 voxels of size " + std::to_string(lattice.voxel_size) +
                            " from the lattice's origin; choose a nearer `lattice_origin`, or a larger `voxel_size`",
                        "lattice_origin");
        domain.min[a] = static_cast<std::int32_t>(first);
        domain.max[a] = static_cast<std::int32_t>(std::max(first, last));
    }
    return domain;
}

Domain choose_domain(const WorldBox& box, double voxel_size, const std::optional<WorldBox>& image,
                     const std::optional<Vec3>& origin) {
    require_voxel_size(voxel_size);
    if (image && !origin) return covering(make_domain(*image, voxel_size), box);
    Domain lattice;
    lattice.voxel_size = voxel_size;
    const double step = kAnchorVoxels * voxel_size;
    for (int a = 0; a < 3; ++a) {
        const double middle = 0.5 * (box.min[a] + box.max[a]);
        lattice.origin[a] = std::abs(middle) > step ? step * std::round(middle / step) : 0.0;
    }
    if (origin) lattice.origin = *origin;
    return covering(lattice, box);
}

Domain widened(Domain domain, int layers) {
    for (int a = 0; a < 3; ++a) {
        domain.min[a] -= layers;
        domain.max[a] += layers;
    }
    return domain;
}

WorldBox bounding_box(const std::vector<Vec3>& points, double margin) {
    if (points.empty()) throw Error(Errc::InvalidInput, "points: expected at least one, got none");
    WorldBox box{points.front(), points.front()};
    for (const Vec3& p : points)
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::min(box.min[a], p[a]);
            box.max[a] = std::max(box.max[a], p[a]);
        }
    for (int a = 0; a < 3; ++a) {
        box.min[a] -= margin;
        box.max[a] += margin;
    }
    return box;
}

void set_domain(FloatGrid& grid, const Domain& d) {
    auto transform = openvdb::math::Transform::createLinearTransform(d.voxel_size);
    transform->postTranslate(openvdb::Vec3d(d.origin[0], d.origin[1], d.origin[2]));
    grid.setTransform(transform);
    grid.insertMeta(kMinKey, openvdb::Vec3IMetadata(openvdb::Vec3i(d.min[0], d.min[1], d.min[2])));
    grid.insertMeta(kMaxKey, openvdb::Vec3IMetadata(openvdb::Vec3i(d.max[0], d.max[1], d.max[2])));
}

Domain domain_of(const FloatGrid& grid) {
    const auto& transform = grid.transform();
    const openvdb::Vec3d h = transform.voxelSize();
    const openvdb::Vec3d origin = transform.indexToWorld(openvdb::Vec3d(0, 0, 0));
    // The step from voxel (0,0,0) to (1,1,1) in the world: with a rotation or shear it differs from (h,h,h).
    const openvdb::Vec3d diagonal = transform.indexToWorld(openvdb::Vec3d(1, 1, 1)) - origin;
    const double tolerance = 1e-6 * h[0];
    if (!(h[0] > 0) || !std::isfinite(h[0]) || !origin.isFinite() || !transform.isLinear() ||
        (diagonal - openvdb::Vec3d(h[0])).length() > tolerance || std::abs(h[1] - h[0]) > tolerance ||
        std::abs(h[2] - h[0]) > tolerance)
        throw Error(Errc::InvalidInput,
                    "grid '" + grid.getName() + "': expected a transform of one uniform voxel size and a translation");
    Domain d;
    d.voxel_size = h[0];
    d.origin = {origin[0], origin[1], origin[2]};
    const auto lo = grid.getMetadata<openvdb::Vec3IMetadata>(kMinKey);
    const auto hi = grid.getMetadata<openvdb::Vec3IMetadata>(kMaxKey);
    const bool stated = lo && hi;
    const openvdb::CoordBBox box = stated ? openvdb::CoordBBox(openvdb::Coord(lo->value()), openvdb::Coord(hi->value()))
                                          : grid.evalActiveVoxelBoundingBox();
    if (box.empty() && !stated) return d;
    const int margin = stated ? 0 : 8;
    for (int a = 0; a < 3; ++a) {
        const double first = box.min()[a], last = box.max()[a];
        // An empty domain (last = first - 1) is allowed.
        if (first <= -kFarthestVoxel || last >= kFarthestVoxel || last < first - 1) {
            std::ostringstream text;
            text << "grid '" << grid.getName() << "': expected voxels within 2^23 of voxel 0, got " << box;
            throw Error(Errc::InvalidInput, text.str());
        }
        d.min[a] = box.min()[a] - margin;
        d.max[a] = box.max()[a] + margin;
    }
    return d;
}

FloatGridPtr make_grid(const Domain& domain, float background, const char* name) {
    auto grid = FloatGrid::create(background);
    grid->setName(name);
    set_domain(*grid, domain);
    return grid;
}

double longest_side(const WorldBox& box) {
    double longest = 0;
    for (int a = 0; a < 3; ++a) longest = std::max(longest, box.max[a] - box.min[a]);
    return longest;
}

}  // namespace covol
