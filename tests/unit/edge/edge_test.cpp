#include "covol/edge.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "covol/error.h"
#include "edge/nth_value.h"
#include "support/dense_reference.h"
#include "support/scratch.h"
#include "support/shapes.h"

using namespace covol;
using namespace covol::test;

namespace {

constexpr double kH = 0.5;

/// An image on the lattice of the domain, with the value f(x) at the position x.
Image image_on(const Domain& domain, const Function& f) {
    ImageGeometry geometry;
    geometry.size = size_of(domain);
    geometry.spacing = {domain.voxel_size, domain.voxel_size, domain.voxel_size};
    geometry.origin = domain.index_to_world({double(domain.min[0]), double(domain.min[1]), double(domain.min[2])});
    std::vector<float> values(domain.voxel_count());
    for_each_voxel(domain, [&](int i, int j, int k, const Vec3& x) {
        values[(static_cast<std::size_t>(k) * geometry.size[1] + j) * geometry.size[0] + i] = static_cast<float>(f(x));
    });
    return Image::from_values(geometry, values.data());
}

FloatGridPtr topology_where(const Domain& domain, const std::function<bool(const Vec3&)>& keep) {
    const Index3 n = size_of(domain);
    const DenseField zero(n[0], n[1], n[2], domain.voxel_size);
    return to_grid(domain, zero, active_where(domain, zero, keep), "band", 1.0F);
}

EdgeOptions options(double sigma, double k) {
    EdgeOptions o;
    o.sigma = sigma;
    if (k > 0) o.edge_k = k;
    o.intensities = {0, 1};
    return o;
}

DenseField reference(const Domain& domain, const Function& f, double sigma, double k) {
    DenseField image = rounded(sample(domain, [&](const Vec3& x) { return std::clamp(f(x), 0.0, 1.0); }));
    const double time = sigma * sigma / 2;
    const int steps = static_cast<int>(std::ceil(time / (0.5 * kH * kH) - 1e-9));  // steps of at most h²/2
    if (steps > 0) dense_heat(image, time, steps);
    return dense_edge(image, k);
}

double largest_difference(const Domain& domain, const FloatGrid& g, const DenseField& expected) {
    double worst = 0;
    for (auto v = g.cbeginValueOn(); v; ++v) {
        const openvdb::Coord at = v.getCoord();
        worst = std::max(
            worst, std::abs(*v - expected.at(at.x() - domain.min[0], at.y() - domain.min[1], at.z() - domain.min[2])));
    }
    return worst;
}

bool everywhere(const Vec3&) { return true; }

Errc edge_code(const std::function<void()>& call) { return code_of(call); }

}  // namespace

TEST_CASE("EdgeOptions: every option that is out of range is named") {
    CHECK(why_invalid(EdgeOptions{}).empty());
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const auto rejects = [](const char* field, auto EdgeOptions::*member, auto value) {
        EdgeOptions o;
        o.*member = value;
        INFO(field << ": " << why_invalid(o));
        CHECK(why_invalid(o).rfind(std::string(field) + ": expected ", 0) == 0);
    };
    for (const double bad : {-1.0, nan}) rejects("sigma", &EdgeOptions::sigma, bad);
    for (const double bad : {-1.0, 0.0, nan}) {
        rejects("edge_k", &EdgeOptions::edge_k, bad);
        rejects("edge_contrast", &EdgeOptions::edge_contrast, bad);
    }
    for (const double bad : {-0.1, 0.0, 1.0, nan})
        rejects("contrast_percentile", &EdgeOptions::contrast_percentile, bad);
    rejects("intensities", &EdgeOptions::intensities, std::array{3.0, 0.0});
    rejects("intensities", &EdgeOptions::intensities, std::array{0.0, nan});
}

TEST_CASE("On a ramp g is 1/(1 + K s^2), with s per world unit of the normalised image") {
    const Domain domain = cube_domain(24, kH, -9);
    // The intensity rises from 200 to 440 over the box of 12 units and is normalised by [100, 500]: s = 240 / 12 / 400.
    const Image image = image_on(domain, [](const Vec3& x) { return 320 + 20 * x[1]; });
    EdgeOptions o;
    o.sigma = kH;
    o.edge_k = 400;
    o.intensities = {100, 500};
    const EdgeResult result =
        detect_edges(image, *topology_where(domain, [](const Vec3& x) { return std::abs(x[1]) < 2; }), o);
    REQUIRE(result.grid->activeVoxelCount() > 1000);
    for (auto v = result.grid->cbeginValueOn(); v; ++v)
        REQUIRE(*v == Approx(1 / (1 + 400 * 0.05 * 0.05)).epsilon(1e-3));
    CHECK(result.report.edge_k == Approx(400));
    CHECK(result.report.edge_contrast == Approx(1 / 20.0));
    CHECK(result.report.sigma == kH);
    CHECK(result.report.low == 100);
    CHECK(result.report.high == 500);
}

