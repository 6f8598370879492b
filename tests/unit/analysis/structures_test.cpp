#include "covol/structures.h"

#include <openvdb/openvdb.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "covol/error.h"
#include "covol/start.h"
#include "covol/surface.h"

using namespace covol;

namespace {

constexpr double kH = 0.5;

Domain space(int half = 32) { return {kH, {0.1, -0.05, 0.02}, {-half, -half, -half}, {half, half, half}}; }

struct Ball {
    Vec3 center;
    double radius;
    [[nodiscard]] double distance(const Vec3& x) const {
        return std::hypot(x[0] - center[0], x[1] - center[1], x[2] - center[2]) - radius;
    }
};

FloatGridPtr ball(const Ball& b) { return extract_surface(*start_from_sphere(space(), b.center, b.radius)); }

Vec3 to_vec(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

/// The number of voxels that are inside both level sets.
int common_voxels(const FloatGrid& a, const FloatGrid& b) {
    int count = 0;
    const Domain d = space();
    const auto in_a = a.getConstAccessor(), in_b = b.getConstAccessor();
    for (int i = d.min[0]; i <= d.max[0]; ++i)
        for (int j = d.min[1]; j <= d.max[1]; ++j)
            for (int k = d.min[2]; k <= d.max[2]; ++k) {
                const openvdb::Coord c(i, j, k);
                count += in_a.getValue(c) < 0 && in_b.getValue(c) < 0 ? 1 : 0;
            }
    return count;
}

double volume(const FloatGrid& surface) { return measure(extract_mesh(surface)).volume; }

bool same_bits(const FloatGrid& a, const FloatGrid& b) {
    if (a.activeVoxelCount() != b.activeVoxelCount()) return false;
    const auto other = b.getConstAccessor();
    for (auto value = a.cbeginValueOn(); value; ++value)
        if (!other.isValueOn(value.getCoord()) || other.getValue(value.getCoord()) != *value) return false;
    return true;
}

/// The volume of a cap of height t that a plane cuts from a solid ball.
double cap_volume(double r, double t) { return M_PI * t * t * (3 * r - t) / 3; }

/// Checks that each vertex lies either on its own ball and outside the other one, or on the middle surface, whose
/// positions have the same signed distance to both balls.
void check_vertices(const FloatGrid& surface, const Ball& mine, const Ball& other) {
    int on_middle = 0;
    for (const auto& v : extract_mesh(surface).vertices) {
        const Vec3 x = to_vec(v);
        const double own = mine.distance(x), middle = (mine.distance(x) - other.distance(x)) / 2;
        CHECK(std::abs(std::max(own, middle)) < 0.3 * kH);
        on_middle += middle > own && std::abs(middle) < 0.05 * kH ? 1 : 0;
    }
    CHECK(on_middle > 20);
}

}  // namespace

TEST_CASE("Overlapping balls of equal size are separated at the plane midway between them") {
    const Ball a{{-3, 0, 0}, 5}, b{{3, 0, 0}, 5};
    const auto [surfaces, report] = separate({{"a", ball(a)}, {"b", ball(b)}});
    REQUIRE(report.overlaps.size() == 1);
    CHECK(report.overlaps[0].volume == Approx(2 * cap_volume(5, 2)).epsilon(0.02));
    CHECK_FALSE(report.overlaps[0].inner);
    CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
    CHECK(volume(*surfaces[0]) == Approx(volume(*ball(a)) - cap_volume(5, 2)).epsilon(0.005));
    CHECK(volume(*surfaces[1]) == Approx(volume(*ball(b)) - cap_volume(5, 2)).epsilon(0.005));
    check_vertices(*surfaces[0], a, b);
    check_vertices(*surfaces[1], b, a);
}

TEST_CASE("An overlap thicker than the narrow bands is separated midway, too") {
    // The overlap of the balls is 14 units (28 voxels) thick, far more than the width of the narrow bands.
    const Ball a{{-3, 0, 0}, 10}, b{{3, 0.4, 0}, 10};
    const auto [surfaces, report] = separate({{"a", ball(a)}, {"b", ball(b)}});
    CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
    check_vertices(*surfaces[0], a, b);
    check_vertices(*surfaces[1], b, a);
    CHECK(volume(*surfaces[0]) == Approx(volume(*ball(a)) - cap_volume(10, 10 - std::hypot(3, 0.2))).epsilon(0.005));
}

TEST_CASE("Overlapping balls of different sizes are separated at the hyperboloid between them") {
    const Ball a{{-2, 0.3, 0}, 6}, b{{4, 0, 0.2}, 3};
    const auto [surfaces, report] = separate({{"a", ball(a)}, {"b", ball(b)}});
    CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
    check_vertices(*surfaces[0], a, b);
    check_vertices(*surfaces[1], b, a);
}

TEST_CASE("A gap narrower than a voxel is closed midway, a gap of 1.5 voxels is kept") {
    const Ball a{{-5, 0, 0}, 5};
    for (const double gap : {0.0, 0.3 * kH, 0.9 * kH}) {
        CAPTURE(gap);
        const Ball b{{5 + gap, 0, 0}, 5};
        const auto [surfaces, report] = separate({{"a", ball(a)}, {"b", ball(b)}});
        CHECK(report.changed == std::vector<bool>{true, true});
        const auto in_a = surfaces[0]->getConstAccessor(), in_b = surfaces[1]->getConstAccessor();
        CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
        // On the line between the centres, both surfaces must cross the middle of the gap.
        const openvdb::Vec3d x = surfaces[0]->transform().worldToIndex(openvdb::Vec3d(gap / 2, 0, 0));
        const openvdb::Coord low(int(std::floor(x[0])), int(std::round(x[1])), int(std::round(x[2])));
        const double t = x[0] - low[0];
        const auto along = [&](const auto& phi) {
            return (1 - t) * phi.getValue(low) + t * phi.getValue(low.offsetBy(1, 0, 0));
        };
        CHECK(std::abs(along(in_a)) < 0.1 * kH);
        CHECK(std::abs(along(in_b)) < 0.1 * kH);
    }
    const Ball b{{5 + 1.5 * kH, 0, 0}, 5};
    const FloatGridPtr sa = ball(a), sb = ball(b);
    const auto [surfaces, report] = separate({{"a", sa}, {"b", sb}});
    CHECK(report.changed == std::vector<bool>{false, false});
    CHECK(report.overlaps.empty());
    CHECK(surfaces[0] == sa);
    CHECK(surfaces[1] == sb);
}

TEST_CASE("Closing a narrow slit between two slabs fills the slit only") {
    // Two slabs with a slit of 0.6 voxel between them. Both end at z = 4, and the filling of the slit may not extend
    // above.
    const FloatGridPtr a = extract_surface(*start_from_box(space(), {{-6, -6, -6}, {0, 6, 4}}));
    const FloatGridPtr b = extract_surface(*start_from_box(space(), {{0.6 * kH, -6, -6}, {6, 6, 4}}));
    const auto [surfaces, report] = separate({{"a", a}, {"b", b}});
    // Each slab grows by half of the slit's width over the face of 12 x 10 at the slit, except for a strip less than a
    // voxel wide along its rim, which is rounded.
    const double maximum = 0.3 * kH * 12 * 10, minimum = maximum - 0.3 * kH * 2 * (12 + 10) * kH;
    for (const double growth : {volume(*surfaces[0]) - volume(*a), volume(*surfaces[1]) - volume(*b)}) {
        CHECK(growth < maximum);
        CHECK(growth > minimum);
    }
    for (const FloatGridPtr& grid : surfaces)
        for (const auto& v : extract_mesh(*grid).vertices) CHECK(v[2] < 4 + 0.15 * kH);
    CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
}

TEST_CASE("Three balls are separated along a triple line, bit-identically in any order and on any threads") {
    std::vector<Structure> structures;
    std::vector<Ball> balls;
    for (int n = 0; n < 3; ++n) {
        balls.push_back({{3 * std::cos(2 * M_PI * n / 3), 3 * std::sin(2 * M_PI * n / 3), 0.1 * n}, 4 + 0.2 * n});
        structures.push_back({std::string(1, char('a' + n)), ball(balls.back())});
    }
    const auto [surfaces, report] = separate(structures);
    CHECK(report.overlaps.size() == 3);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < i; ++j) CHECK(common_voxels(*surfaces[i], *surfaces[j]) == 0);
        for (const auto& v : extract_mesh(*surfaces[i]).vertices) {
            const Vec3 x = to_vec(v);
            double expected = balls[i].distance(x);
            for (int j = 0; j < 3; ++j)
                if (j != i) expected = std::max(expected, (balls[i].distance(x) - balls[j].distance(x)) / 2);
            CHECK(std::abs(expected) < 0.3 * kH);
        }
    }
    // The surfaces contain as many voxels as the union of the given balls.
    int sum = 0, all = 0;
    const Domain d = space();
    for (int i = d.min[0]; i <= d.max[0]; ++i)
        for (int j = d.min[1]; j <= d.max[1]; ++j)
            for (int k = d.min[2]; k <= d.max[2]; ++k) {
                const openvdb::Coord c(i, j, k);
                for (int n = 0; n < 3; ++n) sum += surfaces[n]->tree().getValue(c) < 0 ? 1 : 0;
                const auto in = [&](int n) { return structures[n].surface->tree().getValue(c) < 0; };
                all += in(0) || in(1) || in(2) ? 1 : 0;
            }
    CHECK(sum == all);

    for (const std::array<int, 3>& order : {std::array<int, 3>{2, 0, 1}, {1, 0, 2}, {2, 1, 0}}) {
        std::vector<Structure> permuted;
        for (const int n : order) permuted.push_back(structures[n]);
        RunContext run;
        run.threads = 1 + order[0];
        const SeparateResult again = separate(permuted, {}, run);
        for (int n = 0; n < 3; ++n) CHECK(same_bits(*again.surfaces[n], *surfaces[order[n]]));
    }
}

