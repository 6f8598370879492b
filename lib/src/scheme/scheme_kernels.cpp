// The arithmetic of the scheme on one leaf, compiled once for each instruction set (see lib/CMakeLists.txt).
// No header with inline functions of external linkage may be included here: the linker would keep one copy of them for
// the whole program, perhaps the one with instructions that the processor lacks.
#include "scheme/scheme.h"
#include "scheme/simd.h"

#ifndef COVOL_SIMD_NAME
#error "set COVOL_SIMD_NAME for each compilation"
#endif

namespace covol::detail::COVOL_SIMD_NAME {
namespace {

constexpr int kI = 10 * kRow;  // stride of i in a padded buffer
constexpr int kJ = kRow;       // stride of j
constexpr float kTiny = 1e-30F, kFar = 1e30F;

/// Rows with an active voxel.
inline RowMask active_rows(const unsigned long long* active) {
    RowMask rows = 0;
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) rows |= RowMask((active[i] >> (8 * j) & 0xffU) != 0) << (8 * i + j);
    return rows;
}

constexpr int kVertexI = 9 * kRow;
/// Values at the 9^3 vertices, rows of 16: vertex (i,j,k) is the corner between voxels i-1 and i, and so on.
struct Vertices {
    alignas(64) float z[9 * 9 * kRow];
};

void vertex_values(const float* u, Vertices& out) {
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) {
            const float* row = u + padded(i - 1, j - 1, -1);
            float* z = out.z + i * kVertexI + j * kRow;
            const auto column = [row](int k) {
                return (load(row + k) + load(row + k + kJ)) + (load(row + k + kI) + load(row + k + kI + kJ));
            };
            store(z, 0.125F * (column(0) + column(1)));
            const auto scalar = [row](int k) { return (row[k] + row[k + kJ]) + (row[k + kI] + row[k + kI + kJ]); };
            z[8] = 0.125F * (scalar(8) + scalar(9));
        }
}

inline bool has_row(RowMask rows, int i, int j) {
    return ((unsigned(i) | unsigned(j)) & ~7U) == 0 && (rows >> (8 * i + j) & 1U) != 0;
}

/// Sums over a face's four tetrahedra, for 8 faces.
struct FaceSums {
    Lanes weight;  // Σ 1/√(ε²+|∇u_T|²)
    Lanes norm;    // Σ |∇u_T|
};

// A tetrahedron is p, q and one edge of the face between them. With u in voxels the derivatives are differences: along
// pq, along the edge, and from the face's centre, whose value is the mean of p and q, to the edge.
inline FaceSums face_sums(Lanes p, Lanes q, Lanes z00, Lanes z10, Lanes z01, Lanes z11, float epsilon2) {
    const Lanes along = (q - p) * (q - p);
    const Lanes middle = p + q;
    FaceSums sums{};
    const auto tetrahedron = [&](Lanes a, Lanes b) {
        const Lanes n = along + (b - a) * (b - a) + (a + b - middle) * (a + b - middle);
        sums.weight += inverse_sqrt(n + epsilon2);
        sums.norm += n * inverse_sqrt(n + kTiny);
    };
    tetrahedron(z00, z10);
    tetrahedron(z01, z11);
    tetrahedron(z00, z01);
    tetrahedron(z10, z11);
    return sums;
}

/// Sums over the faces of a leaf.
struct Faces {
    alignas(64) float weight_i[9 * 64];     // face (i,j,k) between voxels i-1 and i
    alignas(64) float weight_j[8 * 9 * 8];  // (i,j,k), between j-1 and j
    alignas(64) float weight_k[64 * kRow];  // (i,j,k), between k-1 and k; rows of 16
    alignas(64) float norm[512];            // Σ_24 |∇u_T| of each voxel
};

inline void add(float* to, Lanes what) { store(to, load(to) + what); }

// The faces across i or j of a row of eight voxels along k. `z` points to the first vertex of the row, and `edge` is
// the stride from there to the vertices at the faces' other side.
inline FaceSums row_face(const float* q, int across, const float* z, int edge, float epsilon2) {
    return face_sums(load(q - across), load(q), load(z), load(z + edge), load(z + 1), load(z + edge + 1), epsilon2);
}

