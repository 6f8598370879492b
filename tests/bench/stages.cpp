// Times per active voxel on 1 and 2 threads: of one time step of the solver, and of every other stage of a run. The
// environment variable COVOL_SIMD chooses the instruction set. Names of benchmarks are stage/threads.
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "counters.h"
#include "covol/band.h"
#include "covol/distance.h"
#include "covol/edge.h"
#include "covol/evolve.h"
#include "covol/phantom.h"
#include "covol/surface.h"
#include "covol/vdb_io.h"
#include "stopwatch.h"

namespace covol::bench {
namespace {

RunContext on(const benchmark::State& state) {
    RunContext run;
    run.threads = int(state.range(0));
    return run;
}

// ---- one time step ---------------------------------------------------------------------------------------------

constexpr float kRadius = 200, kHalfWidth = 7;  // voxels; 7 million voxels are active
constexpr int kFewSteps = 1, kManySteps = 6, kRounds = 3;

/// A grid with the active voxels of `like`, whose values are value(index, value of `like`).
template <typename Value>
FloatGridPtr field_on(const FloatGrid& like, Value value) {
    FloatGridPtr grid = like.deepCopy();
    std::vector<FloatGrid::TreeType::LeafNodeType*> leaves;
    grid->tree().getNodes(leaves);
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
        for (auto v = leaves[n]->beginValueOn(); v; ++v)
            v.setValue(static_cast<float>(value(v.getCoord().asVec3d(), *v)));
    });
    return grid;
}

struct Scene {
    FloatGridPtr u, distance, edge;
    Scene() {
        openvdb::initialize();
        const FloatGridPtr sphere =
            openvdb::tools::createLevelSetSphere<FloatGrid>(kRadius, openvdb::Vec3f(0.0F), 1.0F, kHalfWidth);
        using Position = openvdb::Vec3d;
        u = field_on(*sphere, [](const Position&, float d) { return std::clamp(d, -3.0F, 3.0F); });
        distance = field_on(*sphere, [](const Position&, float d) { return std::abs(d + 1.0F); });
        edge = field_on(*sphere,
                        [](const Position& x, float) { return 0.5 + 0.4 * std::sin(0.3 * (x[0] + x[1] - x[2])); });
    }
    static const Scene& get() {
        static const Scene scene;
        return scene;
    }
};

/// Measures a time step as the difference of two runs with different numbers of steps, which excludes setup and output.
/// Of each run, the fastest of several repetitions counts, because a slow short run would make steps appear fast. The
/// tolerance is 0, so that no leaf is skipped as steady.
/// @param solved_to  residual at which the linear solver ends, relative to that of the previous u
void time_step(benchmark::State& state, double solved_to) {
    const Scene& scene = Scene::get();
    EvolveOptions options;
    options.delta = 5;
    options.tau = 1;
    options.tolerance = 0;
    options.solver_tolerance = solved_to;
    struct Timed {
        EvolveReport report;
        double wall, cpu;
    };
    const auto timed = [&](int steps) {
        const FloatGridPtr u = scene.u->deepCopy();
        options.max_steps = steps;
        const Stopwatch watch;
        EvolveFields fields;
        fields.distance = scene.distance.get();
        fields.edge = scene.edge.get();
        const EvolveReport report = evolve(*u, fields, options, on(state));
        return Timed{report, watch.wall(), watch.cpu()};
    };
    EvolveReport few, many;
    double cpu = 0;
    for (auto _ : state) {
        Timed short_run = timed(kFewSteps), long_run = timed(kManySteps);
        for (int round = 1; round < kRounds; ++round) {
            for (Timed* best : {&short_run, &long_run}) {
                const Timed again = timed(best == &short_run ? kFewSteps : kManySteps);
                if (again.wall < best->wall) *best = again;
            }
        }
        state.SetIterationTime(long_run.wall - short_run.wall);
        cpu = long_run.cpu - short_run.cpu;
        few = short_run.report, many = long_run.report;
    }
    constexpr int kSteps = kManySteps - kFewSteps;
    const double voxels = double(many.active_voxels), leaf_voxels = 512.0 * double(many.leaf_count);
    const double visits = double(many.leaf_visits - few.leaf_visits) / double(many.leaf_count) / kSteps;
    // Bytes per voxel if each value is moved once, with 4 bytes per float and 12 for the six rows: assembly reads u,
    // the previous u, phi and edge, and writes the first estimate and the rows; a visit of the solver reads u, the
    // previous u and the rows, and writes u; the measurement of the motion reads u and the previous u.
    const double bytes = (4 * 4 + 4 + 12) + visits * (4 + 4 + 12 + 4) + 4 * 2;
    count_voxels(state, voxels * kSteps, bytes * leaf_voxels / voxels);
    state.counters["cpu_per_voxel"] =
        cpu / voxels / kSteps;  // the CPU time of the benchmark library would include both runs completely
    state.counters["visits"] = visits;
    state.counters["leaf_fill"] = voxels / leaf_voxels;
    state.counters["ns_assembly"] = 1e9 * (many.seconds_assembly - few.seconds_assembly) / voxels / kSteps;
    state.counters["ns_sweeps"] = 1e9 * (many.seconds_sweeps - few.seconds_sweeps) / voxels / kSteps;
}