TEST_CASE("The edge detector equals that of the dense reference") {
    const Domain domain = cube_domain(21, kH, 2);  // the domain ends inside leaves
    const Function waves = random_waves(31, 3.0);
    const Function f = [&](const Vec3& x) { return 0.5 + 0.45 * waves(x); };  // some values are clamped
    const Image image = image_on(domain, f);
    for (const double sigma : {0.0, kH, 2.5 * kH}) {
        INFO("sigma = " << sigma / kH << " h");
        const EdgeResult result = detect_edges(image, *topology_where(domain, everywhere), options(sigma, 5));
        REQUIRE(result.grid->activeVoxelCount() == 21 * 21 * 21);
        const DenseField expected = reference(domain, f, sigma, 5);
        CHECK(largest_difference(domain, *result.grid, expected) < 1e-4);
        double low = 1;
        for (auto v = result.grid->cbeginValueOn(); v; ++v) low = std::min<double>(low, *v);
        CHECK(low < 0.9);  // otherwise g would be 1 everywhere, and the comparison meaningless
    }
}

TEST_CASE("A band has the edge detector of the whole domain and keeps its topology") {
    const Domain domain = cube_domain(40, kH, -13);
    const Function waves = random_waves(32, 3.0);
    const Image image = image_on(domain, [&](const Vec3& x) { return 0.5 + 0.4 * waves(x); });
    const FloatGridPtr shell = topology_where(domain, [](const Vec3& x) { return std::abs(length(x) - 6) < 1; });
    const EdgeResult all = detect_edges(image, *topology_where(domain, everywhere), options(2 * kH, 5));
    const EdgeResult band = detect_edges(image, *shell, options(2 * kH, 5));
    CHECK(band.grid->tree().hasSameTopology(shell->tree()));
    CHECK(band.grid->background() == 1.0F);
    CHECK(band.grid->getName() == "edge");
    CHECK(domain_of(*band.grid) == domain);
    CHECK(largest_difference(domain, *band.grid, to_dense(domain, *all.grid)) < 1e-3);
}

TEST_CASE("g is 1/2 at the contrast, whether given or chosen by percentile") {
    const Domain domain = cube_domain(24, kH);
    const Function waves = random_waves(33, 3.0);
    const Image image = image_on(domain, [&](const Vec3& x) { return 0.5 + 0.4 * waves(x); });
    const FloatGridPtr topology = topology_where(domain, everywhere);
    EdgeOptions o = options(kH, 0);
    o.edge_contrast = 0.2;
    CHECK(detect_edges(image, *topology, o).report.edge_k == Approx(25));
    o.edge_contrast.reset();
    o.contrast_percentile = 0.8;
    const EdgeResult chosen = detect_edges(image, *topology, o);
    std::int64_t steeper = 0;
    for (auto v = chosen.grid->cbeginValueOn(); v; ++v) steeper += *v < 0.5F;
    CHECK(static_cast<double>(steeper) / static_cast<double>(domain.voxel_count()) == Approx(0.2).margin(0.002));
    CHECK(chosen.report.feature == EdgeFeature::Slope);  // Automatic was requested
    CHECK(chosen.report.edge_k == Approx(1 / (chosen.report.edge_contrast * chosen.report.edge_contrast)));
}

TEST_CASE("A mirrored or permuted image has a mirrored or permuted edge detector") {
    const Domain domain = cube_domain(11, kH, -3);
    const Function waves = random_waves(34, 2.0);
    const Function f = [&](const Vec3& x) { return 0.5 + 0.4 * waves(x); };
    const FloatGridPtr topology = topology_where(domain, everywhere);
    const DenseField values = sample(domain, f);
    const DenseField expected = to_dense(domain, *detect_edges(image_on(domain, f), *topology, options(kH, 5)).grid);
    for (const Symmetry& symmetry : all_symmetries()) {
        const DenseField moved = symmetry(values);
        const Function at_voxel = [&](const Vec3& x) {
            const Vec3 index = domain.world_to_index(x);
            return moved.at(int(std::lround(index[0])) + 3, int(std::lround(index[1])) + 3,
                            int(std::lround(index[2])) + 3);
        };
        const DenseField g =
            to_dense(domain, *detect_edges(image_on(domain, at_voxel), *topology, options(kH, 5)).grid);
        CHECK(max_difference(g, symmetry(expected)) < 1e-4);
    }
}

