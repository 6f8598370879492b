#pragma once
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "covol/clip.h"
#include "covol/domain.h"
#include "covol/surface.h"

// Level sets of random solids of several kinds, which are difficult on purpose: thin parts, parts that touch, values at
// or next to 0.
namespace covol::test {

struct RandomSolid {
    std::string name;
    FloatGridPtr level_set;
    bool resolved = true;  ///< no part is so thin that the lattice misses any of it
};

class SolidMaker {
public:
    explicit SolidMaker(unsigned seed) : seed_(seed), random_(seed) {
        h_ = std::pow(10.0, uniform(-2, 1));
        const int n = 36;
        domain_.voxel_size = h_;
        for (int a = 0; a < 3; ++a) {
            domain_.max[a] = n - 1;
            domain_.origin[a] = h_ * uniform(-40, 40);
        }
        middle_ = {0.5 * (n - 1), 0.5 * (n - 1), 0.5 * (n - 1)};
    }

    RandomSolid make() {
        switch (seed_ % 6) {
            case 0: return {"waves", level_set(within(13.5, waves(6, 20)))};
            case 1: return {"balls, boxes, tori and capsules", level_set(csg(false))};
            case 2: return {"shells and sheets of a fraction of a voxel", level_set(sheets()), false};
            case 3: return {"crossings at lattice points", level_set(on_lattice())};
            case 4: return {"thin parts", level_set(csg(true))};
            default: return {"cut off at the image's faces", clipped()};
        }
    }

private:
    using Shape = std::function<double(const Vec3&)>;  ///< of the index, in voxels

    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
    static double norm(const Vec3& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }
    static Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
    static double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

    Vec3 direction() {
        for (;;) {
            const Vec3 v{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            const double size = norm(v);
            if (size > 0.1 && size < 1) return {v[0] / size, v[1] / size, v[2] / size};
        }
    }
    Vec3 place(double reach) {
        return {middle_[0] + uniform(-reach, reach), middle_[1] + uniform(-reach, reach),
                middle_[2] + uniform(-reach, reach)};
    }

    /// A sum of plane waves with wavelengths from `shortest` to `longest` voxels, divided by the root mean square of
    /// its slope.
    Shape waves(double shortest, double longest) {
        struct Wave {
            Vec3 k;
            double phase, weight;
        };
        std::vector<Wave> all;
        double slope = 0;
        for (int n = 0; n < 8; ++n) {
            const double k = 2 * 3.14159265 / uniform(shortest, longest);
            const Vec3 d = direction();
            all.push_back({{k * d[0], k * d[1], k * d[2]}, uniform(0, 7), uniform(0.3, 1)});
            slope += 0.5 * std::pow(all.back().weight * k, 2);
        }
        return [all, slope = std::sqrt(slope)](const Vec3& p) {
            double sum = 0;
            for (const Wave& w : all) sum += w.weight * std::cos(dot(w.k, p) + w.phase);
            return sum / slope;
        };
    }

    Shape within(double radius, Shape shape) {
        return [shape = std::move(shape), radius, c = middle_](const Vec3& p) {
            return std::max(shape(p), norm(minus(p, c)) - radius);
        };
    }

    Shape primitive(bool thin) {
        const Vec3 c = place(7), d = direction();
        const double r = thin ? uniform(0.4, 1.3) : uniform(2, 6), size = uniform(3, 8);
        switch (pick(0, 3)) {
            case 0: return [=](const Vec3& p) { return norm(minus(p, c)) - size; };
            case 1: {  // a rotated box
                Vec3 e = direction();
                const double along = dot(e, d);
                for (int a = 0; a < 3; ++a) e[a] -= along * d[a];
                const double length = norm(e);
                for (double& x : e) x /= length;
                const Vec3 f{d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]};
                return [=](const Vec3& p) {
                    const Vec3 q = minus(p, c);
                    return std::max(
                        {std::abs(dot(q, d)) - r, std::abs(dot(q, e)) - size, std::abs(dot(q, f)) - 0.8 * size});
                };
            }
            case 2:  // a torus
                return [=](const Vec3& p) {
                    const Vec3 q = minus(p, c);
                    const double up = dot(q, d);
                    return std::hypot(std::sqrt(std::max(0.0, dot(q, q) - up * up)) - size, up) -
                           std::min(r, 0.6 * size);
                };
            default:  // a capsule
                return [=](const Vec3& p) {
                    const Vec3 q = minus(p, c);
                    const double t = std::clamp(dot(q, d), -size, size);
                    return norm({q[0] - t * d[0], q[1] - t * d[1], q[2] - t * d[2]}) - r;
                };
        }
    }

