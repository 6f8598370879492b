#include "inference/minimal_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace covol::inference {
namespace {

/// A row of nodes along x, and the steps in memory to its neighbouring rows.
struct Row {
    std::size_t begin;
    int count;
    bool has_y, has_z;      // whether there is a next row along that axis
    bool after_y, after_z;  // whether there is a previous row along that axis
    std::size_t step_y, step_z;
};

struct State {
    Field bar, px, py, pz;
    float scale[3];  // step tau, divided by the spacing along each axis
    float tau;
};

void ascend(const Row& row, const Field& weight, State& s) {
    const float* __restrict bar = s.bar.data() + row.begin;
    const float* __restrict w = weight.data() + row.begin;
    float* __restrict px = s.px.data() + row.begin;
    float* __restrict py = s.py.data() + row.begin;
    float* __restrict pz = s.pz.data() + row.begin;
    const float* __restrict next_y = bar + (row.has_y ? row.step_y : 0);
    const float* __restrict next_z = bar + (row.has_z ? row.step_z : 0);
    const auto at = [&](int i, float gx) {
        const float x = px[i] + s.scale[0] * gx, y = py[i] + s.scale[1] * (next_y[i] - bar[i]),
                    z = pz[i] + s.scale[2] * (next_z[i] - bar[i]);
        const float size = std::sqrt(x * x + y * y + z * z);
        const float shrink = size > w[i] ? w[i] / size : 1.0F;
        px[i] = x * shrink;
        py[i] = y * shrink;
        pz[i] = z * shrink;
    };
    const int last = row.count - 1;
    for (int i = 0; i < last; ++i) at(i, bar[i + 1] - bar[i]);
    at(last, 0.0F);
}

void descend(const Row& row, const Field& cost, State& s, Field& u) {
    const float* __restrict px = s.px.data() + row.begin;
    const float* __restrict py = s.py.data() + row.begin;
    const float* __restrict pz = s.pz.data() + row.begin;
    const float* __restrict c = cost.data() + row.begin;
    float* __restrict bar = s.bar.data() + row.begin;
    float* __restrict value = u.data() + row.begin;
    const float *before_y = py - (row.after_y ? row.step_y : 0), *before_z = pz - (row.after_z ? row.step_z : 0);
    const float with_y = row.after_y ? s.scale[1] : 0.0F, with_z = row.after_z ? s.scale[2] : 0.0F;
    const auto at = [&](int i, float before_x) {
        // In the last node along an axis the component of p along it is 0, because the difference to the next node is
        // set to 0.
        const float div = s.scale[0] * (px[i] - before_x) + s.scale[1] * py[i] - with_y * before_y[i] +
                          s.scale[2] * pz[i] - with_z * before_z[i];
        const float next = std::clamp(value[i] + div - s.tau * c[i], 0.0F, 1.0F);
        bar[i] = 2 * next - value[i];
        value[i] = next;
    };
    at(0, 0.0F);
    for (int i = 1; i < row.count; ++i) at(i, px[i - 1]);
}

constexpr int kCheckEvery = 25;
constexpr std::size_t kSteady = 20000;

/// Updates `side`, which is 1 at nodes with u > 1/2 and otherwise 0. @return number of nodes that have changed
std::size_t update_sides(const Field& u, std::vector<char>& side) {
    std::size_t changed = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
        const char now = u[n] > 0.5F ? 1 : 0;
        changed += std::size_t(now != side[n]);
        side[n] = now;
    }
    return changed;
}

}  // namespace

void minimize_surface(const Lattice& lattice, const Field& weight, const Field& cost, int iterations, Field& u,
                      const RunContext& run) {
    const std::size_t count = lattice.count();
    State s{u, Field(count, 0.0F), Field(count, 0.0F), Field(count, 0.0F), {}, 0};
    double squares = 0;
    for (int a = 0; a < 3; ++a) {
        const double h = lattice.spacing[a] / lattice.finest();
        squares += 4 / (h * h);
        s.scale[a] = float(1 / h);
    }
    s.tau = float(0.95 / std::sqrt(squares));
    for (float& x : s.scale) x *= s.tau;
    const auto row_of = [&](int j, int k) {
        return Row{lattice.node(0, j, k),
                   lattice.size[0],
                   j + 1 < lattice.size[1],
                   k + 1 < lattice.size[2],
                   j > 0,
                   k > 0,
                   std::size_t(lattice.size[0]),
                   std::size_t(lattice.size[0]) * std::size_t(lattice.size[1])};
    };
    const auto for_each_row = [&](const auto& visit) {
        tbb::parallel_for(0, lattice.size[2], [&](int k) {
            for (int j = 0; j < lattice.size[1]; ++j) visit(row_of(j, k));
        });
    };
    std::vector<char> side(count, 0);
    for (int n = 0; n < iterations; ++n) {
        if (n % kCheckEvery == 0) {
            run.check();
            const std::size_t changed = update_sides(u, side);
            if (n > 0 && changed * kSteady < count) break;
        }
        for_each_row([&](const Row& row) { ascend(row, weight, s); });
        for_each_row([&](const Row& row) { descend(row, cost, s, u); });
    }
}

}  // namespace covol::inference
