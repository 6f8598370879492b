// The arithmetic of the scheme on one leaf, compiled once for each instruction set (see lib/CMakeLists.txt).
// No header with inline functions may be included here: the linker would keep one copy of them for the whole
// program, perhaps the one with instructions that the processor lacks.
#include "detail/scheme.h"

#ifndef COVOL_SIMD_NAME
#error "set COVOL_SIMD_NAME for each compilation"
#endif

namespace covol::detail::COVOL_SIMD_NAME {
namespace {

constexpr int kI = 10 * kRow;  // stride of i in a padded buffer
constexpr int kJ = kRow;       // stride of j

// Inverse sums of a face's four tetrahedra.
struct FaceSums {
    float weight[8];  // Σ 1/√(ε²+|∇u_T|²)
    float norm[8];    // Σ |∇u_T|
};

// Tetrahedra p, q and one edge of the face between them, 8 faces at once. With u in voxels the derivatives are
// differences: along pq, along the edge, and from the face's centre to the edge (the mean of p and q is its value there).
template <typename P, typename Q, typename Z00, typename Z10, typename Z01, typename Z11>
inline void face_sums(P p, Q q, Z00 z00, Z10 z10, Z01 z01, Z11 z11, float epsilon2, FaceSums& out) {
    for (int k = 0; k < 8; ++k) {
        const float up = p(k), uq = q(k), a = z00(k), b = z10(k), c = z01(k), d = z11(k);
        const float along = (uq - up) * (uq - up);
        const float middle = up + uq;
        const float ab = (b - a) * (b - a) + (a + b - middle) * (a + b - middle) + along;
        const float cd = (d - c) * (d - c) + (c + d - middle) * (c + d - middle) + along;
        const float ac = (c - a) * (c - a) + (a + c - middle) * (a + c - middle) + along;
        const float bd = (d - b) * (d - b) + (b + d - middle) * (b + d - middle) + along;
        out.norm[k] = __builtin_sqrtf(ab) + __builtin_sqrtf(cd) + __builtin_sqrtf(ac) + __builtin_sqrtf(bd);
        out.weight[k] = 1.0F / __builtin_sqrtf(epsilon2 + ab) + 1.0F / __builtin_sqrtf(epsilon2 + cd) +
                        1.0F / __builtin_sqrtf(epsilon2 + ac) + 1.0F / __builtin_sqrtf(epsilon2 + bd);
    }
}

// Values at the 9^3 vertices: vertex (i,j,k) is the corner between voxels i-1 and i, and so on. Rows of 16.
constexpr int kVertexI = 9 * kRow;
struct Vertices {
    alignas(64) float z[9 * 9 * kRow];
};

void vertex_values(const float* u, Vertices& out) {
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) {
            const float* row = u + padded(i - 1, j - 1, -1);
            float* z = out.z + i * kVertexI + j * kRow;
            float column[kRow];
            for (int k = 0; k < 10; ++k) column[k] = (row[k] + row[k + kJ]) + (row[k + kI] + row[k + kI + kJ]);
            for (int k = 0; k < 9; ++k) z[k] = 0.125F * (column[k] + column[k + 1]);
        }
}

// What the faces of a leaf add up to.
struct Faces {
    alignas(64) float weight_i[9 * 64];      // face (i,j,k) between voxels i-1 and i
    alignas(64) float weight_j[8 * 9 * 8];   // (i,j,k), between j-1 and j
    alignas(64) float weight_k[64 * kRow];   // (i,j,k), between k-1 and k; rows of 16
    alignas(64) float norm[512];             // Σ_24 |∇u_T| of each voxel
};

inline void add(float* to, const float* what) {
    for (int k = 0; k < 8; ++k) to[k] += what[k];
}

void sum_faces(const float* u, const Vertices& vertices, float epsilon2, Faces& faces) {
    const float* z = vertices.z;
    for (float& n : faces.norm) n = 0.0F;
    FaceSums sums;
    const auto at = [](const float* row) { return [row](int k) { return row[k]; }; };
    for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 8; ++j) {
            const float* q = u + padded(i, j, 0);
            const float* v = z + i * kVertexI + j * kRow;
            face_sums(at(q - kI), at(q), at(v), at(v + kRow), at(v + 1), at(v + kRow + 1), epsilon2, sums);
            for (int k = 0; k < 8; ++k) faces.weight_i[(i * 8 + j) * 8 + k] = sums.weight[k];
            if (i > 0) add(faces.norm + ((i - 1) * 8 + j) * 8, sums.norm);
            if (i < 8) add(faces.norm + (i * 8 + j) * 8, sums.norm);
        }
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 9; ++j) {
            const float* q = u + padded(i, j, 0);
            const float* v = z + i * kVertexI + j * kRow;
            face_sums(at(q - kJ), at(q), at(v), at(v + kVertexI), at(v + 1), at(v + kVertexI + 1), epsilon2, sums);
            for (int k = 0; k < 8; ++k) faces.weight_j[(i * 9 + j) * 8 + k] = sums.weight[k];
            if (j > 0) add(faces.norm + (i * 8 + j - 1) * 8, sums.norm);
            if (j < 8) add(faces.norm + (i * 8 + j) * 8, sums.norm);
        }
    for (int i = 0; i < 8; ++i) {
        for (int j = 0; j < 8; ++j) {
            const float* q = u + padded(i, j, 0);
            const float* v = z + i * kVertexI + j * kRow;
            face_sums(at(q - 1), at(q), at(v), at(v + kVertexI), at(v + kRow), at(v + kVertexI + kRow), epsilon2, sums);
            float* norm = faces.norm + (i * 8 + j) * 8;
            for (int k = 0; k < 8; ++k) faces.weight_k[(i * 8 + j) * kRow + k] = sums.weight[k];
            add(norm, sums.norm);
            for (int k = 1; k < 8; ++k) norm[k - 1] += sums.norm[k];
        }
        // The ninth faces of eight rows make one more bundle; here the lanes run along j.
        const float* q = u + padded(i, 0, 8);
        const float* v = z + i * kVertexI + 8;
        const auto lane = [](const float* first) { return [first](int j) { return first[j * kRow]; }; };
        face_sums(lane(q - 1), lane(q), lane(v), lane(v + kVertexI), lane(v + kRow), lane(v + kVertexI + kRow), epsilon2,
                  sums);
        for (int j = 0; j < 8; ++j) {
            faces.weight_k[(i * 8 + j) * kRow + 8] = sums.weight[j];
            faces.norm[(i * 8 + j) * 8 + 7] += sums.norm[j];
        }
    }
}

