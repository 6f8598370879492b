#include "support/dense_reference.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace covol::test {
namespace {

double norm(const Gradient& g) { return std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]); }
double regularised(double x, double epsilon) { return std::sqrt(epsilon * epsilon + x * x); }

constexpr int kTrialSweeps = 500;  // number of sweeps after which over-relaxation is given up

using Matrix = std::array<std::array<double, 3>, 3>;

Matrix inverse(const Matrix& m) {
    Matrix r;
    double det = 0;
    for (int c = 0; c < 3; ++c)
        det += m[0][c] * (m[1][(c + 1) % 3] * m[2][(c + 2) % 3] - m[1][(c + 2) % 3] * m[2][(c + 1) % 3]);
    for (int row = 0; row < 3; ++row)
        for (int col = 0; col < 3; ++col) {
            const int a = (col + 1) % 3, b = (col + 2) % 3, c = (row + 1) % 3, d = (row + 2) % 3;
            r[row][col] = (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / det;
        }
    return r;
}

/// A tetrahedron next to a voxel's centre p, in units of h: its other corners are q and two vertices of their face.
struct Tetrahedron {
    std::array<int, 3> q;                      // offset in voxels
    std::array<std::array<int, 3>, 2> vertex;  // each component 0 or 1: the vertex at p + vertex - 1/2
    Matrix gradient;  // maps (u_q - u_p, u_a - u_p, u_b - u_p), a and b the vertices, to h ∇u
};

/// One tetrahedron for each of the four edges of each of the six faces. The gradient of the linear function through
/// four points solves (x_c - x_p) . ∇u = u_c - u_p for the three other corners c.
std::array<Tetrahedron, 24> make_tetrahedra() {
    std::array<Tetrahedron, 24> all;
    int l = 0;
    for (const auto& q : kFaces) {
        const int axis = q[0] != 0 ? 0 : q[1] != 0 ? 1 : 2;
        const int s = (axis + 1) % 3, t = (axis + 2) % 3;
        constexpr int around[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};  // the face's corners in cyclic order
        for (int edge = 0; edge < 4; ++edge) {
            Tetrahedron& tetrahedron = all[l++];
            tetrahedron.q = q;
            for (int end = 0; end < 2; ++end) {
                auto& vertex = tetrahedron.vertex[end];
                vertex[axis] = q[axis] > 0 ? 1 : 0;
                vertex[s] = around[edge + end][0];
                vertex[t] = around[edge + end][1];
            }
            Matrix corners;
            for (int c = 0; c < 3; ++c) {
                corners[0][c] = q[c];
                corners[1][c] = tetrahedron.vertex[0][c] - 0.5;
                corners[2][c] = tetrahedron.vertex[1][c] - 0.5;
            }
            tetrahedron.gradient = inverse(corners);
        }
    }
    return all;
}

const std::array<Tetrahedron, 24> kTetrahedra = make_tetrahedra();

/// The value at the vertex (i,j,k) - 1/2: the mean of the eight voxels around it.
double vertex_value(const DenseField& u, int i, int j, int k) {
    double sum = 0;
    for (int a = -1; a <= 0; ++a)
        for (int b = -1; b <= 0; ++b)
            for (int c = -1; c <= 0; ++c) sum += u.at(i + a, j + b, k + c);
    return sum / 8;
}

std::array<Gradient, 24> gradients_from(const DenseField& u, const double vertex[2][2][2], int i, int j, int k) {
    std::array<Gradient, 24> result;
    const double up = u.at(i, j, k);
    for (int l = 0; l < 24; ++l) {
        const Tetrahedron& t = kTetrahedra[l];
        const auto& [a, b] = t.vertex;
        const double difference[3] = {u.at(i + t.q[0], j + t.q[1], k + t.q[2]) - up, vertex[a[0]][a[1]][a[2]] - up,
                                      vertex[b[0]][b[1]][b[2]] - up};
        for (int c = 0; c < 3; ++c)
            result[l][c] = (t.gradient[c][0] * difference[0] + t.gradient[c][1] * difference[1] +
                            t.gradient[c][2] * difference[2]) /
                           u.h();
    }
    return result;
}

/// The values at all vertices of the domain, each once: vertex (i,j,k) of the result is the one at (i,j,k) - 1/2.
DenseField all_vertices(const DenseField& u) {
    DenseField z(u.nx() + 1, u.ny() + 1, u.nz() + 1, u.h());
    for (int i = 0; i <= u.nx(); ++i)
        for (int j = 0; j <= u.ny(); ++j)
            for (int k = 0; k <= u.nz(); ++k) z.at(i, j, k) = vertex_value(u, i, j, k);
    return z;
}

void vertices_of(const DenseField& z, int i, int j, int k, double vertex[2][2][2]) {
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b)
            for (int c = 0; c < 2; ++c) vertex[a][b][c] = z.at(i + a, j + b, k + c);
}