TEST_CASE("An enclosed solid is subtracted from the enclosing one, whatever their order") {
    const Ball outer{{0, 0, 0}, 9}, inner{{2, 0, 0}, 4}, core{{2, 0, 0}, 1.6};
    const double whole = volume(*ball(outer)), middle = volume(*ball(inner)), minimum = volume(*ball(core));
    const auto [surfaces, report] = separate({{"outer", ball(outer)}, {"inner", ball(inner)}, {"core", ball(core)}});
    CHECK(report.overlaps.size() == 3);
    for (const StructureOverlap& overlap : report.overlaps) CHECK(overlap.inner == overlap.b);
    CHECK(volume(*surfaces[0]) == Approx(whole - middle).epsilon(0.003));
    CHECK(volume(*surfaces[1]) == Approx(middle - minimum).epsilon(0.003));
    CHECK(volume(*surfaces[2]) == Approx(minimum).epsilon(0.003));
    CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
    CHECK(common_voxels(*surfaces[1], *surfaces[2]) == 0);
    const SeparateResult turned = separate({{"core", ball(core)}, {"outer", ball(outer)}, {"inner", ball(inner)}});
    CHECK(same_bits(*turned.surfaces[1], *surfaces[0]));
    CHECK(same_bits(*turned.surfaces[2], *surfaces[1]));
}

