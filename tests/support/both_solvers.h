#pragma once
#include <limits>
#include <vector>

#include "covol/evolve.h"
#include "support/dense_reference.h"
#include "support/shapes.h"

// One problem, solved by covol::evolve() and by the dense reference.
namespace covol::test {

struct Problem {
    Domain domain;
    DenseField u;  ///< the start, rounded() if both solvers are compared
    std::vector<char> active;
    DenseField distance;  ///< empty: none
    DenseField edge;      ///< empty: none
    DenseOptions options;
};

/// A cube whose voxels are all active, with the given start.
inline Problem whole_cube(int n, double h, const Function& u, int first = 0) {
    Problem p;
    p.domain = cube_domain(n, h, first);
    p.u = rounded(sample(p.domain, u));
    p.active = all_active(p.u);
    p.options.tau = h;
    return p;
}

inline void set_distance(Problem& p, const Function& d, double theta = 1.0) {
    p.distance = rounded(sample(p.domain, d));
    p.options.theta = theta;
}

inline void set_edge(Problem& p, const Function& g, double rho = 1.0) {
    p.edge = rounded(sample(p.domain, g));
    p.options.rho = rho;
}

inline DenseField run_dense(const Problem& p, int steps) {
    DenseField u = p.u;
    dense_evolve(u, p.active, {p.distance.size() > 0 ? &p.distance : nullptr, p.edge.size() > 0 ? &p.edge : nullptr},
                 p.options, steps);
    return u;
}

/// Options of evolve() for exactly `steps` steps, whose systems are solved far below float's precision.
inline EvolveOptions evolve_options(const DenseOptions& o, int steps) {
    EvolveOptions e;
    e.theta = o.theta;
    e.rho = o.rho;
    e.delta = o.delta;
    e.tau = o.tau;
    e.epsilon = o.epsilon;
    e.edge_epsilon = o.edge_epsilon;
    e.attraction_range = o.attraction_range;
    e.image_yields = o.image_yields;
    e.max_steps = steps;
    e.tolerance = 0;
    e.solver_tolerance = 1e-7;
    e.max_sweeps = 5000;
    return e;
}

inline FloatGridPtr start_of(const Problem& p) {
    return to_grid(p.domain, p.u, p.active, "u", static_cast<float>(3 * p.domain.voxel_size));
}

inline std::vector<char> known(const DenseField& field) {
    std::vector<char> on = all_active(field);
    for (std::size_t q = 0; q < on.size(); ++q) on[q] = on[q] && !std::isnan(field[q]);
    return on;
}

struct Fields {
    FloatGridPtr distance, edge;
    explicit Fields(const Problem& p) {
        if (p.distance.size() > 0) distance = to_grid(p.domain, p.distance, known(p.distance), "distance", 0.0F);
        if (p.edge.size() > 0) edge = to_grid(p.domain, p.edge, known(p.edge), "edge", 1.0F);
    }
    [[nodiscard]] EvolveFields get() const {
        EvolveFields f;
        f.distance = distance.get();
        f.edge = edge.get();
        return f;
    }
};

inline FloatGridPtr run_evolve_grid(const Problem& p, const EvolveOptions& options, int threads = 2) {
    const FloatGridPtr u = start_of(p);
    RunContext run;
    run.threads = threads;
    evolve(*u, Fields(p).get(), options, run);
    return u;
}

inline DenseField run_evolve(const Problem& p, int steps, int threads = 2) {
    return to_dense(p.domain, *run_evolve_grid(p, evolve_options(p.options, steps), threads));
}

using Solver = DenseField (*)(const Problem& p, int steps);
inline DenseField by_evolve(const Problem& p, int steps) { return run_evolve(p, steps); }

}  // namespace covol::test