/// The factors M_p and W_pq of the curvature term, for a voxel p and its six faces.
struct Curvature {
    double m = 0;
    std::array<double, 6> w{};
};

Curvature curvature(const std::array<Gradient, 24>& gradients, const DenseOptions& options) {
    Curvature result;
    const double e2 = options.epsilon * options.epsilon;
    std::array<double, 24> inverse_norm;
    double mean = 0;
    for (int l = 0; l < 24; ++l) {
        const double g = norm(gradients[l]);
        inverse_norm[l] = 1 / std::sqrt(e2 + (options.printed.root ? g : g * g));
        mean += (options.printed.gradient_norm ? regularised(g, options.epsilon) : g) / 24;
    }
    result.m = regularised(mean, options.epsilon);
    for (int face = 0; face < 6; ++face) {
        const int first = 4 * face - (options.printed.last_sum && face == 5 ? 1 : 0);
        for (int l = first; l < first + 4; ++l) result.w[face] += inverse_norm[l] / 4;
    }
    return result;
}

double difference(const DenseField& field, std::size_t p, std::size_t q) {
    const double d = field[q] - field[p];
    return std::isnan(d) ? 0.0 : d;  // 0 if the field is unknown at p or q
}

bool inside(const DenseField& u, int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < u.nx() && j < u.ny() && k < u.nz();
}

std::array<std::array<int, 3>, 26> voxels_around() {
    std::array<std::array<int, 3>, 26> all;
    std::size_t n = 0;
    for (const auto& f : kFaces) all[n++] = f;
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            for (int k = -1; k <= 1; ++k)
                if (std::abs(i) + std::abs(j) + std::abs(k) > 1) all[n++] = {i, j, k};
    return all;
}

/// The 26 voxels around a voxel, the six of kFaces first.
const std::array<std::array<int, 3>, 26> kNeighbours26 = voxels_around();

std::vector<std::ptrdiff_t> offsets(const DenseField& u, bool all_26) {
    std::vector<std::ptrdiff_t> result;
    for (std::size_t q = 0; q < (all_26 ? kNeighbours26.size() : kFaces.size()); ++q)
        result.push_back(
            static_cast<std::ptrdiff_t>(u.index(kNeighbours26[q][0], kNeighbours26[q][1], kNeighbours26[q][2])) -
            static_cast<std::ptrdiff_t>(u.index(0, 0, 0)));
    return result;
}

/// The velocity v_pq of Eqs. (17) and (20). The ghosts of the fields are mirrored.
class Velocity {
public:
    Velocity(const DenseFields& fields, const DenseOptions& options, const std::vector<std::ptrdiff_t>& neighbour)
        : options_(options), neighbour_(neighbour) {
        if (fields.distance != nullptr) {
            distance_ = *fields.distance;
            potential_ = *fields.distance;
            for (std::size_t p = 0; p < potential_.size(); ++p)
                potential_[p] = attraction_potential(potential_[p], options.attraction_range);
            distance_.mirror_ghosts();
            potential_.mirror_ghosts();
        }
        if (fields.edge != nullptr) {
            edge_ = *fields.edge;
            edge_.mirror_ghosts();
        }
    }

    void at(std::size_t p, std::vector<double>& v) const {
        std::fill(v.begin(), v.end(), 0.0);
        if (options_.theta > 0) add_points(p, v);
        if (options_.rho > 0) add_image(p, v);
    }

private:
    void add_points(std::size_t p, std::vector<double>& v) const {
        for (std::size_t q = 0; q < v.size(); ++q) {
            const double sign = options_.printed.bottom_velocity && q == 5 ? -1 : 1;
            v[q] -= sign * options_.theta * potential_.h() * difference(potential_, p, p + neighbour_[q]);
        }
    }

