// Solids that extend beyond the image have flat caps on its box, and mesh, mask and level set of them agree.
#include "covol/clip.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>

#include "covol/mesh_cleanup.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "support/shapes.h"

using namespace covol;

namespace {

using Shape = std::function<double(const Vec3&)>;  // negative inside, close to a distance

Shape ellipsoid(const Vec3& center, const Vec3& radii) {
    return [=](const Vec3& x) {
        Vec3 p, q;
        for (int a = 0; a < 3; ++a) {
            p[a] = (x[a] - center[a]) / radii[a];
            q[a] = p[a] / radii[a];
        }
        const double along = std::hypot(p[0], p[1], p[2]), slope = std::hypot(q[0], q[1], q[2]);
        return along > 0 ? along * (along - 1) / std::max(slope, 1e-9) : -std::min({radii[0], radii[1], radii[2]});
    };
}

FloatGridPtr level_set(const Domain& domain, const Shape& shape) {
    const double w = 3 * domain.voxel_size;
    FloatGridPtr u = make_grid(domain, float(w), "u");
    test::for_each_voxel(domain, [&](int i, int j, int k, const Vec3& x) {
        u->tree().setValue(test::coord(domain, i, j, k), float(std::clamp(shape(x), -w, w)));
    });
    return u;
}

struct Cut {
    std::string name;
    Vec3 spacing;
    double h;
    double fraction;  // remaining fraction of the body's extent along the cut axis
    bool two;         // cut by faces of two axes
    bool turned;      // the image's axes are reversed
};

/// A body near the origin in an image whose faces cut off part of it.
struct Scene {
    Vec3 radii, center{0, 0, 0};
    ImageGeometry geometry;
    Shape shape;
};

Scene scene_of(const Cut& cut, const Vec3& radii) {
    Scene scene;
    scene.radii = radii;
    // Along a cut axis, the image begins so that `fraction` of the body's extent remains. Along the others it begins
    // about 5 voxels before the body, at some position within a voxel.
    scene.geometry.spacing = cut.spacing;
    const Vec3 off{0.31, -0.22, 0.13};
    for (int a = 0; a < 3; ++a) {
        const bool is_cut = a == 2 || (cut.two && a == 0);
        // If two axes are cut, at least half remains along the second, because two deep cuts would leave only a sliver.
        const double left = a == 2 ? cut.fraction : std::max(cut.fraction, 0.5);
        const double low =
            is_cut ? -radii[a] + 2 * radii[a] * (1 - left) : -radii[a] - 5 * cut.spacing[a] + off[a] * cut.spacing[a];
        const int n = int(std::ceil((radii[a] + 5 * cut.spacing[a] - low) / cut.spacing[a]));
        scene.geometry.size[a] = n;
        scene.geometry.origin[a] = low + 0.5 * cut.spacing[a];
        if (cut.turned && a != 1) {
            scene.geometry.direction[a][a] = -1;
            scene.geometry.origin[a] = low + (n - 0.5) * cut.spacing[a];
        }
    }
    scene.shape = ellipsoid(scene.center, radii);
    return scene;
}

struct Truth {
    double volume = 0, cap_area = 0;
};

/// The volume of the part of the body inside the image, and the area of the cap across axis 2, by sampling on 400^2
/// columns.
Truth measure_truth(const Scene& scene) {
    const WorldBox box = scene.geometry.world_box();
    Truth truth;
    constexpr int n = 400;
    const auto& r = scene.radii;
    const double da = 2 * r[0] / n, db = 2 * r[1] / n;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double x = -r[0] + (i + 0.5) * da, y = -r[1] + (j + 0.5) * db;
            if (x < box.min[0] || x > box.max[0] || y < box.min[1] || y > box.max[1]) continue;
            const double rest = 1 - x * x / (r[0] * r[0]) - y * y / (r[1] * r[1]);
            if (rest <= 0) continue;
            const double top = r[2] * std::sqrt(rest);
            const double lo = std::max(-top, box.min[2]), hi = std::min(top, box.max[2]);
            if (hi > lo) truth.volume += (hi - lo) * da * db;
            if (-top < box.min[2] && top > box.min[2]) truth.cap_area += da * db;
        }
    return truth;
}

/// The area of the triangles whose corners all lie at z.
double area_at(const TriangleMesh& mesh, double z, double tolerance) {
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const auto &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        if (std::abs(a[2] - z) > tolerance || std::abs(b[2] - z) > tolerance || std::abs(c[2] - z) > tolerance)
            continue;
        area += 0.5 * std::abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
    }
    return area;
}

