// The start that the caller names.
#include <numbers>
#include <utility>

#include "covol/compare.h"
#include "covol/error.h"
#include "covol/mesh_io.h"
#include "covol/start.h"
#include "distance/memory_need.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"
#include "segment/solve/fields.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

FloatGridPtr read_level_set(const std::string& path) {
    FloatGridPtr grid = read_solid(path).level_set;
    if (!grid) throw Error(Errc::InvalidInput, "segment: " + path + ": expected a .vdb file with a level set");
    return grid;
}

/// Of the start, where it is known before it is made; else 0.
double known_area(const Start& start) {
    Vec3 side;
    for (int a = 0; a < 3; ++a) side[a] = start.box.max[a] - start.box.min[a];
    if (start.kind == Start::Kind::Sphere) return 4 * std::numbers::pi * start.radius * start.radius;
    return start.kind == Start::Kind::Box ? 2 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]) : 0.0;
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

StartSurface start_as_named(const Problem& problem, const Choices& choices, MarkSets marks) {
    const RunContext& run = problem.run;
    const Start& named = problem.options.start;
    StartSurface start = follow(StartOrigin::Given, choices, std::move(marks));
    StartFacts& facts = start.facts;
    facts.domain = choose_domain_of_flow(problem, choices.h, facts.marks.attracting);
    detail::require_band_memory(known_area(named), choices.h, "segment", run);
    {
        const Timed timed(facts.report.seconds.tag);
        start.u = start_grid(named, facts.domain, run);
    }
    facts.border_inside = inside_on_border(problem, *start.u);
    const bool is_rough = named.kind == Start::Kind::Sphere || named.kind == Start::Kind::Box;
    if (is_rough) grow_to_edges(problem, choices, start);
    if (uses_points(facts.flow) && problem.is_guided() && !is_rough &&
        facts.marks.trusted.size() <= kAutomatic.most_guess_marks && !misses_marks(problem, facts, *start.u)) {
        correct_start(problem, start);
        facts.on_surface = facts.marks.trusted;
        facts.origin = StartOrigin::Guess;
        facts.report.remarks.choose("start", "near its marks", "it is a guess that they correct, and nothing flows",
                                    run);
        return start;
    }
    start.u = carried_beyond_turned_image(problem, facts.domain, start.u);
    start.distance = find_distance_for_flow(facts, *start.u, facts.report, run);
    return start;
}

}  // namespace covol::pipeline
