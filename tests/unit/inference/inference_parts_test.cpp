#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "inference/appearance.h"
#include "inference/lattice.h"
#include "inference/marks.h"
#include "inference/minimal_surface.h"

using namespace covol;
using namespace covol::inference;

namespace {

ImageGeometry geometry(const Index3& size, const Vec3& spacing) {
    ImageGeometry g;
    g.size = size;
    g.spacing = spacing;
    return g;
}

Lattice cube(int n, const Vec3& spacing = {1, 1, 1}) { return {{n, n, n}, {0, 0, 0}, spacing}; }

/// The energy of u: the sum of weight |grad u| + cost u over all nodes, with forward differences in double precision.
double energy(const Lattice& l, const Field& weight, const Field& cost, const Field& u) {
    double sum = 0;
    for (int k = 0; k < l.size[2]; ++k)
        for (int j = 0; j < l.size[1]; ++j)
            for (int i = 0; i < l.size[0]; ++i) {
                const std::size_t n = l.node(i, j, k);
                const int at[3] = {i, j, k};
                double square = 0;
                for (int a = 0; a < 3; ++a) {
                    if (at[a] + 1 >= l.size[a]) continue;
                    const std::size_t next = l.node(i + (a == 0), j + (a == 1), k + (a == 2));
                    const double slope = double(u[next] - u[n]) / (l.spacing[a] / l.finest());
                    square += slope * slope;
                }
                sum += double(weight[n]) * std::sqrt(square) + double(cost[n]) * double(u[n]);
            }
    return sum;
}

}  // namespace

TEST_CASE("A lattice has the voxels as nodes if these are few, and otherwise coarser nodes centred in the box") {
    const ImageGeometry g = geometry({40, 50, 20}, {1, 1, 2});
    const Lattice fine = cover(g, {3.5, 4, 2}, {30, 40, 30}, 1e6);
    CHECK(fine.spacing == Vec3{1, 1, 2});
    CHECK(fine.origin == Vec3{3, 4, 2});
    CHECK(fine.size == Index3{28, 37, 15});
    const Lattice coarse = cover(g, {3.5, 4, 2}, {30, 40, 30}, 1000);
    CHECK(coarse.count() <= 1000);
    CHECK(coarse.count() > 500);
    for (int a = 0; a < 2; ++a) {
        const double low[] = {3.5, 4}, high[] = {30, 40};
        const double last = coarse.origin[a] + (coarse.size[a] - 1) * coarse.spacing[a];
        CHECK(coarse.origin[a] - low[a] == Approx(high[a] - last).margin(1e-9));
    }
    const Lattice beyond = cover(g, {-10, -10, -10}, {100, 100, 100}, 1e6);
    CHECK(beyond.size == g.size);
}

TEST_CASE("Sampling gives voxel values on a fine lattice, and means close to a linear image on a coarse one") {
    const ImageGeometry g = geometry({31, 29, 17}, {1, 1, 2});
    std::vector<float> values;
    for (int k = 0; k < 17; ++k)
        for (int j = 0; j < 29; ++j)
            for (int i = 0; i < 31; ++i) values.push_back(float(2 * i - 3 * j + 5 * k));
    const Image image = Image::from_values(g, values.data());
    const Lattice fine = cover(g, {2, 3, 4}, {20, 20, 20}, 1e6);
    const Field same = sample(image, fine, {});
    for (std::size_t n = 0; n < same.size(); ++n) {
        const Vec3 p = fine.place_of(n);
        REQUIRE(double(same[n]) == 2 * p[0] - 3 * p[1] + 2.5 * p[2]);
    }
    const Lattice coarse = cover(g, {8, 8, 8}, {22, 20, 24}, 200);
    REQUIRE(coarse.spacing[0] > 1);
    const Field means = sample(image, coarse, {});
    for (std::size_t n = 0; n < means.size(); ++n) {
        const Vec3 p = coarse.place_of(n);
        REQUIRE(double(means[n]) == Approx(2 * p[0] - 3 * p[1] + 2.5 * p[2]).margin(0.5 * coarse.spacing[0]));
    }
    CHECK(coarse.value(means, coarse.place(2, 1, 1)) == Approx(double(means[coarse.node(2, 1, 1)])));
}

TEST_CASE("Signed distances on a lattice equal a brute-force search over all pairs of nodes") {
    const Lattice l = cube(9, {1, 1.5, 2});
    std::mt19937 random(3);
    std::vector<char> inside(l.count());
    for (char& c : inside) c = char(random() % 4 == 0);
    const Field found = signed_distance(l, inside);
    for (std::size_t n = 0; n < inside.size(); ++n) {
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t m = 0; m < inside.size(); ++m) {
            if (inside[m] == inside[n]) continue;
            const Vec3 a = l.place_of(n), b = l.place_of(m);
            nearest = std::min(nearest, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
        }
        REQUIRE(double(found[n]) == Approx((inside[n] != 0 ? -1 : 1) * (nearest - 0.5)));
    }
}