TEST_CASE("A solid in another's cavity is no overlap, and the slit between them is closed midway") {
    // A shell with a cavity of radius 5, and in it a ball whose radius is 0.4 voxel smaller than that of the cavity.
    FloatGridPtr shell = separate({{"shell", ball({{0, 0, 0}, 8})}, {"hole", ball({{0, 0, 0}, 5})}}).surfaces[0];
    const double r = 5 - 0.4 * kH;
    const auto [surfaces, report] = separate({{"shell", shell}, {"ball", ball({{0, 0, 0}, r})}});
    CHECK(report.overlaps.empty());
    const double middle = volume(*ball({{0, 0, 0}, 5 - 0.2 * kH}));
    CHECK(volume(*surfaces[1]) == Approx(middle).epsilon(0.006));
    CHECK(volume(*surfaces[0]) == Approx(volume(*ball({{0, 0, 0}, 8})) - middle).epsilon(0.006));
    CHECK(common_voxels(*surfaces[0], *surfaces[1]) == 0);
}

TEST_CASE("separate() rejects missing, repeated or incompatible surfaces and options out of range") {
    const FloatGridPtr a = ball({{0, 0, 0}, 4});
    CHECK_THROWS_AS(separate({}), Error);
    CHECK_THROWS_WITH(separate({{"a", a}, {"a", a}}), Catch::Contains("unique names"));
    CHECK_THROWS_WITH(separate({{"a", a}, {"b", a}}), Catch::Contains("'a' and 'b' are the same solid"));
    Domain finer = space();
    finer.voxel_size /= 2;
    const FloatGridPtr other = extract_surface(*start_from_sphere(finer, {0, 0, 0}, 3));
    CHECK_THROWS_WITH(separate({{"a", a}, {"b", other}}), Catch::Contains("the same transform"));
    CHECK_THROWS_AS(separate({{"a", a}}, {std::nan(""), 0.9}), Error);
    CHECK_THROWS_AS(separate({{"a", a}}, {0, 0.3}), Error);
    CHECK(separate({{"a", a}}).surfaces[0] == a);
}