// Computes the sums for the voxel rows in `rows` and for their faces only.
void sum_faces(const float* u, const Vertices& vertices, float epsilon2, RowMask rows, Faces& faces) {
    for (int row = 0; row < 64; ++row) store(faces.norm + row * 8, Lanes{});
    const auto voxel = [u](int i, int j) { return u + padded(i, j, 0); };
    const auto vertex = [&vertices](int i, int j) { return vertices.z + i * kVertexI + j * kRow; };
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 8; ++j) {
            if (!has_row(rows, i, j) && !has_row(rows, i - 1, j)) continue;
            const FaceSums sums = row_face(voxel(i, j), kI, vertex(i, j), kRow, epsilon2);
            store(faces.weight_i + (i * 8 + j) * 8, sums.weight);
            if (i > 0) add(faces.norm + ((i - 1) * 8 + j) * 8, sums.norm);
            if (i < 8) add(faces.norm + (i * 8 + j) * 8, sums.norm);
        }
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 9; ++j) {
            if (!has_row(rows, i, j) && !has_row(rows, i, j - 1)) continue;
            const FaceSums sums = row_face(voxel(i, j), kJ, vertex(i, j), kVertexI, epsilon2);
            store(faces.weight_j + (i * 9 + j) * 8, sums.weight);
            if (j > 0) add(faces.norm + (i * 8 + j - 1) * 8, sums.norm);
            if (j < 8) add(faces.norm + (i * 8 + j) * 8, sums.norm);
        }
    for (int i = 0; i < 8; ++i) {
        if ((rows >> (8 * i) & 0xffU) == 0) continue;
        for (int j = 0; j < 8; ++j) {
            if (!has_row(rows, i, j)) continue;
            const float* q = voxel(i, j);
            const float* z = vertex(i, j);
            const FaceSums sums = face_sums(load(q - 1), load(q), load(z), load(z + kVertexI), load(z + kRow),
                                            load(z + kVertexI + kRow), epsilon2);
            store(faces.weight_k + (i * 8 + j) * kRow, sums.weight);
            float* norm = faces.norm + (i * 8 + j) * 8;
            add(norm, sums.norm);
            for (int k = 1; k < 8; ++k) norm[k - 1] += sums.norm[k];
        }
        // A row of eight voxels has nine faces across k. The ninth faces of the eight rows with this i form one more
        // vector, whose lanes run along j.
        const float* q = voxel(i, 0) + 8;
        const float* z = vertex(i, 0) + 8;
        const auto lanes = [](const float* first) { return load_strided(first, kRow); };
        const FaceSums sums = face_sums(lanes(q - 1), lanes(q), lanes(z), lanes(z + kVertexI), lanes(z + kRow),
                                        lanes(z + kVertexI + kRow), epsilon2);
        for (int j = 0; j < 8; ++j) {
            faces.weight_k[(i * 8 + j) * kRow + 8] = sums.weight[j];
            faces.norm[(i * 8 + j) * 8 + 7] += sums.norm[j];
        }
    }
}

/// A row of a padded field and its six neighbours, by Face.
struct Star {
    Lanes p, q[6];
    Star(const float* field, int i, int j) {
        const float* row = field + padded(i, j, 0);
        p = load(row);
        q[kMinusI] = load(row - kI), q[kPlusI] = load(row + kI);
        q[kMinusJ] = load(row - kJ), q[kPlusJ] = load(row + kJ);
        q[kMinusK] = load(row - 1), q[kPlusK] = load(row + 1);
    }
    /// q - p, or 0 if either is unknown
    [[nodiscard]] Lanes difference(int face) const { return ((q[face] >= 0.0F) & (p >= 0.0F)) ? q[face] - p : Lanes{}; }
};

// Adds the attraction by points to velocity[f] = v_pq / h² for each face f; the next function adds that by the image.
// Eqs. (17), (20) of the paper (see docs/method.md).
inline void add_point_attraction(const Star& phi, float theta, Lanes velocity[6]) {
    for (int f = 0; f < 6; ++f) velocity[f] -= theta * phi.difference(f);
}

