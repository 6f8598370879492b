#include "guess/variational.h"

#include <lbfgs.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "clip/clipped.h"
#include "covol/error.h"
#include "guess/dense_kernels.h"
#include "guess/triharmonic.h"

namespace covol::guess {
namespace {

using Eigen::Index;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Point = Eigen::Vector3d;

constexpr int kPolynomial = 4;  // number of the polynomials 1, x, y, z, whose energy is 0
constexpr double kLocalFractions[] = {0.5, 0.25, 0.125};
constexpr std::size_t kMinLocal = 4;  // minimum size of a neighbourhood: fewer marks lie in one plane
constexpr int kMaxSteps = 500;        // maximum number of L-BFGS iterations; it converges earlier
constexpr int kAmplitudeRounds = 3;  // number of estimates of the amplitude of f's covariance, which has then converged
constexpr int kDirections = 64;      // points on an ellipsoid around the marks; half or twice as many change no surface
constexpr double kMinLambda = 1e-9;  // minimum lambda, which keeps the matrix regular if marks coincide
// Sizes of the ellipsoids around the marks on which the sign of f is tested; one of size 1 passes through a mark.
constexpr double kAround[] = {1.15, 1.5};

/// Minimum-energy interpolation at fixed nodes: for given values, the energy as a function of the gradients g is g^T H
/// g + 2 c^T g + constant. energy() returns H, and linear() returns c and the constant.
class HermiteSystem {
public:
    /// @param nodes   in the unit ball; the first `marks` of them also have a gradient
    /// @param lambda  for each node, added to its element of the diagonal: see VariationalSurface
    HermiteSystem(const std::vector<Point>& nodes, Index marks, const Vector& lambda)
        : values_(Index(nodes.size())), gradients_(3 * marks), size_(values_ + gradients_), matrix_(size_, size_) {
        Matrix polynomials = Matrix::Zero(size_, kPolynomial);
        fill(nodes, marks);
        matrix_.diagonal().head(values_) += lambda;
        for (Index i = 0; i < values_; ++i) {
            polynomials(i, 0) = 1;
            polynomials.row(i).tail<3>() = nodes[std::size_t(i)];
        }
        for (Index i = 0; i < marks; ++i)
            for (int k = 0; k < 3; ++k) polynomials(values_ + 3 * i + k, 1 + k) = 1;
        // On the orthogonal complement of the polynomials the matrix is positive definite.
        qr_.compute(polynomials);
        Matrix projected = matrix_;
        projected.applyOnTheLeft(qr_.householderQ().adjoint());
        projected.applyOnTheRight(qr_.householderQ());
        const Index rest = size_ - kPolynomial;
        factor_ = projected.bottomRightCorner(rest, rest);
        if (!dense_kernels().cholesky(factor_.data(), rest))
            throw Error(
                Errc::Numerical,
                "guess: the equations for the marks have no unique solution; remove marks that nearly coincide");
        whiten();
    }