    void add_image(std::size_t p, std::vector<double>& v) const {
        const double h = edge_.h();
        double square = 0;
        for (int q = 0; q < 6; ++q) {
            const double slope = difference(edge_, p, p + neighbour_[q]) / h;
            square += slope * slope / 2;
        }
        const double slope = regularised(std::sqrt(square), options_.edge_epsilon / h);
        double weight = options_.rho;
        if (distance_.size() > 0 && !std::isnan(distance_[p]))
            weight *= 1 - options_.image_yields * attraction_taper(distance_[p], options_.attraction_range);
        for (std::size_t q = 0; q < v.size(); ++q) v[q] -= weight * h * difference(edge_, p, p + neighbour_[q]) / slope;
    }

    const DenseOptions& options_;
    const std::vector<std::ptrdiff_t>& neighbour_;
    DenseField distance_, potential_, edge_;
};

}  // namespace

DenseField::DenseField(int nx, int ny, int nz, double h, double fill)
    : nx_(nx), ny_(ny), nz_(nz), h_(h), values_(static_cast<std::size_t>(nx + 2) * (ny + 2) * (nz + 2), fill) {}

void DenseField::mirror_ghosts() {
    for (int i = -1; i <= nx_; ++i)
        for (int j = -1; j <= ny_; ++j)
            for (int k = -1; k <= nz_; ++k)
                at(i, j, k) = at(std::clamp(i, 0, nx_ - 1), std::clamp(j, 0, ny_ - 1), std::clamp(k, 0, nz_ - 1));
}

std::array<Gradient, 24> tetrahedron_gradients(const DenseField& u, int i, int j, int k) {
    double vertex[2][2][2];
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b)
            for (int c = 0; c < 2; ++c) vertex[a][b][c] = vertex_value(u, i + a, j + b, k + c);
    return gradients_from(u, vertex, i, j, k);
}

double attraction_taper(double distance, double range) {
    if (range <= 0) return 1;
    const double t = std::clamp((distance - range / 2) / (range / 2), 0.0, 1.0);
    return 1 - 3 * t * t + 2 * t * t * t;
}

double attraction_potential(double distance, double range) {
    if (range <= 0) return distance;
    const double t = std::clamp((distance - range / 2) / (range / 2), 0.0, 1.0);
    return std::min(distance, range / 2) + range / 2 * (t - t * t * t + t * t * t * t / 2);
}

DenseSystem assemble(const DenseField& u, const std::vector<char>& active, const DenseFields& fields,
                     const DenseOptions& options) {
    DenseSystem system;
    system.neighbour = offsets(u, options.printed.neighbours);
    const double h = u.h();
    const double advection = options.tau / (h * h * h), diffusion = options.tau * options.delta / (h * h);
    const Velocity velocity(fields, options, system.neighbour);
    DenseField mirrored = u;
    mirrored.mirror_ghosts();
    const DenseField z = all_vertices(mirrored);
    std::vector<double> v(system.neighbour.size());
    for (int i = 0; i < u.nx(); ++i)
        for (int j = 0; j < u.ny(); ++j)
            for (int k = 0; k < u.nz(); ++k) {
                const std::size_t p = u.index(i, j, k);
                if (!active[p]) continue;
                velocity.at(p, v);
                double vertex[2][2][2];
                vertices_of(z, i, j, k, vertex);
                const Curvature c = curvature(gradients_from(mirrored, vertex, i, j, k), options);
                system.voxel.push_back(p);
                system.right_side.push_back(u[p]);
                for (std::size_t q = 0; q < v.size(); ++q) {
                    const bool flows =
                        inside(u, i + kNeighbours26[q][0], j + kNeighbours26[q][1], k + kNeighbours26[q][2]);
                    const double a = advection * std::min(v[q], 0.0) - (q < 6 ? diffusion * c.m * c.w[q] : 0.0);
                    system.a.push_back(flows ? a : 0.0);
                }
            }
    return system;
}