TEST_CASE("detect_edges(): g is bit-identical for 1, 2 and 8 threads") {
    const Domain domain = cube_domain(40, kH);
    const Function waves = random_waves(35, 2.0);
    const Image image = image_on(domain, waves);
    const FloatGridPtr topology = topology_where(domain, [](const Vec3& x) { return std::abs(length(x) - 6) < 1; });
    const auto run_with = [&](int threads) {
        RunContext run;
        run.threads = threads;
        EdgeOptions o;
        o.sigma = 2 * kH;
        return detect_edges(image, *topology, o, run).grid;
    };
    const FloatGridPtr one = run_with(1);
    for (const int threads : {2, 8}) {
        const FloatGridPtr other = run_with(threads);
        REQUIRE(other->activeVoxelCount() == one->activeVoxelCount());
        const auto accessor = other->getConstAccessor();
        for (auto v = one->cbeginValueOn(); v; ++v) REQUIRE(*v == accessor.getValue(v.getCoord()));
    }
}

TEST_CASE("detect_edges(): invalid options, a constant image and an empty band are rejected") {
    const Domain domain = cube_domain(10, kH);
    const Image image = image_on(domain, [](const Vec3& x) { return x[0]; });
    const Image constant = image_on(domain, [](const Vec3&) { return 7.0; });
    const FloatGridPtr topology = topology_where(domain, everywhere);
    EdgeOptions bad;
    bad.edge_k = -1;
    CHECK(edge_code([&] { (void)detect_edges(image, *topology, bad); }) == Errc::InvalidOptions);
    CHECK(edge_code([&] { (void)detect_edges(constant, *topology); }) == Errc::InvalidInput);
    CHECK(edge_code([&] { (void)detect_edges(image, *make_grid(domain, 1.0F, "band")); }) == Errc::InvalidInput);
}

// ---- lines ----------------------------------------------------------------------------------------------------------

namespace {

constexpr double kSheetAt = 0.4;  // not at the centres of voxels

/// The intensity of a bright sheet across x on a darker background: a Gaussian profile with a standard deviation of
/// 0.6.
double sheet(const Vec3& x) { return 0.2 + 0.6 * std::exp(-0.5 * (x[0] - kSheetAt) * (x[0] - kSheetAt) / 0.36); }

/// Positions on the sheet, and their normals.
MarkedFeature feature_on_sheet(const Image& image) {
    std::vector<Vec3> places, normals;
    for (double y = -4; y <= 4; y += 0.5)
        for (double z = -4; z <= 4; z += 0.5) {
            places.push_back({kSheetAt, y, z});
            normals.push_back({1, 0, 0});
        }
    return detect_feature(image, places, normals, 2.5);
}

}  // namespace

TEST_CASE("g of a line has its minimum in the middle of the line, g of a slope at its sides") {
    const Domain domain = cube_domain(40, kH);
    const Image bright = image_on(domain, sheet), dark = image_on(domain, [](const Vec3&x) { return 1 - sheet(x); });
    const FloatGridPtr band = topology_where(
        domain, [](const Vec3& x) { return std::abs(x[0]) < 4 && std::abs(x[1]) < 2 && std::abs(x[2]) < 2; });
    EdgeOptions o = options(0.5, 4);
    const auto minimum = [&](const Image& image, EdgeFeature feature) {
        o.feature = feature;
        const EdgeResult r = detect_edges(image, *band, o);
        double at = 0, value = 2;
        for (auto v = r.grid->cbeginValueOn(); v; ++v)
            if (*v < value) value = *v, at = r.grid->indexToWorld(v.getCoord())[0];
        return at;
    };
    CHECK(std::abs(minimum(bright, EdgeFeature::BrightLine) - kSheetAt) <= kH / 2);
    CHECK(std::abs(minimum(dark, EdgeFeature::DarkLine) - kSheetAt) <= kH / 2);
    CHECK(std::abs(minimum(bright, EdgeFeature::Slope) - kSheetAt) > kH / 2);
    CHECK(minimum(bright, EdgeFeature::Automatic) == minimum(bright, EdgeFeature::Slope));
    // For a line, s in g = 1 / (1 + K s^2) is the brightness itself, here without smoothing.
    o.feature = EdgeFeature::BrightLine;
    o.sigma = 0;
    const EdgeResult exact = detect_edges(bright, *band, o);
    CHECK(exact.report.feature == EdgeFeature::BrightLine);
    for (auto v = exact.grid->cbeginValueOn(); v; ++v) {
        const openvdb::Vec3d x = exact.grid->indexToWorld(v.getCoord());
        const double s = sheet({x[0], x[1], x[2]});
        REQUIRE(*v == Approx(1 / (1 + 4 * s * s)).epsilon(1e-5));
    }
}