// Rows q of a padded field around row (i,j), by Face.
struct Star {
    const float* p;
    const float* q[6];
    Star(const float* field, int i, int j) : p(field + padded(i, j, 0)) {
        q[kMinusI] = p - kI, q[kPlusI] = p + kI;
        q[kMinusJ] = p - kJ, q[kPlusJ] = p + kJ;
        q[kMinusK] = p - 1, q[kPlusK] = p + 1;
    }
};

inline float known_difference(float q, float p) { return (q >= 0.0F) & (p >= 0.0F) ? q - p : 0.0F; }

// velocity[f][k] = v_pq / h², Eqs. (17), (20).
inline void add_point_pull(const Star& phi, float theta, float velocity[6][8]) {
    for (int f = 0; f < 6; ++f)
        for (int k = 0; k < 8; ++k) velocity[f][k] -= theta * known_difference(phi.q[f][k], phi.p[k]);
}

inline void add_image_pull(const Star& g, const float* rho, float rho_all, float epsilon2, float velocity[6][8]) {
    float difference[6][8];
    float norm2[8] = {};
    for (int f = 0; f < 6; ++f)
        for (int k = 0; k < 8; ++k) {
            difference[f][k] = known_difference(g.q[f][k], g.p[k]);
            norm2[k] += 0.5F * difference[f][k] * difference[f][k];
        }
    float scale[8];
    for (int k = 0; k < 8; ++k)
        scale[k] = rho_all * (rho != nullptr ? rho[k] : 1.0F) / __builtin_sqrtf(epsilon2 + norm2[k]);
    for (int f = 0; f < 6; ++f)
        for (int k = 0; k < 8; ++k) velocity[f][k] -= scale[k] * difference[f][k];
}

float assemble(const float* u, const float* phi, const float* g, const float* rho, const unsigned long long* active,
               const SchemeConstants& constants, float* c) {
    Vertices vertices;
    vertex_values(u, vertices);
    Faces faces;
    sum_faces(u, vertices, constants.epsilon2, faces);

    float largest[8] = {};
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
            const int row = (i * 8 + j) * 8;
            const unsigned on = static_cast<unsigned>(active[i] >> (8 * j)) & 0xffU;
            if (on == 0) {
                for (int f = 0; f < 6; ++f)
                    for (int k = 0; k < 8; ++k) c[f * 512 + row + k] = 0.0F;
                continue;
            }
            float a[6][8] = {};  // -a_pq >= 0
            if (phi != nullptr) add_point_pull(Star(phi, i, j), constants.theta, a);
            if (g != nullptr)
                add_image_pull(Star(g, i, j), rho != nullptr ? rho + row : nullptr, constants.rho,
                               constants.edge_epsilon2, a);
            const float* weight[6] = {faces.weight_i + (i * 8 + j) * 8,     faces.weight_i + ((i + 1) * 8 + j) * 8,
                                      faces.weight_j + (i * 9 + j) * 8,     faces.weight_j + (i * 9 + j + 1) * 8,
                                      faces.weight_k + (i * 8 + j) * kRow, faces.weight_k + (i * 8 + j) * kRow + 1};
            float m[8], sum[8] = {};
            for (int k = 0; k < 8; ++k) {
                const float mean = faces.norm[row + k] * (1.0F / 24.0F);
                m[k] = 0.25F * constants.curvature * __builtin_sqrtf(constants.epsilon2 + mean * mean);
            }
            for (int f = 0; f < 6; ++f)
                for (int k = 0; k < 8; ++k) {
                    const float inflow = a[f][k] < 0.0F ? -a[f][k] : 0.0F;
                    a[f][k] = constants.tau * inflow + m[k] * weight[f][k];
                    sum[k] += a[f][k];
                }
            float scale[8];
            for (int k = 0; k < 8; ++k) {
                const float is_active = (on >> k) & 1U ? 1.0F : 0.0F;
                scale[k] = is_active / (1.0F + sum[k]);
                sum[k] *= is_active;
                largest[k] = sum[k] > largest[k] ? sum[k] : largest[k];
            }
            for (int f = 0; f < 6; ++f)
                for (int k = 0; k < 8; ++k) c[f * 512 + row + k] = a[f][k] * scale[k];
        }
    float result = 0.0F;
    for (const float l : largest) result = l > result ? l : result;
    return result;
}