TEST_CASE("Touching structures are labelled without gaps, and ties go to the alphabetically first name") {
    // The plane halfway between the overlapping ends of the two solids, x = 0.1, contains voxel centres. They have the
    // same distance to both solids, so all of them are ties.
    const FloatGridPtr a = extract_surface(*start_from_box(space(), {{-5.9, -4, -4}, {0.6, 4, 4}}));
    const FloatGridPtr b = extract_surface(*start_from_box(space(), {{-0.4, -4, -4}, {6.1, 4, 4}}));
    const SeparateResult settled = separate({{"b", b}, {"a", a}});
    ImageGeometry g;
    g.size = {40, 40, 40};
    g.spacing = {kH, kH, kH};
    g.origin = {0.1 - 20 * kH, -0.05 - 20 * kH, 0.02 - 20 * kH};
    const auto labels = make_label_image({{"b", settled.surfaces[0]}, {"a", settled.surfaces[1]}}, g);
    REQUIRE(labels.size() == 64000);
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i) {
                const Vec3 x = g.index_to_world({double(i), double(j), double(k)});
                const bool solid = x[0] > -5.8 && x[0] < 6 && std::abs(x[1]) < 3.9 && std::abs(x[2]) < 3.9;
                const bool outside = x[0] < -6 || x[0] > 6.2 || std::abs(x[1]) > 4.1 || std::abs(x[2]) > 4.1;
                const int label = labels[(std::size_t(k) * 40 + j) * 40 + i];
                // Ties go to the structure whose name is first in alphabetical order: 'a', which has label 2.
                if (solid) CHECK(label == (x[0] < 0.1 + 1e-6 ? 2 : 1));
                if (outside) CHECK(label == 0);
            }
}