TEST_CASE("The automatic contrast of lines is a third of the median brightness") {
    const Domain domain = cube_domain(40, kH);
    const FloatGridPtr band = topology_where(domain, [](const Vec3& x) { return length(x) < 5; });
    EdgeOptions o;
    o.intensities = {0, 1};
    o.sigma = 0.5;
    o.feature = EdgeFeature::BrightLine;
    // The sheet is oblique to the voxels. Otherwise whole layers of voxels would have the median as their value.
    const Image oblique = image_on(domain, [](const Vec3& x) {
        return sheet({x[0] + 0.13 * x[1] + 0.07 * x[2], x[1], x[2]});
    });
    const EdgeResult r = detect_edges(oblique, *band, o);
    std::int64_t above = 0;
    // At the median brightness, which is three times the contrast, g is 1 / (1 + 3^2) = 0.1. Half of the voxels are
    // brighter and therefore have a smaller g.
    for (auto v = r.grid->cbeginValueOn(); v; ++v) above += *v < 0.1;
    CHECK(double(above) / double(r.grid->activeVoxelCount()) == Approx(0.5).margin(0.01));
}

TEST_CASE("detect_feature: marks distinguish lines from borders, and noise counts as a border") {
    const Domain domain = cube_domain(40, kH);
    const MarkedFeature bright = feature_on_sheet(image_on(domain, sheet));
    CHECK(bright.feature == EdgeFeature::BrightLine);
    CHECK(bright.line == Approx(0.6).margin(0.05));
    CHECK(std::abs(bright.step) < 0.02);
    CHECK(feature_on_sheet(image_on(domain, [](const Vec3& x) { return 1 - sheet(x); })).feature ==
          EdgeFeature::DarkLine);
    const MarkedFeature border =
        feature_on_sheet(image_on(domain, [](const Vec3& x) { return x[0] > kSheetAt ? 0.2 : 0.9; }));
    CHECK(border.feature == EdgeFeature::Slope);
    CHECK(border.step == Approx(-0.35).margin(0.02));
    // A line at a border counts as a line if it is brighter than both sides.
    const auto both = [](double step) {
        return [step](const Vec3& x) { return sheet(x) + (x[0] > kSheetAt ? step : 0.0); };
    };
    CHECK(feature_on_sheet(image_on(domain, both(-0.2))).feature == EdgeFeature::BrightLine);
    CHECK(feature_on_sheet(image_on(domain, both(1.8))).feature == EdgeFeature::Slope);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> grey(0, 1);
    CHECK(feature_on_sheet(image_on(domain, [&](const Vec3&) { return grey(random); })).feature == EdgeFeature::Slope);
    CHECK(detect_feature(image_on(domain, sheet), {}, {}, 1).feature == EdgeFeature::Slope);
}

TEST_CASE("nth_values: the value of a rank is that in the sorted list") {
    std::mt19937 random(5);
    std::normal_distribution<float> normal(0.0F, 100.0F);
    for (const std::size_t count : {1, 2, 1000, 150'000}) {
        std::vector<float> values(count);
        for (float& v : values) v = random() % 4 == 0 ? std::round(normal(random)) : normal(random);
        std::vector<float> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        for (const double fraction : {0.0, 0.01, 0.3, 0.5, 0.999, 1.0}) {
            const auto n = std::size_t(fraction * double(count - 1));
            CAPTURE(count, fraction);
            CHECK(detail::nth_value(values, n) == sorted[n]);
        }
    }
}