inline void add_image_attraction(const Star& g, Lanes rho, float epsilon2, Lanes velocity[6]) {
    Lanes difference[6];
    Lanes norm2 = Lanes{};
    for (int f = 0; f < 6; ++f) {
        difference[f] = g.difference(f);
        norm2 += 0.5F * difference[f] * difference[f];
    }
    const Lanes scale = rho * inverse_sqrt(norm2 + epsilon2);
    for (int f = 0; f < 6; ++f) velocity[f] -= scale * difference[f];
}

/// 1 if the bit of the lane is set, else 0.
inline Lanes lanes_of(unsigned bits) {
    constexpr LaneBits kBit = {1, 2, 4, 8, 16, 32, 64, 128};
    return ((LaneBits{} + int(bits)) & kBit) != 0 ? broadcast(1.0F) : Lanes{};
}

/// a * scale, rounded in the same way for all faces, which preserves symmetry. A row whose sum is rounded up to 1 or
/// more gets one unit less on each face.
inline void store_fractions(const Lanes a[6], Lanes scale, Fraction* c) {
    // Unsigned: fractions of values that are not finite may overflow, but are never used.
    UnsignedLanes fraction[6], total = UnsignedLanes{};
    for (int f = 0; f < 6; ++f) {
        fraction[f] = UnsignedLanes(__builtin_convertvector(a[f] * scale + 0.5F, LaneBits));
        total += fraction[f];
    }
    const LaneBits full = LaneBits(total) >= kFractionUnit;  // -1 if true
    for (int f = 0; f < 6; ++f) store(c + f * 8, LaneBits(fraction[f] + UnsignedLanes(full & (fraction[f] != 0))));
}

RowFacts assemble(const float* u, const float* phi, const float* g, const float* rho, const unsigned long long* active,
                  const SchemeConstants& constants, Fraction* c) {
    Vertices vertices;
    vertex_values(u, vertices);
    const RowMask rows = active_rows(active);
    Faces faces;
    sum_faces(u, vertices, constants.epsilon2, rows, faces);

    Lanes largest_sum = Lanes{}, residual = Lanes{};
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
            if (!has_row(rows, i, j)) continue;
            const int row = (i * 8 + j) * 8;
            const unsigned on = static_cast<unsigned>(active[i] >> (8 * j)) & 0xffU;
            Lanes a[6] = {};  // the velocities, then -a_pq >= 0
            if (phi != nullptr) add_point_attraction(Star(phi, i, j), constants.theta, a);
            if (g != nullptr)
                add_image_attraction(Star(g, i, j),
                                     constants.rho * (rho != nullptr ? load(rho + row) : broadcast(1.0F)),
                                     constants.edge_epsilon2, a);
            const float* weight[6] = {faces.weight_i + (i * 8 + j) * 8,    faces.weight_i + ((i + 1) * 8 + j) * 8,
                                      faces.weight_j + (i * 9 + j) * 8,    faces.weight_j + (i * 9 + j + 1) * 8,
                                      faces.weight_k + (i * 8 + j) * kRow, faces.weight_k + (i * 8 + j) * kRow + 1};
            const Lanes mean = load(faces.norm + row) * (1.0F / 24.0F);
            const Lanes m2 = constants.epsilon2 + mean * mean;
            const Lanes m = (0.25F * constants.curvature) * (m2 * inverse_sqrt(m2));
            Lanes row_sum = Lanes{}, pulls = Lanes{};
            const Star around(u, i, j);
            for (int f = 0; f < 6; ++f) {
                a[f] = constants.tau * max(-a[f], Lanes{}) + m * load(weight[f]);
                row_sum += a[f];
                pulls += a[f] * (around.q[f] - around.p);
            }
            const Lanes is_active = lanes_of(on);
            largest_sum = max(largest_sum, is_active * row_sum);
            const Lanes scale = is_active / (1.0F + row_sum);
            residual += (scale * pulls) * (scale * pulls);
            store_fractions(a, float(kFractionUnit) * scale, c + fraction_at(0, row));
        }
    return {largest(largest_sum), sum(residual)};
}

