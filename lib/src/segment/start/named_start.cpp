// The start that the caller specifies.
#include <openvdb/openvdb.h>

#include <numbers>
#include <utility>

#include "covol/error.h"
#include "covol/start.h"
#include "distance/memory_need.h"
#include "segment/doubts.h"
#include "segment/heuristics.h"
#include "segment/solve/fields.h"
#include "segment/start/starts.h"

namespace covol::pipeline {
namespace {

/// The area of the start if it is known in advance; else 0.
double known_area(const Start& start) {
    if (const auto* sphere = std::get_if<SphereStart>(&start))
        return 4 * std::numbers::pi * sphere->radius * sphere->radius;
    const auto* given = std::get_if<BoxStart>(&start);
    if (given == nullptr) return 0;
    Vec3 side;
    for (int a = 0; a < 3; ++a) side[a] = given->box.max[a] - given->box.min[a];
    return 2 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]);
}

struct GridOf {
    const Domain& domain;
    const RunContext& run;

    template <typename T>
    static const T& required(const std::shared_ptr<T>& value, const char* what) {
        if (value) return *value;
        throw Error(Errc::InvalidOptions, std::string("segment: expected a start with a ") + what + ", got none",
                    "init");
    }

    FloatGridPtr operator()(const SphereStart& s) const { return start_from_sphere(domain, s.center, s.radius); }
    FloatGridPtr operator()(const BoxStart& s) const { return start_from_box(domain, s.box); }
    FloatGridPtr operator()(const MeshStart& s) const { return start_from_mesh(domain, required(s.mesh, "mesh"), run); }
    FloatGridPtr operator()(const MaskStart& s) const { return start_from_mask(domain, required(s.mask, "mask"), run); }
    FloatGridPtr operator()(const LevelSetStart& s) const {
        return start_from_grid(domain, required(s.level_set, "level set"), run);
    }
    template <typename Marked>
    FloatGridPtr operator()(const Marked&) const {
        throw Error(Errc::InvalidOptions, "segment: expected a start that defines a grid by itself, such as a mesh",
                    "init");
    }
};

/// Whether a grid lies on a domain's lattice, regardless of its extent.
bool is_on_lattice(const FloatGrid& grid, const Domain& domain) {
    const Domain own = domain_of(grid);
    return own.voxel_size == domain.voxel_size && own.origin == domain.origin;
}

}  // namespace

FloatGridPtr start_grid(const Start& start, const Domain& domain, const RunContext& run) {
    return std::visit(GridOf{domain, run}, start);
}

StartSurface start_as_named(const Problem& problem, const Choices& choices, MarkSets marks) {
    const RunContext& run = problem.run;
    const Start& named = problem.options.start;
    StartSurface start = follow(StartOrigin::Given, choices, std::move(marks));
    StartFacts& facts = start.facts;
    const auto* level_set = std::get_if<LevelSetStart>(&named);
    const bool is_settled = level_set != nullptr && level_set->is_settled && problem.is_guided();
    facts.domain = choose_domain_of_flow(problem, choices.h, facts.marks.attracting);
    detail::require_band_memory(known_area(named), choices.h, "segment", run);
    {
        const Timed timed(facts.report.seconds.tag);
        if (is_settled && level_set->level_set && is_on_lattice(*level_set->level_set, facts.domain)) {
            facts.domain = domain_of(*level_set->level_set);  // the level set stays unchanged, bit for bit
            start.u = level_set->level_set->deepCopy();
        } else {
            start.u = start_grid(named, facts.domain, run);
        }
    }
    facts.border_inside = inside_on_border(problem, *start.u);
    const bool is_rough = is_any<SphereStart, BoxStart>(named);
    if (is_rough) grow_to_edges(problem, choices, start);
    if (is_settled && facts.marks.trusted.empty()) {
        facts.origin = StartOrigin::Settled;
        return start;
    }
    if (uses_points(facts.flow) && problem.is_guided() && !is_rough &&
        facts.marks.trusted.size() <= kAutomatic.max_guess_marks &&
        (is_settled || !misses_marks(problem, facts, *start.u))) {
        correct_start(problem, start);
        facts.on_surface = facts.marks.trusted;
        facts.origin = StartOrigin::Guess;
        facts.report.remarks.choose("start", "near its marks",
                                    "the start is used as a guess that the marks correct, and no flow is run", run);
        return start;
    }
    start.u = carried_beyond_turned_image(problem, facts.domain, start.u);
    start.distance = find_distance_for_flow(facts, *start.u, facts.report, run);
    return start;
}

}  // namespace covol::pipeline