    [[nodiscard]] const Matrix& energy() const { return energy_; }
    /// The vector c of the energy for given values; `constant` receives the energy's constant.
    [[nodiscard]] Vector linear(const Vector& values, double& constant) const {
        Vector y = Vector::Zero(size_);
        y.head(values_) = values;
        Vector w = (qr_.householderQ().adjoint() * y).eval().tail(size_ - kPolynomial);
        factor_.triangularView<Eigen::Lower>().solveInPlace(w);
        constant = w.squaredNorm();
        return inverse_.triangularView<Eigen::Lower>().transpose() * w.tail(gradients_) -
               projection_.transpose() * (reflected_.transpose() * w);
    }
    /// Computes the weights of the basis functions and the coefficients of the polynomial that interpolate values and
    /// gradients.
    void weights(const Vector& values, const Vector& gradients, Vector& basis, Eigen::Vector4d& polynomial) const {
        Vector y(size_);
        y << values, gradients;
        Vector z = (qr_.householderQ().adjoint() * y).eval();
        z.head<kPolynomial>().setZero();
        auto rest = z.tail(size_ - kPolynomial);
        factor_.triangularView<Eigen::Lower>().solveInPlace(rest);
        factor_.triangularView<Eigen::Lower>().adjoint().solveInPlace(rest);
        basis = qr_.householderQ() * z;
        const Vector left = qr_.householderQ().adjoint() * (y - matrix_ * basis).eval();
        polynomial = qr_.matrixQR().topLeftCorner<kPolynomial, kPolynomial>().triangularView<Eigen::Upper>().solve(
            left.head<kPolynomial>());
    }
    [[nodiscard]] double log_determinant() const {
        double sum = 0;
        for (Index i = 0; i < factor_.rows(); ++i) sum += 2 * std::log(factor_(i, i));
        return sum;
    }
    [[nodiscard]] double freedom() const { return double(size_ - kPolynomial); }

private:
    /// The energy of gradients is |W g|^2, W = L^-1 (Q^T E)'. Q is the factor of the polynomials' QR decomposition,
    /// L the Cholesky factor of the matrix on their complement; E contains the gradients' unit vectors, ' removes the
    /// polynomials' rows. Q^T E = E - V T^T V^T E with Q's reflections V, so that W = [0; S] - X Y, S being the inverse
    /// of the gradients' corner of L, with X = L^-1 V' (four columns) and Y = T^T V^T E (four rows).
    void whiten() {
        const Index rest = size_ - kPolynomial;
        Matrix reflections = qr_.matrixQR();
        reflections.triangularView<Eigen::StrictlyUpper>().setZero();
        reflections.diagonal().setOnes();
        const Eigen::Matrix4d inner = inner_factor(reflections, qr_.hCoeffs());
        reflected_ = reflections.bottomRows(rest);
        factor_.triangularView<Eigen::Lower>().solveInPlace(reflected_);
        projection_ = inner.transpose() * reflections.bottomRows(gradients_).transpose();

        const auto triangle = factor_.bottomRightCorner(gradients_, gradients_);
        const DenseKernels& dense = dense_kernels();
        inverse_ = Matrix::Zero(gradients_, gradients_);
        energy_ = Matrix::Zero(gradients_, gradients_);
        constexpr Index kBlock = 64;
        const Index blocks = (gradients_ + kBlock - 1) / kBlock;
        const auto for_each_block = [&](const auto& body) {
            tbb::parallel_for(Index(0), blocks, [&](Index b) {
                body(b * kBlock, std::min(kBlock, gradients_ - b * kBlock), gradients_ - b * kBlock);
            });
        };
        for_each_block([&](Index from, Index count, Index below) {
            auto columns = inverse_.block(from, from, below, count);
            columns.topRows(count).setIdentity();
            dense.solve_lower(&triangle(from, from), below, rest, &columns(0, 0), count, gradients_);
        });
        const Matrix mixed = inverse_.transpose() * reflected_.bottomRows(gradients_);  // S^T X
        const Matrix outer = 0.5 * (reflected_.transpose() * reflected_) * projection_ - mixed.transpose();
        // The energy is S^T S + left^T right.
        Matrix left(2 * kPolynomial, gradients_), right(2 * kPolynomial, gradients_);
        left << projection_, outer;
        right << outer, projection_;
        for_each_block([&](Index from, Index count, Index below) {
            const auto add = [&](const Matrix& a, const Matrix& b, Index row, Index inner) {
                dense.add_transposed_product(&a(row, from), a.rows(), &b(row, from), b.rows(), inner,
                                             &energy_(from, from), below, count, gradients_);
            };
            add(inverse_, inverse_, from, below);
            add(left, right, 0, 2 * kPolynomial);
        });
        energy_.triangularView<Eigen::StrictlyUpper>() = energy_.transpose();
    }

    /// T of I - V T V^T, the product of the reflections along V's columns (Schreiber and Van Loan, A storage-efficient
    /// WY representation for products of Householder transformations, SIAM J. Sci. Stat. Comput. 10, 1989).
    static Eigen::Matrix4d inner_factor(const Matrix& reflections, const Vector& coefficients) {
        Eigen::Matrix4d inner = Eigen::Matrix4d::Zero();
        for (int k = 0; k < kPolynomial; ++k) {
            inner.col(k).head(k) = -coefficients[k] * (inner.topLeftCorner(k, k) *
                                                       (reflections.leftCols(k).transpose() * reflections.col(k)));
            inner(k, k) = coefficients[k];
        }
        return inner;
    }