    Shape csg(bool thin) {
        Shape all = primitive(false);
        const int parts = pick(2, 5);
        for (int n = 0; n < parts; ++n) {
            Shape part = primitive(thin);
            const bool cut = pick(0, 2) == 0;
            all = [all, part, cut](const Vec3& p) {
                return cut ? std::max(all(p), -part(p)) : std::min(all(p), part(p));
            };
        }
        return all;
    }

    Shape sheets() {
        const double half = uniform(0.05, 0.6), r = uniform(6, 12);
        const Vec3 c = place(2), d = direction();
        if (pick(0, 1) == 0) return [=](const Vec3& p) { return std::abs(norm(minus(p, c)) - r) - half; };
        const Shape bent = waves(15, 40);
        return [=](const Vec3& p) {
            return std::max(std::abs(dot(minus(p, c), d) + 2 * bent(p)) - half, norm(minus(p, c)) - r);
        };
    }

    /// Balls and boxes whose surfaces pass through lattice points, exactly or nearly.
    Shape on_lattice() {
        const Vec3 c{std::round(middle_[0]), std::round(middle_[1]), std::round(middle_[2])};
        const double r = pick(4, 11), off = std::array{0.0, 1e-7, -1e-7, 1e-3, -1e-3}[std::size_t(pick(0, 4))];
        const int kind = pick(0, 3);
        const double ground = uniform(0, 1) < 0.5 ? 0.5 : 1.0;
        return [=](const Vec3& p) {
            const Vec3 q = minus(p, c);
            const double box = std::max({std::abs(q[0]), std::abs(q[1]), std::abs(q[2])}) - r;
            const double cross = std::abs(q[0]) + std::abs(q[1]) + std::abs(q[2]) - r;
            const double value = kind == 0   ? norm(q) - r
                                 : kind == 1 ? box
                                 : kind == 2 ? cross
                                             : std::max(box, 4 - norm(q));
            return std::round(value / ground) * ground + off;
        };
    }

    FloatGridPtr level_set(const Shape& shape) {
        FloatGridPtr grid = make_grid(domain_, float(3 * h_), "surface");
        auto accessor = grid->getAccessor();
        for (int i = domain_.min[0]; i <= domain_.max[0]; ++i)
            for (int j = domain_.min[1]; j <= domain_.max[1]; ++j)
                for (int k = domain_.min[2]; k <= domain_.max[2]; ++k)
                    accessor.setValue({i, j, k},
                                      float(h_ * std::clamp(shape({double(i), double(j), double(k)}), -3.0, 3.0)));
        return grid;
    }

    /// A solid that extends beyond some faces of a box, which lie at arbitrary positions between the layers of voxels.
    FloatGridPtr clipped() {
        const Shape shape = pick(0, 1) == 0 ? csg(false) : within(16, waves(12, 40));
        WorldBox box = domain_.world_box();
        for (int a = 0; a < 3; ++a) {
            if (pick(0, 1) == 0) box.min[a] += h_ * uniform(8, 13);
            if (pick(0, 1) == 0) box.max[a] -= h_ * uniform(8, 13);
        }
        domain_ = make_domain(box, h_);
        const Domain& d = domain_;
        const FloatGridPtr u = level_set([&, first = d.min](const Vec3& p) {
            return shape({p[0] - first[0] + 8, p[1] - first[1] + 8, p[2] - first[2] + 8});
        });
        set_clip(*u, make_clip(box));
        return extract_surface(*u);
    }

    unsigned seed_;
    std::mt19937 random_;
    double h_ = 1;
    Domain domain_;
    Vec3 middle_{};
};

inline RandomSolid random_solid(unsigned seed) { return SolidMaker(seed).make(); }

}  // namespace covol::test
