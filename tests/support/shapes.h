#pragma once
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "covol/domain.h"
#include "support/dense_reference.h"

// Test fields: grids from functions of the position, their dense copies, and distances between zero level sets.
namespace covol::test {

using Function = std::function<double(const Vec3&)>;  ///< of the world position

inline double length(const Vec3& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }
inline double distance(const Vec3& a, const Vec3& b) { return length({a[0] - b[0], a[1] - b[1], a[2] - b[2]}); }
inline double clamp_to(double value, double width) { return std::clamp(value, -width, width); }

/// A cube of n voxels of edge h, centred on the origin; its first voxel has the index (first, first, first).
inline Domain cube_domain(int n, double h, int first = 0) {
    Domain d;
    d.voxel_size = h;
    for (int a = 0; a < 3; ++a) {
        d.min[a] = first;
        d.max[a] = first + n - 1;
        d.origin[a] = -h * (first + (n - 1) / 2.0);
    }
    return d;
}

inline Index3 size_of(const Domain& d) {
    return {d.max[0] - d.min[0] + 1, d.max[1] - d.min[1] + 1, d.max[2] - d.min[2] + 1};
}

/// visit(i, j, k, world) for each voxel; i, j, k count from the domain's first voxel.
template <typename Visit>
void for_each_voxel(const Domain& d, const Visit& visit) {
    const Index3 n = size_of(d);
    for (int i = 0; i < n[0]; ++i)
        for (int j = 0; j < n[1]; ++j)
            for (int k = 0; k < n[2]; ++k)
                visit(i, j, k, d.index_to_world({double(d.min[0] + i), double(d.min[1] + j), double(d.min[2] + k)}));
}

inline openvdb::Coord coord(const Domain& d, int i, int j, int k) { return {d.min[0] + i, d.min[1] + j, d.min[2] + k}; }

inline DenseField sample(const Domain& d, const Function& f) {
    const Index3 n = size_of(d);
    DenseField field(n[0], n[1], n[2], d.voxel_size);
    for_each_voxel(d, [&](int i, int j, int k, const Vec3& x) { field.at(i, j, k) = f(x); });
    field.mirror_ghosts();
    return field;
}

/// The values rounded to float, as in covol's grids: the same start for a comparison.
inline DenseField rounded(DenseField field) {
    for (std::size_t p = 0; p < field.size(); ++p) field[p] = static_cast<float>(field[p]);
    return field;
}

/// 1 at the voxels for which keep(world position) is true, else 0, in the form that dense_evolve() takes.
inline std::vector<char> active_where(const Domain& d, const DenseField& shape,
                                      const std::function<bool(const Vec3&)>& keep) {
    std::vector<char> active(shape.size(), 0);
    for_each_voxel(d, [&](int i, int j, int k, const Vec3& x) { active[shape.index(i, j, k)] = keep(x) ? 1 : 0; });
    return active;
}

/// Every voxel of the domain gets its value, but only those in `active` are active; NaN is never active.
inline FloatGridPtr to_grid(const Domain& d, const DenseField& field, const std::vector<char>& active, const char* name,
                            float background) {
    FloatGridPtr grid = make_grid(d, background, name);
    auto accessor = grid->getAccessor();
    for_each_voxel(d, [&](int i, int j, int k, const Vec3&) {
        const double value = field.at(i, j, k);
        if (std::isnan(value)) return;
        if (active[field.index(i, j, k)])
            accessor.setValueOn(coord(d, i, j, k), static_cast<float>(value));
        else
            accessor.setValueOff(coord(d, i, j, k), static_cast<float>(value));
    });
    return grid;
}

inline FloatGridPtr to_grid(const Domain& d, const DenseField& field, const char* name, float background = 0.0F) {
    return to_grid(d, field, all_active(field), name, background);
}

inline DenseField to_dense(const Domain& d, const FloatGrid& grid) {
    const auto accessor = grid.getConstAccessor();
    const Index3 n = size_of(d);
    DenseField field(n[0], n[1], n[2], d.voxel_size);
    for_each_voxel(d,
                   [&](int i, int j, int k, const Vec3&) { field.at(i, j, k) = accessor.getValue(coord(d, i, j, k)); });
    field.mirror_ghosts();
    return field;
}

/// u0 in the form that tag_interior() and the other starts return: clamp(signed distance, ±3h), active if |distance| <
/// width.
inline FloatGridPtr start_grid(const Domain& d, const Function& signed_distance, double width) {
    const double w = 3 * d.voxel_size;
    const DenseField u = sample(d, [&](const Vec3& x) { return clamp_to(signed_distance(x), w); });
    const auto active = active_where(d, u, [&](const Vec3& x) { return std::abs(signed_distance(x)) < width; });
    return to_grid(d, u, active, "band", static_cast<float>(w));
}

/// A zero crossing of u on the edge from voxel (i,j,k) to the next along `axis`, by linear interpolation.
struct Crossing {
    Index3 voxel;
    int axis;
    double fraction;  ///< from the voxel to the next
    Vec3 position;    ///< world
};

inline std::vector<Crossing> zero_crossings(const Domain& d, const DenseField& u) {
    std::vector<Crossing> crossings;
    for_each_voxel(d, [&](int i, int j, int k, const Vec3& x) {
        const Index3 n = size_of(d), p{i, j, k};
        for (int axis = 0; axis < 3; ++axis) {
            if (p[axis] + 1 == n[axis]) continue;
            const double here = u.at(i, j, k), next = u.at(i + (axis == 0), j + (axis == 1), k + (axis == 2));
            if ((here < 0) == (next < 0)) continue;
            Crossing c{p, axis, here / (here - next), x};
            c.position[axis] += c.fraction * d.voxel_size;
            crossings.push_back(c);
        }
    });
    return crossings;
}

/// Distance between the zero level sets of a and b in voxels: at each zero crossing of a, the value of b over |∇a|.
struct LevelSetDifference {
    double mean = 0, max = 0;
    std::size_t count = 0;
};

inline LevelSetDifference zero_level_difference(const Domain& d, const DenseField& a, const DenseField& b) {
    LevelSetDifference result;
    for (const Crossing& c : zero_crossings(d, a)) {
        const auto [i, j, k] = c.voxel;
        const auto next = [&](const DenseField& u) {
            return u.at(i + (c.axis == 0), j + (c.axis == 1), k + (c.axis == 2));
        };
        double square = 0;
        for (const auto& f : kFaces) {
            const double difference = a.at(i + f[0], j + f[1], k + f[2]) - a.at(i, j, k);
            square += difference * difference / 2;
        }
        const double there = (1 - c.fraction) * b.at(i, j, k) + c.fraction * next(b);
        const double away = std::abs(there) / std::sqrt(square);
        result.mean += away;
        result.max = std::max(result.max, away);
        ++result.count;
    }
    if (result.count > 0) result.mean /= static_cast<double>(result.count);
    return result;
}

/// Largest difference over the voxels, without ghosts.
inline double max_difference(const DenseField& a, const DenseField& b) {
    double worst = 0;
    for (int i = 0; i < a.nx(); ++i)
        for (int j = 0; j < a.ny(); ++j)
            for (int k = 0; k < a.nz(); ++k) worst = std::max(worst, std::abs(a.at(i, j, k) - b.at(i, j, k)));
    return worst;
}

/// One of the 48 symmetries of the cube, on voxel indices.
struct Symmetry {
    Index3 axis;  ///< target axis a takes the source's axis[a]
    std::array<bool, 3> flip;