    void fill(const std::vector<Point>& nodes, Index marks) {
        tbb::parallel_for(Index(0), values_, [&](Index j) {
            for (Index i = 0; i < values_; ++i) {
                const Point d = nodes[std::size_t(i)] - nodes[std::size_t(j)];
                const double r = d.norm();
                matrix_(i, j) = r * r * r;
                if (i < marks) matrix_.block<3, 1>(values_ + 3 * i, j) = 3 * r * d;
                if (j < marks) matrix_.block<1, 3>(i, values_ + 3 * j) = -3 * r * d.transpose();
                if (i >= marks || j >= marks) continue;
                Eigen::Matrix3d second = Eigen::Matrix3d::Identity() * r;
                if (r > 0) second += d * d.transpose() / r;
                matrix_.block<3, 3>(values_ + 3 * i, values_ + 3 * j) = -3 * second;
            }
        });
    }

    const Index values_, gradients_, size_;
    Matrix matrix_, energy_;
    Matrix inverse_, reflected_, projection_;  ///< S, X and Y of whiten()
    Eigen::HouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, kPolynomial>> qr_;
    Matrix factor_;  ///< L in its lower triangle
};

Vector unit_vectors(const Vector& y) {
    Vector unit = y;
    for (Index i = 0; i < y.size(); i += 3) {
        const double length = y.segment<3>(i).norm();
        unit.segment<3>(i) = length > 1e-12 ? Point(y.segment<3>(i) / length) : Point(Point::UnitX());
    }
    return unit;
}

/// The unit gradients to which the minimisation of the energy has converged from one initial value.
struct Gradients {
    Vector unit;
    double energy = std::numeric_limits<double>::infinity();
    bool closed = false;  ///< whether f has the same sign all around the marks, which thus bound a body
};

/// The problem of minimising g^T H g + 2 c^T g over the unit gradients g.
struct EnergyProblem {
    const Matrix& H;
    const Vector& c;
};

/// Callback of lbfgs(): returns the energy of the unit vectors along y; `derivative` receives its derivative with
/// respect to y.
double energy_of(void* instance, const double* y_values, double* derivative, int size, double /*step*/) {
    const auto& problem = *static_cast<const EnergyProblem*>(instance);
    const Eigen::Map<const Vector> y(y_values, size);
    Eigen::Map<Vector> out(derivative, size);
    const Vector unit = unit_vectors(y);
    Vector q(size);
    dense_kernels().times(problem.H.data(), size, unit.data(), q.data());
    const double energy = unit.dot(q) + 2 * problem.c.dot(unit);
    q += problem.c;
    for (int i = 0; i < size; i += 3) {
        const Point u = unit.segment<3>(i), g = 2 * q.segment<3>(i);
        out.segment<3>(i) = (g - u * u.dot(g)) / std::max(y.segment<3>(i).norm(), 1e-12);
    }
    return energy;
}

Gradients descend(const Matrix& H, const Vector& c, const Vector& first) {
    EnergyProblem problem{H, c};
    const int size = int(first.size());
    lbfgsfloatval_t* y = lbfgs_malloc(size);
    const Vector start = unit_vectors(first);
    std::copy(start.data(), start.data() + size, y);
    lbfgs_parameter_t parameter;
    lbfgs_parameter_init(&parameter);
    parameter.max_iterations = kMaxSteps;
    parameter.epsilon = 1e-5;
    parameter.past = 5;
    parameter.delta = 1e-6;
    lbfgs(size, y, nullptr, energy_of, nullptr, &problem,
          &parameter);  // the best point so far is used regardless of the return value
    Gradients found;
    found.unit = unit_vectors(Eigen::Map<const Vector>(y, size));
    lbfgs_free(y);
    found.energy = found.unit.dot(H * found.unit) + 2 * c.dot(found.unit);
    return found;
}

/// The matrix of an energy that is lower for gradients along the axes: see Constraints::axes.
Matrix with_axes(const Matrix& energy, const std::vector<Vec3>& axes) {
    Matrix result = energy;
    const double mean = energy.trace() / double(energy.rows());
    for (Index n = 0; n < Index(axes.size()); ++n) {
        const Vec3& axis = axes[std::size_t(n)];
        const Point a(axis[0], axis[1], axis[2]);
        result.block<3, 3>(3 * n, 3 * n) -= mean * a * a.transpose();
    }
    return result;
}

Expansion expansion(const HermiteSystem& system, const Vector& values, const Vector& gradients,
                    const std::vector<Point>& nodes) {
    Vector basis;
    Eigen::Vector4d polynomial;
    system.weights(values, gradients, basis, polynomial);
    Expansion f;
    const auto count = Index(nodes.size()), marks = gradients.size() / 3;
    for (Index n = 0; n < count; ++n) {
        const Point& p = nodes[std::size_t(n)];
        const Point b = n < marks ? Point(basis.segment<3>(count + 3 * n)) : Point(Point::Zero());
        f.x.push_back(p[0]), f.y.push_back(p[1]), f.z.push_back(p[2]);
        f.a.push_back(basis[n]);
        f.bx.push_back(b[0]), f.by.push_back(b[1]), f.bz.push_back(b[2]);
    }
    std::copy(polynomial.data(), polynomial.data() + kPolynomial, f.c);
    return f;
}

using Inside = std::function<bool(const Point& in_unit_ball)>;

/// Points on an ellipsoid with centre 0; if `times` is 1, it contains the first `marks` nodes.
std::vector<Point> ellipsoid_around(const std::vector<Point>& nodes, Index marks, double times) {
    // Scaled to a variance of 1 along each principal axis, the marks lie in a ball of radius `reach`, which is scaled
    // back to the ellipsoid.
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (Index n = 0; n < marks; ++n)
        spread += nodes[std::size_t(n)] * nodes[std::size_t(n)].transpose() / double(marks);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
    const Eigen::Matrix3d from_ball = axes.operatorSqrt(), to_ball = axes.operatorInverseSqrt();
    double reach = 0;
    for (Index n = 0; n < marks; ++n) reach = std::max(reach, (to_ball * nodes[std::size_t(n)]).norm());
    std::vector<Point> points;
    for (int n = 0; n < kDirections; ++n) {  // directions of a Fibonacci lattice on the sphere
        const double z = 1 - (2 * n + 1) / double(kDirections), phi = n * 2.399963229728653;
        const Point direction(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
        points.emplace_back(times * reach * (from_ball * direction));
    }
    return points;
}

/// Whether f has the same sign at all points of the ellipsoids around the marks; points outside the world are ignored.
bool has_one_sign_around(const std::vector<Point>& nodes, Index marks, const Expansion& f, const Inside& in_world) {
    constexpr double kNoStep[3] = {0, 0, 0};
    int positive = 0, count = 0;
    for (const double around : kAround)
        for (const Point& at : ellipsoid_around(nodes, marks, around)) {
            if (!in_world(at)) continue;
            double value = 0;
            f.row(at.data(), kNoStep, 1, &value);
            positive += value > 0;
            ++count;
        }
    return positive == 0 || positive == count;
}

/// For each mark the vector from the centroid of its neighbourhood, which are the `count` marks closest to it, itself
/// included, to the mark. It is along the normal if these marks are all around a tube or on both sides of a sheet.
Vector away_from_neighbours(const std::vector<Point>& nodes, Index marks, std::size_t count) {
    Vector directions(3 * marks);
    for (Index n = 0; n < marks; ++n) {
        std::vector<std::pair<double, Index>> others;
        for (Index m = 0; m < marks; ++m)
            others.emplace_back((nodes[std::size_t(m)] - nodes[std::size_t(n)]).squaredNorm(), m);
        std::partial_sort(others.begin(), others.begin() + std::ptrdiff_t(count), others.end());
        Point mean = Point::Zero();
        for (std::size_t k = 0; k < count; ++k) mean += nodes[std::size_t(others[k].second)] / double(count);
        directions.segment<3>(3 * n) = nodes[std::size_t(n)] - mean;
    }
    return directions;
}

/// Starting from several initial values, including `known` ones if there are any, returns the result of minimum energy.
/// Results with the same sign all around, far from the marks, are preferred, because only these bound a body.
Gradients min_energy(const HermiteSystem& system, const Matrix& energy, const Vector& values, const Vector& c,
                     const std::vector<Point>& nodes, Index marks, const Vector& outward,
                     const std::vector<Vector>& known, const Inside& in_world) {
    std::vector<Vector> initial_values{outward};
    initial_values.insert(initial_values.end(), known.begin(), known.end());
    for (std::size_t last = 0; const double fraction : kLocalFractions) {
        const std::size_t count = std::max(kMinLocal, std::size_t(fraction * double(marks)));
        if (count == last || count > std::size_t(marks)) continue;
        initial_values.push_back(away_from_neighbours(nodes, marks, last = count));
    }
    std::vector<Gradients> ends(initial_values.size());
    tbb::parallel_for(std::size_t(0), initial_values.size(), [&](std::size_t n) {
        Gradients& end = ends[n] = descend(energy, c, initial_values[n]);
        end.closed = has_one_sign_around(nodes, marks, expansion(system, values, end.unit, nodes), in_world);
    });
    Gradients best;
    for (const Gradients& end : ends) {
        const bool better = end.closed != best.closed ? end.closed : end.energy < best.energy;
        if (better || !std::isfinite(best.energy)) best = end;
    }
    return best;
}

Point to_point(const Vec3& v) { return {v[0], v[1], v[2]}; }

void check_spread(const std::vector<Vec3>& marks) {
    if (marks.size() < 4)
        throw Error(Errc::InvalidInput, "guess: expected at least 4 marks, got " + std::to_string(marks.size()));
    if (!span_space(marks))
        throw Error(Errc::InvalidInput, "guess: all " + std::to_string(marks.size()) +
                                            " marks lie in one plane, so they enclose nothing; mark a second slice");
}

}  // namespace

bool span_space(const std::vector<Vec3>& marks) {
    if (marks.size() < 4) return false;
    Point mean = Point::Zero();
    for (const Vec3& m : marks) mean += to_point(m) / double(marks.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vec3& m : marks) spread += (to_point(m) - mean) * (to_point(m) - mean).transpose();
    const Point axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
    // Below this ratio of the smallest to the largest variance along a principal axis, marks are coplanar.
    constexpr double kRounding = 1e-8;
    return axes[0] > kRounding * axes[2];
}

std::vector<Vec3> points_around(const std::vector<Vec3>& marks, double times) {
    Point middle = Point::Zero();
    for (const Vec3& m : marks) middle += to_point(m) / double(marks.size());
    std::vector<Point> nodes;
    for (const Vec3& m : marks) nodes.emplace_back(to_point(m) - middle);
    std::vector<Vec3> around;
    for (const Point& p : ellipsoid_around(nodes, Index(marks.size()), times))
        around.push_back({middle[0] + p[0], middle[1] + p[1], middle[2] + p[2]});
    return around;
}

void Expansion::negate() {
    for (std::vector<double>* weights : {&a, &bx, &by, &bz})
        for (double& w : *weights) w = -w;
    for (double& w : c) w = -w;
}

void Expansion::row(const double* from, const double* step, int count, double* values) const {
    const TriharmonicSum sum{x.data(), y.data(), z.data(), a.data(), bx.data(), by.data(), bz.data(), x.size()};
    for (int first = 0; first < count; first += kTriharmonicLanes) {
        double at[3][kTriharmonicLanes], total[kTriharmonicLanes];
        for (int l = 0; l < kTriharmonicLanes; ++l)
            for (int k = 0; k < 3; ++k) at[k][l] = from[k] + std::min(first + l, count - 1) * step[k];
        triharmonic_sum(sum, at[0], at[1], at[2], total);
        for (int l = 0; l < std::min(kTriharmonicLanes, count - first); ++l)
            values[first + l] = total[l] + c[0] + c[1] * at[0][l] + c[2] * at[1][l] + c[3] * at[2][l];
    }
}

VariationalSurface::VariationalSurface(const Constraints& given, const Normals& normals, Search search,
                                       double amplitude) {
    if (search == Search::Wide) check_spread(given.marks);  // the marks of a part of a surface may lie in a plane
    const auto marks = Index(given.marks.size()), count = marks + Index(given.seeds.size());
    for (const Vec3& m : given.marks)
        for (int a = 0; a < 3; ++a) center_[a] += m[a] / double(marks);
    radius_ = 0;
    std::vector<Point> nodes;
    for (const std::vector<Vec3>* list : {&given.marks, &given.seeds})
        for (const Vec3& m : *list) nodes.emplace_back(to_point(m) - to_point(center_));
    for (Index n = 0; n < marks; ++n) radius_ = std::max(radius_, nodes[std::size_t(n)].norm());
    for (Point& node : nodes) node /= radius_;

    Vector values = Vector::Zero(count), variance = Vector::Zero(count);
    for (Index n = 0; n < marks; ++n) variance[n] = given.variance[std::size_t(n)] / (radius_ * radius_);
    for (Index n = marks; n < count; ++n) values[n] = given.seed_value[std::size_t(n - marks)] / radius_;
    Vector before = Vector::Zero(3 * marks);  // Constraints::known_gradient, or 0 if there is no known function
    for (Index n = 0; n < Index(given.known_value.size()); ++n) {
        values[n] = -given.known_value[std::size_t(n)] / radius_;
        before.segment<3>(3 * n) = to_point(given.known_gradient[std::size_t(n)]);
    }

    const Inside in_world = [&](const Point& p) {
        return detail::depth_in(given.world, {center_[0] + radius_ * p[0], center_[1] + radius_ * p[1],
                                              center_[2] + radius_ * p[2]}) <= 0;
    };
    Vector outward(3 * marks);
    for (Index n = 0; n < marks; ++n) outward.segment<3>(3 * n) = nodes[std::size_t(n)];
    std::vector<Vector> known;
    for (const std::vector<Vec3>* directions : {&normals, &given.axes}) {
        if (directions->empty()) continue;
        known.emplace_back(3 * marks);
        for (Index n = 0; n < marks; ++n) known.back().segment<3>(3 * n) = to_point((*directions)[std::size_t(n)]);
    }

    double unit_amplitude = amplitude > 0 ? amplitude * radius_ : 1.0;
    Gradients found;
    const int rounds = amplitude > 0 ? 1 : kAmplitudeRounds;
    for (int round = 0; round < rounds; ++round) {
        const Vector lambda = (variance / unit_amplitude).cwiseMax(kMinLambda);
        const HermiteSystem system(nodes, marks, lambda);
        double constant = 0;
        const Vector c = system.linear(values, constant) - system.energy() * before;
        const Matrix energy = with_axes(system.energy(), given.axes);
        if (round > 0)
            found = descend(energy, c, found.unit);
        else
            found = search == Search::Wide
                        ? min_energy(system, energy, values, c, nodes, marks, outward, known, in_world)
                        : descend(energy, c, known.front());
        if (!given.axes.empty()) found.energy = found.unit.dot(system.energy() * found.unit) + 2 * c.dot(found.unit);
        if (round + 1 == rounds) f_ = expansion(system, values, found.unit - before, nodes);
        if (amplitude > 0) continue;
        unit_amplitude = std::max((found.energy + constant) / system.freedom(), 1e-12);
        log_likelihood_ = -0.5 * (system.log_determinant() + system.freedom() * std::log(unit_amplitude));
    }
    amplitude_ = unit_amplitude / radius_;
    // Without seeds, the outside is the unbounded side, on which f has to be positive.
    if (given.seeds.empty() && search == Search::Wide) {
        double far = 0;
        for (int corner = 0; corner < 8; ++corner)
            far += value({center_[0] + (corner & 4 ? 3 : -3) * radius_, center_[1] + (corner & 2 ? 3 : -3) * radius_,
                          center_[2] + (corner & 1 ? 3 : -3) * radius_});
        if (far < 0) f_.negate();
    }
}

double VariationalSurface::value(const Vec3& at) const {
    double result = 0;
    row(at, {0, 0, 0}, 1, &result);
    return result;
}

void VariationalSurface::row(const Vec3& from, const Vec3& step, int count, double* values) const {
    double start[3], along[3];
    for (int k = 0; k < 3; ++k) {
        start[k] = (from[k] - center_[k]) / radius_;
        along[k] = step[k] / radius_;
    }
    f_.row(start, along, count, values);
    for (int n = 0; n < count; ++n) values[n] *= radius_;
}

Vec3 VariationalSurface::gradient(const Vec3& at) const {
    const Point p = (to_point(at) - to_point(center_)) / radius_;
    Point sum(f_.c[1], f_.c[2], f_.c[3]);
    for (std::size_t n = 0; n < f_.x.size(); ++n) {
        const Point d = p - Point(f_.x[n], f_.y[n], f_.z[n]), b(f_.bx[n], f_.by[n], f_.bz[n]);
        const double r = d.norm();
        sum += 3 * r * f_.a[n] * d - 3 * r * b;
        if (r > 0) sum -= 3 * d * d.dot(b) / r;
    }
    return {sum[0], sum[1], sum[2]};
}

}  // namespace covol::guess