// ω on the voxels of one colour of a row, 0 on the others.
struct Colours {
    alignas(32) float omega[2][8];
    explicit Colours(float w) {
        for (int k = 0; k < 8; ++k) omega[k & 1][k] = w, omega[~k & 1][k] = 0.0F;
    }
};

double relax(float* u, const float* b, const float* c, float omega, int inner) {
    const Colours colours(omega);
    float residual[8] = {};
    for (int sweep = 0; sweep < inner; ++sweep)
        for (int colour = 0; colour < 2; ++colour)
            for (int i = 0; i < 8; ++i)
                for (int j = 0; j < 8; ++j) {
                    float* p = u + padded(i, j, 0);
                    const int row = (i * 8 + j) * 8;
                    const float* w = colours.omega[(i + j + colour) & 1];
                    float change[8];
                    for (int k = 0; k < 8; ++k) {
                        const float old = b[row + k];
                        change[k] = (old - p[k]) + c[kMinusI * 512 + row + k] * (p[k - kI] - old) +
                                    c[kPlusI * 512 + row + k] * (p[k + kI] - old) +
                                    c[kMinusJ * 512 + row + k] * (p[k - kJ] - old) +
                                    c[kPlusJ * 512 + row + k] * (p[k + kJ] - old) +
                                    c[kMinusK * 512 + row + k] * (p[k - 1] - old) +
                                    c[kPlusK * 512 + row + k] * (p[k + 1] - old);
                    }
                    if (sweep == 0)
                        for (int k = 0; k < 8; ++k) residual[k] += (w[k] != 0.0F ? change[k] * change[k] : 0.0F);
                    for (int k = 0; k < 8; ++k) p[k] += w[k] * change[k];
                }
    double total = 0.0;
    for (const float r : residual) total += r;
    return total;
}

double heat(float* u, const float* b, float t, float omega, int inner) {
    const Colours colours(omega);
    const float scale = 1.0F / (1.0F + 6.0F * t);
    float residual[8] = {};
    for (int sweep = 0; sweep < inner; ++sweep)
        for (int colour = 0; colour < 2; ++colour)
            for (int i = 0; i < 8; ++i)
                for (int j = 0; j < 8; ++j) {
                    float* p = u + padded(i, j, 0);
                    const float* rhs = b + (i * 8 + j) * 8;
                    const float* w = colours.omega[(i + j + colour) & 1];
                    float change[8];
                    for (int k = 0; k < 8; ++k)
                        change[k] = scale * (rhs[k] + t * ((p[k - kI] + p[k + kI]) + (p[k - kJ] + p[k + kJ]) +
                                                           (p[k - 1] + p[k + 1]))) - p[k];
                    if (sweep == 0)
                        for (int k = 0; k < 8; ++k) residual[k] += (w[k] != 0.0F ? change[k] * change[k] : 0.0F);
                    for (int k = 0; k < 8; ++k) p[k] += w[k] * change[k];
                }
    double total = 0.0;
    for (const float r : residual) total += r;
    return total;
}

void mean_gradient(const float* u, float* out) {
    Vertices vertices;
    vertex_values(u, vertices);
    Faces faces;
    sum_faces(u, vertices, 1.0F, faces);
    for (int n = 0; n < 512; ++n) out[n] = faces.norm[n] * (1.0F / 24.0F);
}

#define COVOL_TEXT_(x) #x
#define COVOL_TEXT(x) COVOL_TEXT_(x)
}  // namespace

extern const SchemeKernels kKernels;
const SchemeKernels kKernels = {COVOL_TEXT(COVOL_SIMD_NAME), assemble, relax, heat, mean_gradient};

}  // namespace covol::detail::COVOL_SIMD_NAME