TEST_CASE("Connected parts: voxels are joined across faces, not across edges") {
    const Lattice l = cube(4);
    std::vector<char> inside(l.count());
    for (const auto& [i, j, k] : {std::array{0, 0, 0}, {1, 0, 0}, {2, 1, 0}, {3, 3, 3}}) inside[l.node(i, j, k)] = 1;
    const Parts parts = label_parts(l, inside);
    CHECK(parts.count == 3);
    CHECK(parts.number[l.node(0, 0, 0)] == parts.number[l.node(1, 0, 0)]);
    CHECK(parts.number[l.node(1, 0, 0)] != parts.number[l.node(2, 1, 0)]);
    CHECK(parts.number[l.node(3, 3, 2)] == 0);
}

TEST_CASE("Minimal surface: the sign of the cost decides without area weight, and a ball survives only if a R > 3") {
    const Lattice l = cube(33);
    Field cost(l.count()), weight(l.count(), 0.0F), u(l.count(), 0.5F);
    for (std::size_t n = 0; n < cost.size(); ++n) cost[n] = n % 3 == 0 ? -1.0F : 0.5F;
    minimize_surface(l, weight, cost, 300, u, {});
    for (std::size_t n = 0; n < u.size(); ++n) REQUIRE(u[n] == (n % 3 == 0 ? 1.0F : 0.0F));

    // The cost is -a in a ball of radius R and 1 elsewhere. The minimiser is this ball if a R > 3, because its cost -a
    // 4/3 pi R^3 then outweighs its surface 4 pi R^2; otherwise it is empty.
    const double radius = 10;
    for (const double gain : {0.2, 0.6}) {
        for (std::size_t n = 0; n < cost.size(); ++n) {
            const Vec3 p = l.place_of(n);
            cost[n] = float(std::hypot(p[0] - 16, p[1] - 16, p[2] - 16) < radius ? -gain : 1);
        }
        weight.assign(l.count(), 1.0F);
        u.assign(l.count(), 0.5F);
        minimize_surface(l, weight, cost, 600, u, {});
        double volume = 0;
        for (const float v : u) volume += v > 0.5F;
        INFO("gain " << gain);
        if (gain * radius < 3)
            CHECK(volume == 0);
        else
            CHECK(volume == Approx(4.0 / 3 * M_PI * radius * radius * radius).epsilon(0.05));
        // No ball of another radius has a smaller energy.
        const double minimum = energy(l, weight, cost, u);
        for (double r = 0; r < 14; r += 1) {
            Field ball(l.count());
            for (std::size_t n = 0; n < ball.size(); ++n) {
                const Vec3 p = l.place_of(n);
                ball[n] = std::hypot(p[0] - 16, p[1] - 16, p[2] - 16) < r ? 1.0F : 0.0F;
            }
            CHECK(minimum <= energy(l, weight, cost, ball) + 1);
        }
    }
}

TEST_CASE("Appearance: held-out bits are high for separable and low for equal classes, log odds are extrapolated") {
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    const auto samples = [&](float apart) {
        std::vector<Sample> all;
        for (int n = 0; n < 300; ++n) {
            Sample s;
            for (float& v : s.at) v = normal(random);
            s.inside = n % 2 == 0;
            s.fold = n % kFolds;
            // Voxels inside have a brightness between those of darker and brighter voxels outside, so that no linear
            // rule separates inside from outside.
            if (!s.inside)
                s.at[0] = (n % 4 == 1 ? apart : -apart) + 0.2F * normal(random);
            else
                s.at[0] = 0.2F * normal(random);
            all.push_back(s);
        }
        return all;
    };
    CHECK(held_out_bits(samples(2), kFolds) > 0.8);
    CHECK(held_out_bits(samples(0), kFolds) < 0.1);
    const std::vector<Sample> training = samples(2);
    const Appearance appearance(training);
    Features middle{}, off{}, far{};
    off[0] = 2;
    // Beyond the range of the samples, the log odds continue with the slope that they have at its end.
    far[0] = 100;
    CHECK(appearance.log_odds(middle) > 1);
    CHECK(appearance.log_odds(off) < -1);
    CHECK(appearance.log_odds(far) < -1);
    CHECK(appearance.log_odds(far) > 10 * appearance.log_odds(off));
}

TEST_CASE("Marks: order and duplicates do not matter, and the hull contains marks at the image's end") {
    const ImageGeometry g = geometry({50, 50, 50}, {1, 1, 1});
    std::vector<Vec3> world;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> uniform(10, 40);
    for (int n = 0; n < 200; ++n) world.push_back({uniform(random), uniform(random), uniform(random)});
    const Marks marks(g, world);
    CHECK(marks.spread.size() == 150);
    std::vector<Vec3> reversed(world.rbegin(), world.rend());
    reversed.push_back(world.front());  // duplicates count once
    CHECK(Marks(g, reversed).places == marks.places);
    CHECK(marks.above_hull({25, 25, 25}) < 0);
    CHECK(marks.above_hull({25, 25, 49}) > 5);
    world.push_back({25, 25, 49.4});
    CHECK(Marks(g, world).above_hull({25, 25, 49.4}) < 0);
    std::vector<std::size_t> kept, held_out;
    const Marks part = marks.without(2, g, kept, held_out);
    CHECK(kept.size() + held_out.size() == marks.places.size());
    CHECK(part.places.size() == kept.size());
    CHECK(part.spacing == marks.spacing);
}