int solve(const DenseSystem& system, DenseField& u, const DenseOptions& options) {
    const std::size_t rows = system.voxel.size(), n = system.neighbour.size();
    std::vector<double> diagonal(rows, 1.0);
    double largest_value = 0;
    for (std::size_t row = 0; row < rows; ++row) {
        for (std::size_t q = 0; q < n; ++q) diagonal[row] -= system.a[row * n + q];
        largest_value = std::max(largest_value, std::abs(system.right_side[row]));
    }
    const double rounding = 1e-12 * largest_value;
    // The over-relaxation factor that is optimal for rows with regular diffusion. Rows at kinks of u have larger sums,
    // but they are few.
    const double row_sum = 4 * options.tau * options.delta / (u.h() * u.h()), jacobi = row_sum / (1 + row_sum);
    double omega = 2 / (1 + std::sqrt(1 - jacobi * jacobi));
    double first = 0;
    for (int sweep = 1; sweep <= options.max_sweeps; ++sweep) {
        double residual = 0;
        for (std::size_t row = 0; row < rows; ++row) {
            const std::size_t p = system.voxel[row];
            double r = system.right_side[row] - u[p];
            for (std::size_t q = 0; q < n; ++q) r -= system.a[row * n + q] * (u[p + system.neighbour[q]] - u[p]);
            const double correction = r / diagonal[row];
            u[p] += omega * correction;
            residual = std::max(residual, std::abs(correction));
        }
        if (sweep == 1) first = residual;
        if (residual <= std::max(options.solver_tolerance * first, rounding)) {
            u.mirror_ghosts();
            return sweep;
        }
        // Over-relaxation may diverge if advection dominates; Gauss-Seidel converges for every M-matrix.
        if (omega > 1 && (residual > 100 * first || sweep == kTrialSweeps)) {
            omega = 1;
            for (std::size_t row = 0; row < rows; ++row) u[system.voxel[row]] = system.right_side[row];
        }
    }
    return options.max_sweeps + 1;
}

double dense_evolve(DenseField& u, const std::vector<char>& active, const DenseFields& fields,
                    const DenseOptions& options, int steps) {
    double sweeps = 0;
    for (int step = 0; step < steps; ++step) {
        const int n = solve(assemble(u, active, fields, options), u, options);
        if (n > options.max_sweeps) throw std::runtime_error("dense_evolve: a solve does not converge");
        sweeps += n;
    }
    return steps > 0 ? sweeps / steps : 0;
}

std::vector<char> all_active(const DenseField& u) {
    std::vector<char> active(u.size(), 0);
    for (int i = 0; i < u.nx(); ++i)
        for (int j = 0; j < u.ny(); ++j)
            for (int k = 0; k < u.nz(); ++k) active[u.index(i, j, k)] = 1;
    return active;
}

void dense_heat(DenseField& image, double time, int steps) {
    DenseSystem system;
    system.neighbour = offsets(image, false);
    DenseOptions options;
    options.delta = 1;
    options.tau = time / steps;
    const double a = -options.tau / (image.h() * image.h());
    for (int i = 0; i < image.nx(); ++i)
        for (int j = 0; j < image.ny(); ++j)
            for (int k = 0; k < image.nz(); ++k) {
                system.voxel.push_back(image.index(i, j, k));
                for (const auto& f : kFaces) system.a.push_back(inside(image, i + f[0], j + f[1], k + f[2]) ? a : 0.0);
            }
    for (int step = 0; step < steps; ++step) {
        system.right_side.clear();
        for (const std::size_t p : system.voxel) system.right_side.push_back(image[p]);
        if (solve(system, image, options) > options.max_sweeps)
            throw std::runtime_error("dense_heat: a solve does not converge");
    }
}

DenseField dense_edge(const DenseField& image, double edge_k) {
    DenseField mirrored = image;
    mirrored.mirror_ghosts();
    DenseField g = image;
    for (int i = 0; i < g.nx(); ++i)
        for (int j = 0; j < g.ny(); ++j)
            for (int k = 0; k < g.nz(); ++k) {
                double s = 0;
                for (const Gradient& gradient : tetrahedron_gradients(mirrored, i, j, k)) s += norm(gradient) / 24;
                g.at(i, j, k) = 1 / (1 + edge_k * s * s);
            }
    g.mirror_ghosts();
    return g;
}

}  // namespace covol::test