std::vector<Cut> cuts() {
    std::vector<Cut> all;
    for (const double fraction : {0.2, 0.5, 0.8})
        for (const bool two : {false, true}) {
            all.push_back({"isotropic", {1, 1, 1}, 1, fraction, two, false});
            all.push_back({"turned axes", {1, 1, 1}, 1, fraction, two, true});
            all.push_back({"thick slices", {0.8, 0.8, 1.75}, 0.8, fraction, two, false});
            all.push_back({"slices 1:5", {1, 1, 5}, 1, fraction, two, false});
            all.push_back({"coarse voxels", {1, 1, 3.5}, 3, fraction, two, false});
        }
    return all;
}

}  // namespace

TEST_CASE("A solid cut by the image ends at the image's box: mesh, cap, mask and level set") {
    double worst_volume = 0, worst_cap = 0, worst_slice = 0, worst_grid = 0;
    for (const Vec3& radii : {Vec3{14, 14, 14}, Vec3{14, 11, 17}, Vec3{27, 19, 22}})
        for (const Cut& cut : cuts()) {
            const Scene scene = scene_of(cut, radii);
            INFO(cut.name << ", " << 100 * cut.fraction << " % left" << (cut.two ? " along two axes" : "") << ", radii "
                          << radii[0] << " " << radii[1] << " " << radii[2]);
            const Clip clip = make_clip(scene.geometry);
            const WorldBox box = scene.geometry.world_box();
            const Domain domain = make_domain(box, cut.h);
            const FloatGridPtr u = level_set(domain, scene.shape);
            set_clip(*u, clip);
            const FloatGridPtr solid = extract_surface(*u);
            REQUIRE(clip_of(*solid) == clip);
            const TriangleMesh mesh = extract_mesh(*solid);
            const MeshMeasures m = measure(mesh);
            REQUIRE(m.closed);
            REQUIRE(m.manifold);
            CHECK(count_self_intersections(mesh) == 0);
            for (const auto& v : mesh.vertices)
                for (int a = 0; a < 3; ++a) {
                    REQUIRE(v[a] >= box.min[a] - 1e-5 * cut.h);
                    INFO("axis " << a << " at " << v[0] << " " << v[1] << " " << v[2] << " box " << box.min[a] << " to "
                                 << box.max[a]);
                    REQUIRE(v[a] <= box.max[a] + 1e-5 * cut.h);
                }
            const Truth truth = measure_truth(scene);
            const double coarse = cut.h / std::min({radii[0], radii[1], radii[2]});
            // The edges of the triangles are chords, which cut off a fraction of the volume that grows with the square
            // of h over the radius, and a larger fraction of the cap's area.
            const double chords = (cut.fraction < 0.5 ? 1.0 : 0.7) * coarse * coarse;
            const double volume = m.volume / truth.volume - 1,
                         cap = area_at(mesh, box.min[2], 1e-5 * cut.h) / truth.cap_area - 1;
            CHECK(std::abs(volume) < 0.003 + chords);
            CHECK(std::abs(cap) < 0.005 + 2 * chords);
            // In the slice at the cut, the labels are those of the exact shape, except for voxels whose centre is close
            // to the surface.
            const auto labels = rasterize(*solid, scene.geometry);
            const auto [ni, nj, nk] = scene.geometry.size;
            double marked = 0, expected = 0;
            const int k = cut.turned ? nk - 1 : 0;
            for (int j = 0; j < nj; ++j)
                for (int i = 0; i < ni; ++i) {
                    const double d = scene.shape(scene.geometry.index_to_world({double(i), double(j), double(k)}));
                    const bool label = labels[(std::size_t(k) * nj + j) * ni + i] != 0;
                    marked += label;
                    expected += d < 0;
                    if (std::abs(d) > 0.25 * cut.h) REQUIRE(label == (d < 0));
                }
            CHECK(std::abs(marked - expected) <= 0.03 * expected);
            // Other programs read the level set without the metadata of the clip. Then only the edge of the cut is
            // rounded, by less than a voxel.
            const FloatGridPtr plain = solid->deepCopy();
            set_clip(*plain, {});
            const TriangleMesh rounded = extract_mesh(*plain);
            for (const auto& v : rounded.vertices)
                for (int a = 0; a < 3; ++a) REQUIRE(v[a] <= box.max[a] + 0.02 * cut.h);
            const double without = measure(rounded).volume / truth.volume - 1;
            CHECK(std::abs(without) < 0.01 + 5 * coarse * coarse + 0.1 * coarse);
            worst_volume = std::max(worst_volume, std::abs(volume));
            worst_cap = std::max(worst_cap, std::abs(cap));
            worst_slice = std::max(worst_slice, std::abs(marked / expected - 1));
            worst_grid = std::max(worst_grid, std::abs(without));
        }
    std::printf("cut bodies: worst volume %.4f, cap %.4f, end slice %.4f; volume from the plain level set %.4f\n",
                worst_volume, worst_cap, worst_slice, worst_grid);
}

