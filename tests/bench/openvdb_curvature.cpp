// Mean curvature flow of a sphere: the time per active voxel and step of OpenVDB's LevelSetFilter, and of covol's
// evolve with theta = rho = 0. The two programs run in turns, so that changes of the machine's load affect both.
//
//   bench_curvature [--radius 100] [--steps 12] [--repetitions 3] [--threads T]
//
// A step of covol (delta = tau = 1 voxel) reduces the squared radius r² by 4 h². An iteration of OpenVDB is an explicit
// step of time h²/3, with a speed of half the sum of the principal curvatures: r² decreases by 2/3 h². One line of JSON
// goes to stdout.
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "covol/evolve.h"
#include "covol/mesh.h"
#include "support.h"

using namespace covol;

namespace {

struct Outcome {
    double ns = INFINITY, cpu_ns = INFINITY;  // nanoseconds per active voxel and step; minimum over the repetitions
    double voxels = 0;
    double radius = 0;  // radius of the ball with the same volume, in voxels

    void take(const bench::Stopwatch& watch, double voxel_steps) {
        ns = std::min(ns, 1e9 * watch.wall() / voxel_steps);
        cpu_ns = std::min(cpu_ns, 1e9 * watch.cpu() / voxel_steps);
    }
};

double radius_of(const FloatGrid& level_set) {
    return std::cbrt(measure(extract_mesh(level_set)).volume * 3 / (4 * std::numbers::pi));
}

FloatGridPtr sphere(double radius) {
    return openvdb::tools::createLevelSetSphere<FloatGrid>(float(radius), openvdb::Vec3f(0.0F), 1.0F, 3.0F);
}

void run_openvdb(double radius, int steps, Outcome& outcome) {
    const FloatGridPtr grid = sphere(radius);
    outcome.voxels = double(grid->activeVoxelCount());
    const bench::Stopwatch watch;
    openvdb::tools::LevelSetFilter<FloatGrid> filter(*grid);
    for (int step = 0; step < steps; ++step) filter.meanCurvature();
    outcome.take(watch, outcome.voxels * steps);
    outcome.radius = radius_of(*grid);
}

void run_covol(double radius, int steps, int threads, Outcome& outcome) {
    const FloatGridPtr grid = sphere(radius);
    EvolveOptions options;
    options.theta = options.rho = 0;
    options.delta = options.tau = 1;
    options.follow = true;
    options.tolerance = 0;
    options.max_steps = steps;
    RunContext run;
    run.threads = threads;
    const bench::Stopwatch watch;
    const EvolveReport report = evolve(*grid, {}, options, run);
    outcome.voxels = double(report.active_voxels);
    outcome.take(watch, outcome.voxels * steps);
    outcome.radius = radius_of(*extract_surface(*grid));
}

nlohmann::json to_json(const Outcome& outcome, double start, int steps, double shrinkage) {
    const double exact = std::sqrt(start * start - shrinkage * steps);
    return {{"ns_per_voxel_step", outcome.ns},
            {"cpu_ns_per_voxel_step", outcome.cpu_ns},
            {"active_voxels", outcome.voxels},
            {"radius_error", outcome.radius - exact},
            {"radius_moved", start - exact},
            // seconds in which r² decreases by 4 h², as in one step of covol
            {"seconds_per_unit", 1e-9 * outcome.ns * outcome.voxels * 4 / shrinkage}};
}

int run(const bench::Arguments& arguments) {
    const double radius = arguments.number("radius", 100);
    const int steps = int(arguments.number("steps", 12)), threads = int(arguments.number("threads", 2));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    constexpr double kCovolShrinkage = 4, kOpenvdbShrinkage = 2.0 / 3;
    Outcome ours, theirs;
    for (int repetition = 0; repetition < int(arguments.number("repetitions", 3)); ++repetition) {
        run_openvdb(radius, steps, theirs);
        run_covol(radius, steps, threads, ours);
    }
    std::cout << nlohmann::json{{"threads", threads},
                                {"steps", steps},
                                {"covol", to_json(ours, radius, steps, kCovolShrinkage)},
                                {"openvdb", to_json(theirs, radius, steps, kOpenvdbShrinkage)}}
              << '\n';
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    openvdb::initialize();
    return bench::run_program("bench_curvature", argc, argv, run);
}
