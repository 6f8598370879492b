// covol's scheme on every voxel of the image, in double precision, on one thread. Steps are those of the reference
// solver of the tests (support/dense_reference.h); the stop rule is that of covol. Benchmarks compare covol with it.
//
//   bench_dense --image I.nrrd --points P.xyz --radius R --edge-k K [--sigma V --delta V --tau V --range V]
//               [--octant 1] [--steps N | --max-steps N] [--mesh OUT.ply]
//
// The start is the signed distance to the sphere of radius R around the origin, clamped to 3 voxels. V is in voxels.
// --steps N makes N steps without the stop rule. --octant 1 solves only in the octant x, y, z > 0, an eighth of the
// work: the shapes are symmetric, and values are mirrored at the domain's boundary. One line of JSON goes to stdout.
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "covol/distance.h"
#include "covol/image.h"
#include "covol/points.h"
#include "support.h"

using namespace covol;
using test::DenseField;

namespace {

struct Problem {
    Domain domain;
    DenseField u, distance, edge;
    test::DenseOptions options;
};

DenseField dense_image(const Image& image, const Domain& domain, double low, double high) {
    const Index3 n = test::size_of(domain);
    DenseField field(n[0], n[1], n[2], domain.voxel_size);
    for (int i = 0; i < n[0]; ++i)
        for (int j = 0; j < n[1]; ++j)
            for (int k = 0; k < n[2]; ++k)
                field.at(i, j, k) = std::clamp(
                    (image.at(i + domain.min[0], j + domain.min[1], k + domain.min[2]) - low) / (high - low), 0.0, 1.0);
    field.mirror_ghosts();
    return field;
}

Problem make_problem(const bench::Arguments& arguments) {
    const Image image = read_image(arguments.text("image"));
    Problem p;
    p.domain = make_domain(image.geometry().world_box(), image.geometry().spacing[0]);
    if (arguments.number("octant", 0) != 0)
        for (int a = 0; a < 3; ++a) p.domain.min[a] += (p.domain.max[a] - p.domain.min[a] + 1) / 2;
    const double h = p.domain.voxel_size, radius = arguments.number("radius");
    p.options.theta = 1;
    p.options.rho = 1;
    p.options.delta = h * arguments.number("delta", 1);
    p.options.tau = h * arguments.number("tau", 1);
    p.options.epsilon = 0.01;
    p.options.edge_epsilon = 0.02;
    p.options.attraction_range = h * arguments.number("range", 5);
    p.options.solver_tolerance = 1e-3;

    p.u = test::sample(p.domain,
                       [&](const Vec3& x) { return test::clamp_to(test::length(x) - radius, kHalfWidthVoxels * h); });
    p.edge = dense_image(image, p.domain, arguments.number("low", 0), arguments.number("high", 255));
    const double sigma = h * arguments.number("sigma", 1), time = 0.5 * sigma * sigma;
    test::dense_heat(p.edge, time, std::max(1, int(std::ceil(time / (0.5 * h * h) - 1e-9))));
    p.edge = test::dense_edge(p.edge, arguments.number("edge-k"));
    // compute_distance() gives distances in a tube around the points, and a constant beyond it. Beyond attraction_range
    // the points' potential does not depend on the distance, so that the constant is sufficient there.
    const auto points = read_points(arguments.text("points")).points;
    p.distance =
        test::to_dense(p.domain, *compute_distance(points, p.domain, {p.options.attraction_range + 2 * h}).grid);
    return p;
}

/// covol's rule for a steady surface. It uses the smaller of two motions per step, in voxels: the mean motion of the
/// zero crossings along voxel edges, and the number of voxels that changed sign within ten steps, per area.
class StopRule {
public:
    explicit StopRule(double tolerance) : tolerance_(tolerance) {}

    bool is_steady(const DenseField& now, const DenseField& before, double tau_in_voxels) {
        const double motion = std::min(mean_motion(now, before), net_motion(now));
        last_ = motion;
        return motion < tolerance_ * tau_in_voxels;
    }
    [[nodiscard]] double last() const { return last_; }

private:
    static double crossing(double a, double b) { return a / (a - b); }