/// The equations of eight voxels along k: u_p = known + minus (u_{k-1} - old) + plus (u_{k+1} - old), where `old` is
/// u_p before the time step, and `known` contains the terms of the four other neighbours.
struct RowEquation {
    Lanes known, minus, plus, old;
    [[nodiscard]] Lanes value(Lanes before, Lanes after) const {
        return known + (minus * (before - old) + plus * (after - old));
    }
};

/// The rows of eight around row (i,j) of a leaf, across its faces too.
struct RowStar {
    const float *minus_i, *plus_i, *minus_j, *plus_j;
    RowStar(const LeafStar& u, int i, int j) {
        const float* row = u.inner + i * 64 + j * 8;
        minus_i = i > 0 ? row - 64 : u.across[kMinusI] + 7 * 64 + j * 8;
        plus_i = i < 7 ? row + 64 : u.across[kPlusI] + j * 8;
        minus_j = j > 0 ? row - 8 : u.across[kMinusJ] + i * 64 + 7 * 8;
        plus_j = j < 7 ? row + 8 : u.across[kPlusJ] + i * 64;
    }
};

// SOR in four colours: rows with i + j even, then odd, and within a row even k, then odd. It converges like red-black
// SOR, and the contributions of other rows to a row are summed once for both of its halves.
template <typename Equation>
inline double relax_rows(const LeafStar& u, RowMask rows, float omega, int inner, Equation equation) {
    const Lanes even = {1, 0, 1, 0, 1, 0, 1, 0};
    const Lanes odd = 1.0F - even;
    Lanes residual = Lanes{};
    for (int sweep = 0; sweep < inner; ++sweep)
        for (int colour = 0; colour < 2; ++colour)
            for (int i = 0; i < 8; ++i)
                for (int j = (i + colour) & 1; j < 8; j += 2) {
                    if (!has_row(rows, i, j)) continue;
                    const int at = (i * 8 + j) * 8;
                    const RowEquation row = equation(RowStar(u, i, j), at);
                    const Lanes now = load(u.inner + at);
                    const Lanes below = broadcast(u.across[kMinusK][at + 7]), above = broadcast(u.across[kPlusK][at]);
                    const Lanes first = even * (row.value(shifted_up(now, below), shifted_down(now, above)) - now);
                    const Lanes half = now + omega * first;
                    const Lanes second = odd * (row.value(shifted_up(half, below), shifted_down(half, above)) - half);
                    if (sweep == 0) residual += (first + second) * (first + second);
                    store(u.inner + at, half + omega * second);
                }
    return sum(residual);
}

double relax(const LeafStar& u, const float* b, const Fraction* c, const unsigned long long* active, float omega,
             int inner, const NextRows& next) {
    return relax_rows(u, active_rows(active), omega, inner, [b, c, next](const RowStar& beside, int row) {
        constexpr float kUnit = 1.0F / kFractionUnit;
        __builtin_prefetch(next.c + fraction_at(0, row));
        __builtin_prefetch(next.c + fraction_at(5, row));
        __builtin_prefetch(next.b + row);
        const Lanes old = load(b + row);
        const auto fraction = [fractions = c + fraction_at(0, row)](int face) {
            return load_fractions(fractions + face * 8);
        };
        const auto pull = [&](int face, const float* from) { return fraction(face) * (load(from) - old); };
        const Lanes pulls = (pull(kMinusI, beside.minus_i) + pull(kPlusI, beside.plus_i)) +
                            (pull(kMinusJ, beside.minus_j) + pull(kPlusJ, beside.plus_j));
        return RowEquation{old + kUnit * pulls, kUnit * fraction(kMinusK), kUnit * fraction(kPlusK), old};
    });
}

void mean_step(const LeafStar& u, const float* image, float fraction, float weight, float* out) {
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
            const int at = (i * 8 + j) * 8;
            const RowStar beside(u, i, j);
            const Lanes now = load(u.inner + at);
            const Lanes below = broadcast(u.across[kMinusK][at + 7]), above = broadcast(u.across[kPlusK][at]);
            const Lanes sum = (load(beside.minus_i) + load(beside.plus_i)) +
                              (load(beside.minus_j) + load(beside.plus_j)) +
                              (shifted_up(now, below) + shifted_down(now, above));
            store(out + at, fraction * load(image + at) + (weight * sum - load(out + at)));
        }
}