TEST_CASE("A label image computed box by box equals the one computed at once") {
    const FloatGridPtr a = extract_surface(*start_from_box(space(), {{-5.9, -4, -4}, {0.6, 4, 4}}));
    const FloatGridPtr b = extract_surface(*start_from_box(space(), {{-0.4, -4, -4}, {6.1, 4, 4}}));
    const FloatGridPtr c = ball({{0, 7, 5}, 3.3});
    const SeparateResult settled = separate({{"b", b}, {"a", a}, {"c", c}});
    const std::vector<Structure> all{
        {"b", settled.surfaces[0]}, {"a", settled.surfaces[1]}, {"c", settled.surfaces[2]}};
    ImageGeometry g;
    g.size = {61, 53, 47};
    g.spacing = {0.5, 0.31, 0.77};
    g.origin = {-15, -8, -17};
    const double cosine = std::cos(0.2), sine = std::sin(0.2);
    for (const bool turned : {false, true}) {
        if (turned) g.direction = {{{cosine, -sine, 0}, {sine, cosine, 0}, {0, 0, 1}}};
        for (const std::size_t count : {1U, 3U}) {
            const std::vector<Structure> some(all.begin(), all.begin() + std::ptrdiff_t(count));
            const std::vector<std::uint8_t> dense = make_label_image(some, g);
            const auto at = [&](int i, int j, int k) { return dense[(std::size_t(k) * 53 + j) * 61 + i]; };
            const LabelImage bytes(some, g), wide(some, g, {-3, 700, 9});
            CHECK(bytes.type() == PixelType::UInt8);
            REQUIRE(wide.type() == PixelType::Int32);
            int uniform = 0, different = 0;
            std::vector<std::uint64_t> voxels(count, 0);
            for (const int edge : {4, 16}) {
                for (int z = 0; z < 47; z += edge)
                    for (int y = 0; y < 53; y += edge)
                        for (int x = 0; x < 61; x += edge) {
                            const VoxelBox box{
                                {x, y, z},
                                {std::min(x + edge, 61) - 1, std::min(y + edge, 53) - 1, std::min(z + edge, 47) - 1}};
                            const std::size_t n = std::size_t(box.size()[0]) * box.size()[1] * box.size()[2];
                            std::vector<std::uint8_t> got(n, 99);
                            std::vector<std::int32_t> values(n, 99);
                            bytes.fill(box, got.data());
                            wide.fill(box, values.data());
                            const auto same = bytes.uniform(box);
                            uniform += same ? 1 : 0;
                            if (edge == 4) wide.wrote(box, values.data(), 0);
                            std::size_t v = 0;
                            for (int k = z; k <= box.max[2]; ++k)
                                for (int j = y; j <= box.max[1]; ++j)
                                    for (int i = x; i <= box.max[0]; ++i, ++v) {
                                        const int label = at(i, j, k);
                                        static constexpr std::array<int, 4> kValues{0, -3, 700, 9};
                                        different += got[v] != label || values[v] != kValues[std::size_t(label)] ||
                                                     (same && *same != label);
                                        if (edge == 4 && label > 0) ++voxels[std::size_t(label) - 1];
                                    }
                        }
            }
            CHECK(different == 0);
            CHECK(uniform > 1000);
            CHECK(wide.voxels_written() == voxels);
        }
    }
}

TEST_CASE("Grid names are unique identifiers made from the structures' names") {
    CHECK(make_grid_names({"anything at all"}) == std::vector<std::string>{"surface"});
    CHECK(make_grid_names({"ve", "left lung", "left-lung", "2nd", "é"}) ==
          std::vector<std::string>{"ve", "left_lung", "left_lung_2", "_2nd", "__"});
}

TEST_CASE("Segment metadata contain names, labels, colours and extents") {
    const auto fields = make_slicer_segments({"ve", "ex e"}, {{{1, 0, 0}, {2, 1, 1}}, {}});
    const auto at = [&](const std::string& key) {
        for (const auto& [name, value] : fields)
            if (name == key) return value;
        return std::string("missing");
    };
    CHECK(at("Segment0_Name") == "ve");
    CHECK(at("Segment1_Name") == "ex e");
    CHECK(at("Segment1_ID") == "ex_e");
    CHECK(at("Segment0_LabelValue") == "1");
    CHECK(at("Segment0_Extent") == "1 2 0 1 0 1");
    CHECK(at("Segment1_Extent") == "0 -1 0 -1 0 -1");
    CHECK(at("Segment0_Layer") == "0");
    CHECK(at("Segment0_Color") == "0.266667 0.466667 0.666667");
    CHECK_THAT(make_itksnap_labels({"ve", "a \"b\""}),
               Catch::Contains("    1   68  119  170        1  1  1    \"ve\"\n") && Catch::Contains("\"a 'b'\""));
}