// ---- the other stages, on the sphere phantom -------------------------------------------------------------------

constexpr int kPhantomSize = 260, kPoints = 40000;
constexpr double kTubeVoxels = 10, kTagVoxels = 4;

struct Phantoms {
    Phantom sphere;
    Domain domain;
    FloatGridPtr distance, band, surface;
    Phantoms() {
        PhantomOptions options;
        options.kind = "sphere";
        options.size = kPhantomSize;
        options.point_count = kPoints;
        sphere = make_phantom(options);
        domain = make_domain(sphere.image.geometry().world_box(), sphere.image.geometry().spacing[0]);
        distance = covol::compute_distance(sphere.points, domain, tube()).grid;
        band = covol::tag_interior(*distance, tagging()).grid;
        surface = covol::extract_surface(*band);
    }
    [[nodiscard]] DistanceOptions tube() const { return {kTubeVoxels * domain.voxel_size}; }
    [[nodiscard]] BandOptions tagging() const { return {kTagVoxels * domain.voxel_size, {}}; }
    static const Phantoms& get() {
        static const Phantoms phantoms;
        return phantoms;
    }
};

void distance_stage(benchmark::State& state) {
    const Phantoms& p = Phantoms::get();
    for (auto _ : state) benchmark::DoNotOptimize(compute_distance(p.sphere.points, p.domain, p.tube(), on(state)));
    count_voxels(state, double(p.distance->activeVoxelCount()));
}

void tag_stage(benchmark::State& state) {
    const Phantoms& p = Phantoms::get();
    for (auto _ : state) benchmark::DoNotOptimize(tag_interior(*p.distance, p.tagging(), on(state)));
    count_voxels(state, double(p.band->activeVoxelCount()));
}

void edge_stage(benchmark::State& state) {
    const Phantoms& p = Phantoms::get();
    for (auto _ : state) benchmark::DoNotOptimize(detect_edges(p.sphere.image, *p.band, {}, on(state)));
    count_voxels(state, double(p.band->activeVoxelCount()));
}

void surface_stage(benchmark::State& state) {
    const Phantoms& p = Phantoms::get();
    for (auto _ : state) benchmark::DoNotOptimize(extract_surface(*p.band, on(state)));
    count_voxels(state, double(p.surface->activeVoxelCount()));
}

void mesh_stage(benchmark::State& state) {
    const Phantoms& p = Phantoms::get();
    for (auto _ : state) benchmark::DoNotOptimize(extract_mesh(*p.surface, {}, on(state)));
    count_voxels(state, double(p.surface->activeVoxelCount()));
}

void write_stage(benchmark::State& state) {
    const Phantoms& p = Phantoms::get();
    const std::string path =
        std::filesystem::temp_directory_path() / ("covol_bench_" + std::to_string(::getpid()) + ".vdb");
    for (auto _ : state) with_threads(on(state), [&] { write_vdb(path, {p.surface}); });
    std::remove(path.c_str());
    count_voxels(state, double(p.surface->activeVoxelCount()));
}

bool register_all() {
    const auto add = [](const char* name, const std::function<void(benchmark::State&)>& stage) {
        auto* benchmark = benchmark::RegisterBenchmark((std::string("stage/") + name).c_str(), stage);
        benchmark->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
        return benchmark;
    };
    for (const auto& [name, solved_to] :
         {std::pair("time_step", 1e-3), {"time_step_default", EvolveOptions{}.solved_to()}})
        add(name, [to = solved_to](benchmark::State& state) { time_step(state, to); })->UseManualTime()->Iterations(1);
    add("distance", distance_stage)->UseRealTime();
    add("tag", tag_stage)->UseRealTime();
    add("edge", edge_stage)->UseRealTime();
    add("surface", surface_stage)->UseRealTime();
    add("mesh", mesh_stage)->UseRealTime();
    add("write", write_stage)->UseRealTime();
    return true;
}

const bool registered = register_all();

}  // namespace
}  // namespace covol::bench