void mean_gradient(const float* u, float* out) {
    Vertices vertices;
    vertex_values(u, vertices);
    Faces faces;
    sum_faces(u, vertices, 1.0F, ~RowMask{0}, faces);
    for (int n = 0; n < 512; n += 8) store(out + n, load(faces.norm + n) * (1.0F / 24.0F));
}

/// The eikonal equation along one axis: the front comes from a position at which the distance is v, and which is 1/q
/// voxels away: a neighbour (q = 1), or a cut of the voxel's edge by the surface (v = 0, q >= 1).
struct Arrival {
    Lanes v, q;
};

inline void order(Arrival& a, Arrival& b) {
    const auto swap = a.v > b.v;
    const Arrival first = {swap ? b.v : a.v, swap ? b.q : a.q};
    b = {swap ? a.v : b.v, swap ? a.q : b.q};
    a = first;
}

/// The square root of x; 0 if x is not positive.
inline Lanes root_of(Lanes x) {
    const Lanes safe = max(x, Lanes{} + kTiny);
    return safe * inverse_sqrt(safe);
}

/// The distance x at which the fronts arrive: the solution x >= v of Σ q² (x - v)² = 1, in which the sum is over the
/// axes with v < x.
inline Lanes arrive(Arrival a, Arrival b, Arrival c) {
    order(a, b), order(b, c), order(a, b);
    const Lanes one = broadcast(1.0F);
    Lanes x = a.v + one / a.q;
    Lanes qq = a.q * a.q, qv = qq * a.v, vv = qv * a.v;
    const auto add_axis = [&](const Arrival& next) {
        const Lanes w = next.q * next.q;
        qq += w, qv += w * next.v, vv += w * next.v * next.v;
        const Lanes both = (qv + root_of(qv * qv - qq * (vv - one))) / qq;
        x = x > next.v ? both : x;
    };
    add_axis(b);
    // The axes are sorted by v: if the v of the second one is not below x, neither is that of the third.
    const Lanes limit = x;
    add_axis(c);
    x = limit > c.v ? x : limit;
    return x;
}

/// arrive() if the surface cuts no edge of the voxel: q is 1 along all axes. @param a, b, c  v of the three axes
inline Lanes arrive(Lanes a, Lanes b, Lanes c) {
    const Lanes lower = min(a, b), upper = max(a, b), first = min(lower, c);
    const Lanes second = max(lower, min(upper, c)) - first, third = max(upper, c) - first;
    const Lanes two = 0.5F * (second + root_of(2.0F - second * second));
    const Lanes limit = broadcast(1.0F) > second ? two : broadcast(1.0F);
    const Lanes both = second + third;
    const Lanes three = (1.0F / 3) * (both + root_of(both * both - 3.0F * (second * second + third * third - 1.0F)));
    return first + (limit > third ? three : limit);
}

// [voxels] If a value has decreased, a neighbour that is higher than it by less than this is not updated: the neighbour
// would decrease by less than the square of this.
constexpr float kDownwind = 0.02F;