TEST_CASE("The clip is kept in a .vdb file, and extracting a clipped surface again keeps its volume") {
    const Scene scene = scene_of({"", {0.8, 0.8, 1.75}, 0.8, 0.5, true, false}, {9, 8, 11});
    const FloatGridPtr u = level_set(make_domain(scene.geometry.world_box(), 0.8), scene.shape);
    set_clip(*u, make_clip(scene.geometry));
    const FloatGridPtr solid = extract_surface(*u);
    const std::string path = (std::filesystem::temp_directory_path() / "covol_clip_test.vdb").string();
    write_vdb(path, {solid}, {});
    const FloatGridPtr read = read_vdb(path, "surface");
    std::remove(path.c_str());
    CHECK(clip_of(*read) == clip_of(*solid));
    const double volume = measure(extract_mesh(*solid)).volume;
    CHECK(measure(extract_mesh(*read)).volume == volume);
    CHECK(measure(extract_mesh(*extract_surface(*solid))).volume == Approx(volume).epsilon(0.005));
}

TEST_CASE("A rotated image clips a solid along its own faces") {
    ImageGeometry geometry;
    geometry.size = {40, 40, 20};
    geometry.origin = {3, -2, 1};
    const double c = std::cos(0.4), s = std::sin(0.4);
    geometry.direction = {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
    const Vec3 center = geometry.index_to_world({19.5, 19.5, -0.5});  // in the middle of the first slice's face
    const FloatGridPtr u = level_set(make_domain(geometry.world_box(), 1), ellipsoid(center, {13, 13, 13}));
    const Clip clip = make_clip(geometry);
    set_clip(*u, clip);
    const TriangleMesh mesh = extract_mesh(*extract_surface(*u));
    const MeshMeasures m = measure(mesh);
    CHECK(m.closed);
    CHECK(m.manifold);
    CHECK(count_self_intersections(mesh) == 0);
    CHECK(m.volume == Approx(2.0 / 3 * M_PI * 13 * 13 * 13).epsilon(0.01));
    int on_face = 0;
    for (const auto& v : mesh.vertices) {
        double beyond = -1e9;
        for (const HalfSpace& plane : clip)
            beyond = std::max(beyond,
                              plane.normal[0] * v[0] + plane.normal[1] * v[1] + plane.normal[2] * v[2] - plane.offset);
        CHECK(beyond < 0.02);
        on_face += std::abs(beyond) < 1e-3;
    }
    CHECK(on_face > 400);
}

TEST_CASE("A solid within the image has the same mesh with and without a clip") {
    ImageGeometry geometry;
    geometry.size = {40, 40, 40};
    const Domain domain = make_domain(geometry.world_box(), 1);
    const FloatGridPtr u = level_set(domain, ellipsoid({19, 20, 18.5}, {12, 13, 14}));
    const TriangleMesh before = extract_mesh(*extract_surface(*u));
    set_clip(*u, make_clip(geometry));
    const TriangleMesh after = extract_mesh(*extract_surface(*u));
    CHECK(before.vertices == after.vertices);
    CHECK(before.triangles == after.triangles);
}

TEST_CASE("A solid that fills the image is clipped to the image's box") {
    ImageGeometry geometry;
    geometry.size = {10, 12, 9};
    geometry.spacing = {1, 1, 1.7};
    const Domain domain = make_domain(geometry.world_box(), 1);
    const FloatGridPtr u = level_set(domain, [](const Vec3&) { return -5.0; });
    set_clip(*u, make_clip(geometry));
    const MeshMeasures m = measure(extract_mesh(*extract_surface(*u)));
    CHECK(m.closed);
    CHECK(m.genus == 0);
    CHECK(m.volume == Approx(10 * 12 * 9 * 1.7).epsilon(0.002));
}