    double mean_motion(const DenseField& now, const DenseField& before) {
        const std::ptrdiff_t steps[3] = {step_to(now, 1, 0, 0), step_to(now, 0, 1, 0), step_to(now, 0, 0, 1)};
        double way = 0;
        edges_ = 0;
        for (int i = 0; i + 1 < now.nx(); ++i)
            for (int j = 0; j + 1 < now.ny(); ++j)
                for (int k = 0; k + 1 < now.nz(); ++k)
                    for (const std::ptrdiff_t step : steps) {
                        const std::size_t p = now.index(i, j, k), q = p + step;
                        const bool after = (now[p] < 0) != (now[q] < 0), first = (before[p] < 0) != (before[q] < 0);
                        if (!after && !first) continue;
                        ++edges_;
                        way +=
                            after && first ? std::abs(crossing(now[p], now[q]) - crossing(before[p], before[q])) : 0.5;
                    }
        return edges_ > 0 ? way / double(edges_) : 0;
    }

    double net_motion(const DenseField& now) {
        constexpr int kWindow = 10;
        constexpr double kCrossingsPerVoxel = 1.5;
        if (++age_ < kWindow && !negative_.empty()) return INFINITY;
        const bool is_first = negative_.empty();
        negative_.resize(now.size());
        std::size_t flips = 0;
        for (std::size_t p = 0; p < now.size(); ++p) {
            flips += negative_[p] != (now[p] < 0);
            negative_[p] = now[p] < 0;
        }
        age_ = 0;
        return is_first ? INFINITY : kCrossingsPerVoxel * double(flips) / double(edges_) / kWindow;
    }

    static std::ptrdiff_t step_to(const DenseField& u, int i, int j, int k) {
        return static_cast<std::ptrdiff_t>(u.index(i, j, k)) - static_cast<std::ptrdiff_t>(u.index(0, 0, 0));
    }

    double tolerance_, last_ = INFINITY;
    std::size_t edges_ = 0;
    std::vector<char> negative_;
    int age_ = 0;
};

int run(const bench::Arguments& arguments) {
    const bench::Stopwatch setup;
    Problem p = make_problem(arguments);
    const double setup_wall = setup.wall();
    const int fixed = int(arguments.number("steps", 0)),
              maximum = fixed > 0 ? fixed : int(arguments.number("max-steps", 500));
    const std::vector<char> active = test::all_active(p.u);
    StopRule rule(arguments.number("tolerance", 2e-3));
    const double tau_in_voxels = p.options.tau / p.domain.voxel_size;

    double wall = 0, cpu = 0, sweeps = 0;
    int steps = 0;
    bool steady = false;
    while (steps < maximum && !steady) {
        const DenseField before = p.u;
        const bench::Stopwatch watch;
        sweeps += test::dense_evolve(p.u, active, {&p.distance, &p.edge}, p.options, 1);
        wall += watch.wall();
        cpu += watch.cpu();
        ++steps;
        steady = fixed == 0 && rule.is_steady(p.u, before, tau_in_voxels);
    }
    if (!arguments.text("mesh", "").empty())
        bench::write_zero_level(arguments.text("mesh"), p.domain, p.u, kHalfWidthVoxels * p.domain.voxel_size);

    const double voxels = double(p.domain.voxel_count());
    std::cout << nlohmann::json{{"seconds_setup", setup_wall},
                                {"seconds_solve", wall},
                                {"cpu_solve", cpu},
                                {"steps", steps},
                                {"steady", steady},
                                {"sweeps_per_step", sweeps / steps},
                                {"voxels", voxels},
                                {"ns_per_voxel_step", 1e9 * wall / (voxels * steps)}}
              << '\n';
    return 0;
}

}  // namespace

int main(int argc, char** argv) { return bench::run_program("bench_dense", argc, argv, run); }