RowMask eikonal(float* d, const float* cut, RowMask due, float tolerance) {
    const Lanes one = broadcast(1.0F);
    RowMask fell = 0;
    for (int order = 0; due != 0; ++order) {
        const bool up_i = (order & 1) == 0, up_j = (order & 2) == 0;
        for (int n = 0; n < 64; ++n) {
            const int i = up_i ? n >> 3 : 7 - (n >> 3), j = up_j ? n & 7 : 7 - (n & 7), at = 8 * i + j;
            if ((due >> at & 1U) == 0) continue;
            due &= ~(RowMask{1} << at);
            float* row = d + padded(i, j, 0);
            const float* q = cut + at * 8;
            const Lanes cut_i = load(q), cut_j = load(q + 512), cut_k = load(q + 1024);
            const bool is_cut = any((cut_i > 0.0F) | (cut_j > 0.0F) | (cut_k > 0.0F));
            const auto along = [&](Lanes cuts, Lanes minimum) {
                return Arrival{cuts > 0.0F ? Lanes{} : minimum, cuts > 0.0F ? cuts : one};
            };
            const Lanes min_i = min(load(row - kI), load(row + kI)), min_j = min(load(row - kJ), load(row + kJ));
            const Arrival ai = along(cut_i, min_i), aj = along(cut_j, min_j);
            const Lanes before = load(row), below = broadcast(row[-1]), above = broadcast(row[8]);
            Lanes now = before;
            // The values of a row depend on each other along k: the row is updated until none decreases any more.
            for (bool falls = true; falls;) {
                const Lanes min_k = min(shifted_up(now, below), shifted_down(now, above));
                const Arrival ak = along(cut_k, min_k);
                // No value decreases unless a neighbour is lower.
                if (!any(now > min(ai.v, min(aj.v, ak.v)))) break;
                const Lanes to = is_cut ? arrive(ai, aj, ak) : arrive(min_i, min_j, min_k);
                const LaneBits fall = now - to > tolerance;
                now = min(now, to);
                const Lanes fallen = fall ? now : broadcast(kFar);
                falls = any(now > min(shifted_up(fallen, broadcast(kFar)), shifted_down(fallen, broadcast(kFar))) +
                                      kDownwind);
            }
            store(row, now);
            const LaneBits fall = before - now > tolerance;
            if (!any(fall)) continue;
            fell |= RowMask{1} << at;
            const auto notify = [&](bool is_here, int stride, int shift) {
                if (is_here && any(fall & (load(row + stride) > now + kDownwind))) due |= RowMask{1} << (at + shift);
            };
            notify(i > 0, -kI, -8), notify(i < 7, kI, 8), notify(j > 0, -kJ, -1), notify(j < 7, kJ, 1);
        }
    }
    return fell;
}

inline Lanes absolute(Lanes x) { return max(x, -x); }

/// Calls visit(axis, q) for the six rows q beside a row, shifted by one voxel along each axis.
template <typename Visit>
inline void for_neighbours(const float* row, Visit visit) {
    visit(0, load(row - kI)), visit(0, load(row + kI));
    visit(1, load(row - kJ)), visit(1, load(row + kJ));
    visit(2, load(row - 1)), visit(2, load(row + 1));
}

void cut_edges(const float* u, float* cut) {
    constexpr float kMin = 1e-4F;  // [voxels] minimum of s, so that 1/s is finite
    const Lanes one = broadcast(1.0F);
    for (int row = 0; row < 64; ++row) {
        const float* at = u + padded(row >> 3, row & 7, 0);
        const Lanes p = load(at), size = absolute(p);
        Lanes maximum[3] = {};
        for_neighbours(at, [&](int axis, Lanes q) {
            const Lanes along = max(size / (size + absolute(q)), broadcast(kMin));
            maximum[axis] = max(maximum[axis], (q < 0.0F) != (p < 0.0F) ? one / along : Lanes{});
        });
        for (int axis = 0; axis < 3; ++axis) store(cut + axis * 512 + row * 8, maximum[axis]);
    }
}

void settle(const float* u, const float* d, float* out) {
    for (int row = 0; row < 64; ++row) {
        const int at = padded(row >> 3, row & 7, 0);
        const Lanes p = load(u + at), size = absolute(p), own = load(d + at);
        Lanes distances = own, values = size;
        LaneBits is_cut = LaneBits{};
        const auto add = [&](int stride) {
            const Lanes q = load(u + at + stride);
            const LaneBits differs = (q < 0.0F) != (p < 0.0F);
            is_cut |= differs;
            distances += differs ? load(d + at + stride) : Lanes{};
            values += differs ? absolute(q) : Lanes{};
        };
        add(-kI), add(kI), add(-kJ), add(kJ), add(-1), add(1);
        store(out + row * 8, (is_cut & (values > 0.0F)) ? size * distances / values : own);
    }
}

#define COVOL_TEXT_(x) #x
#define COVOL_TEXT(x) COVOL_TEXT_(x)
}  // namespace

extern const SchemeKernels kKernels;
const SchemeKernels kKernels = {
    COVOL_TEXT(COVOL_SIMD_NAME), assemble, relax, mean_step, mean_gradient, eikonal, cut_edges, settle};

}  // namespace covol::detail::COVOL_SIMD_NAME
