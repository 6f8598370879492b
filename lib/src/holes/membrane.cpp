#include "holes/membrane.h"

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "covol/error.h"

namespace covol::holes {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Positions = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Maximum number of times that the positions of the vertices are solved for, each time with the cotangents of the
// previous positions: Pinkall and Polthier, Computing discrete minimal surfaces, Exp. Math. 2(1), 1993. The iteration
// usually converges in fewer rounds.
constexpr int kMaxRounds = 20;
// Weights are limited to between this cotangent and its inverse, because triangles without area have no cotangents. The
// limits hardly affect the result, because such triangles contribute no area.
constexpr double kMinWeight = 1e-3;

/// Cotangent of the angle between two sides; 0 if they are parallel.
double cotangent(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const double across = u.cross(v).norm();
    return across > 1e-12 * u.norm() * v.norm() ? u.dot(v) / across : 0;
}

}  // namespace

void span_membrane(TriangleMesh& mesh, const std::vector<char>& fixed, const RunContext& run) {
    std::vector<int> number(mesh.vertices.size(), -1);
    int count = 0;
    for (std::size_t v = 0; v < number.size(); ++v)
        if (!fixed[v]) number[v] = count++;
    if (count == 0) return;
    Positions at(mesh.vertices.size(), 3);
    for (std::size_t v = 0; v < number.size(); ++v)
        for (int a = 0; a < 3; ++a) at(std::ptrdiff_t(v), a) = mesh.vertices[v][a];
    Eigen::SimplicialLDLT<Matrix> solver;
    for (int round = 0; round < kMaxRounds; ++round) {
        run.check();
        std::vector<Eigen::Triplet<double>> entries;
        Positions right = Positions::Zero(count, 3);
        double edges = 0, edge_count = 0;
        for (const auto& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
                if (fixed[a] && fixed[b]) continue;
                const Eigen::Vector3d tip = at.row(t[k]), u = at.row(a).transpose() - tip,
                                      v = at.row(b).transpose() - tip;
                // In the first round, all edges have the same weight. This distributes the vertices of the patch, which
                // may bulge at first, evenly before cotangents are used.
                const double w = round == 0 ? 1 : std::clamp(cotangent(u, v), kMinWeight, 1 / kMinWeight);
                edges += (u - v).norm();
                ++edge_count;
                for (const auto& [own, other] : {std::pair{a, b}, {b, a}}) {
                    if (fixed[own]) continue;
                    entries.emplace_back(number[own], number[own], w);
                    if (fixed[other])
                        right.row(number[own]) += w * at.row(other);
                    else
                        entries.emplace_back(number[own], number[other], -w);
                }
            }
        Matrix matrix(count, count);
        matrix.setFromTriplets(entries.begin(), entries.end());
        if (round == 0) solver.analyzePattern(matrix);
        solver.factorize(matrix);
        if (solver.info() != Eigen::Success)
            throw Error(Errc::Numerical, "a patch over a hole has no rim to be attached to");
        const Positions solved = solver.solve(right);
        double maximum = 0;
        for (std::size_t v = 0; v < number.size(); ++v) {
            if (number[v] < 0) continue;
            maximum = std::max(maximum, (solved.row(number[v]) - at.row(std::ptrdiff_t(v))).norm());
            at.row(std::ptrdiff_t(v)) = solved.row(number[v]);
        }
        if (maximum < kCommon.same_place * edges / edge_count) break;
    }
    for (std::size_t v = 0; v < number.size(); ++v)
        if (number[v] >= 0)
            for (int a = 0; a < 3; ++a) mesh.vertices[v][a] = float(at(std::ptrdiff_t(v), a));
}

}  // namespace covol::holes
