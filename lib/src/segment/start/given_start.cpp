// The start that the caller names.
#include <numbers>

#include "covol/compare.h"
#include "covol/error.h"
#include "covol/mesh_io.h"
#include "distance/memory_need.h"
#include "segment/automatic.h"
#include "segment/doubts.h"
#include "segment/fields.h"
#include "segment/heuristics.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

FloatGridPtr read_level_set(const std::string& path) {
    FloatGridPtr grid = read_solid(path).level_set;
    if (!grid) throw Error(Errc::InvalidInput, "segment: " + path + ": expected a .vdb file with a level set");
    return grid;
}

}  // namespace

FloatGridPtr start_grid(const Start& start, const Domain& domain, const RunContext& run) {
    switch (start.kind) {
        case Start::Kind::Sphere: return start_from_sphere(domain, start.center, start.radius);
        case Start::Kind::Box: return start_from_box(domain, start.box);
        case Start::Kind::Mesh: return start_from_mesh(domain, read_mesh(start.path), run);
        case Start::Kind::Mask:
            return start_from_mask(domain, start.mask ? *start.mask : read_image(start.path, {}, run), run);
        case Start::Kind::Vdb:
            return start_from_grid(domain, start.level_set ? *start.level_set : *read_level_set(start.path), run);
        case Start::Kind::Auto:
        case Start::Kind::Guess:
        case Start::Kind::Cloud:
        case Start::Kind::Tag: break;
    }
    throw Error(Errc::InvalidOptions, "segment: this start makes no grid of its own");
}

namespace {

/// Of the start, where it is known before it is made; else 0.
double known_area(const Start& start) {
    Vec3 side;
    for (int a = 0; a < 3; ++a) side[a] = start.box.max[a] - start.box.min[a];
    if (start.kind == Start::Kind::Sphere) return 4 * std::numbers::pi * start.radius * start.radius;
    return start.kind == Start::Kind::Box ? 2 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]) : 0.0;
}

}  // namespace

void start_as_given(Job& job) {
    job.origin = StartOrigin::Given;
    job.options.evolve.follow = true;
    choose_domain_of_flow(job);
    detail::require_band_memory(known_area(job.options.start), job.h(), "segment", job.run);
    {
        Timed timed(job.report().seconds.tag);
        job.result.u = start_grid(job.options.start, job.domain(), job.run);
    }
    note_border(job);
    const bool is_rough = job.options.start.kind == Start::Kind::Sphere || job.options.start.kind == Start::Kind::Box;
    if (is_rough) grow_to_edges(job);
    if (!job.uses_points()) return carry_beyond_turned_image(job);
    if (job.guided() && !is_rough && job.trusted.size() <= kAutomatic.most_guess_marks &&
        !misses_marks(job, *job.result.u)) {
        correct_start(job);
        job.on_surface = job.trusted;
        job.origin = StartOrigin::Guess;
        return job.choose("start", "near its marks", "it is a guess that they correct, and nothing flows");
    }
    carry_beyond_turned_image(job);
    find_distance(job, tube_for_start(job));
}

}  // namespace covol::pipeline