    [[nodiscard]] DenseField operator()(const DenseField& u) const {
        const Index3 n{u.nx(), u.ny(), u.nz()};
        DenseField result(n[axis[0]], n[axis[1]], n[axis[2]], u.h());
        for (int i = 0; i < result.nx(); ++i)
            for (int j = 0; j < result.ny(); ++j)
                for (int k = 0; k < result.nz(); ++k) {
                    const Index3 target{i, j, k};
                    Index3 source;
                    for (int a = 0; a < 3; ++a) source[axis[a]] = flip[a] ? n[axis[a]] - 1 - target[a] : target[a];
                    result.at(i, j, k) = u.at(source[0], source[1], source[2]);
                }
        result.mirror_ghosts();
        return result;
    }
};

inline std::vector<Symmetry> all_symmetries() {
    std::vector<Symmetry> all;
    Index3 axis{0, 1, 2};
    do {
        for (int bits = 0; bits < 8; ++bits) all.push_back({axis, {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0}});
    } while (std::next_permutation(axis.begin(), axis.end()));
    return all;
}

inline Symmetry mirror(int axis) { return {{0, 1, 2}, {axis == 0, axis == 1, axis == 2}}; }

/// A smooth random function: a sum of a few plane waves with values of about ±1 and wavelengths of at least `shortest`.
inline Function random_waves(std::uint32_t seed, double shortest) {
    std::mt19937 generator(seed);
    const auto uniform = [&] { return generator() / 4294967296.0; };  // the same with every standard library
    struct Wave {
        Vec3 k;
        double phase;
    };
    std::vector<Wave> waves(5);
    for (Wave& wave : waves) {
        for (double& k : wave.k) k = 2 * M_PI / shortest * (2 * uniform() - 1) / std::sqrt(3.0);
        wave.phase = 2 * M_PI * uniform();
    }
    return [waves](const Vec3& x) {
        double sum = 0;
        for (const Wave& w : waves) sum += std::sin(w.k[0] * x[0] + w.k[1] * x[1] + w.k[2] * x[2] + w.phase);
        return sum / std::sqrt(waves.size() * 0.5) / 2;
    };
}

/// n points on the sphere |x| = radius, nearly evenly spread (a Fibonacci spiral).
inline std::vector<Vec3> sphere_points(int n, double radius) {
    std::vector<Vec3> points;
    for (int m = 0; m < n; ++m) {
        const double z = 1 - (2 * m + 1.0) / n, r = std::sqrt(1 - z * z), angle = m * M_PI * (3 - std::sqrt(5.0));
        points.push_back({radius * r * std::cos(angle), radius * r * std::sin(angle), radius * z});
    }
    return points;
}

inline double distance_to(const std::vector<Vec3>& points, const Vec3& x) {
    double nearest = INFINITY;
    for (const Vec3& p : points) nearest = std::min(nearest, distance(p, x));
    return nearest;
}

}  // namespace covol::test
