#include "covol/guess_correction.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>

#include "base/heuristics.h"
#include "clip/clipped.h"
#include "clip/half_spaces.h"
#include "covol/error.h"
#include "covol/start.h"
#include "grid/levels_at.h"
#include "guess/heuristics.h"
#include "guess/wendland.h"
#include "points/convex_hull.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

using Leaf = FloatGrid::TreeType::LeafNodeType;

constexpr double kSolved = 1e-6;        // maximum residual of the equations, relative to the right-hand side
constexpr double kSteepestBump = 2.11;  // maximum slope of a bump, times radius / height
constexpr int kMaxIterations = 1000;
// [voxels] Distance from a seed, the centre of its voxel, to the end of the voxel. The corrected surface passes at this
// distance from the seed.
constexpr double kVoxelEnd = 0.5;

struct Bump {
    Vec3 center;
    double radius, height;
};

/// The signed distance to the guess's surface, also beyond the narrow band.
class FarDistance {
public:
    FarDistance(const FloatGridPtr& guess, const std::vector<Vec3>& crossings)
        : guess_(guess), exact_((kHalfWidthVoxels - 1) * guess->voxelSize()[0]), surface_(crossings) {}

    [[nodiscard]] double at(const Vec3& world) const {
        const double near = detail::level_at(*guess_, world);
        if (std::abs(near) < exact_) return near;
        return std::copysign(std::max(exact_, std::sqrt(surface_.nearest(world))), near);
    }

    /// Maximum amount by which the values of at() at two positions may differ by more than the distance between the
    /// positions. It is not 0, because at() interpolates the level set near the surface and computes the distance to
    /// the nearest crossing elsewhere.
    [[nodiscard]] double slack() const { return exact_; }

    /// The radius of the largest ball inside the guess, world units, accurate to the width of a leaf (8 voxels).
    [[nodiscard]] double depth() const {
        double lowest = 0;
        const auto visit = [&](const openvdb::Coord& c) {
            const openvdb::Vec3d w = guess_->indexToWorld(c);
            lowest = std::min(lowest, at({w[0], w[1], w[2]}));
        };
        for (auto leaf = guess_->tree().cbeginLeaf(); leaf; ++leaf) {
            const float* const values = leaf->buffer().data();
            const auto deepest = std::min_element(values, values + Leaf::SIZE);
            if (*deepest < 0) visit(leaf->offsetToGlobalCoord(openvdb::Index(deepest - values)));
        }
        auto tile = guess_->tree().cbeginValueAll();
        tile.setMaxDepth(FloatGrid::TreeType::ValueAllCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile) {
            if (!(*tile < 0)) continue;
            openvdb::CoordBBox box;
            tile.getBoundingBox(box);
            constexpr int kStep = int(Leaf::DIM);
            for (int i = box.min().x(); i <= box.max().x(); i += kStep)
                for (int j = box.min().y(); j <= box.max().y(); j += kStep)
                    for (int k = box.min().z(); k <= box.max().z(); k += kStep)
                        visit({i + kStep / 2, j + kStep / 2, k + kStep / 2});
        }
        return -lowest;
    }

private:
    FloatGridPtr guess_;
    double exact_;  ///< distance up to which the level set is interpolated, because hardly any voxel is clamped there
    detail::KdTree surface_;
};

/// The positions at which the surface crosses edges between neighbouring voxels of the grid, world units.
std::vector<Vec3> find_crossings(const FloatGrid& guess) {
    std::vector<Vec3> points;
    const auto accessor = guess.getConstAccessor();
    for (auto at = guess.cbeginValueOn(); at; ++at) {
        const openvdb::Coord c = at.getCoord();
        const double here = double(*at);
        for (int a = 0; a < 3; ++a) {
            openvdb::Coord next = c;
            ++next[a];
            const double there = double(accessor.getValue(next));
            if ((here < 0) == (there < 0)) continue;
            openvdb::Vec3d p = c.asVec3d();
            p[a] += here / (here - there);
            const openvdb::Vec3d w = guess.transform().indexToWorld(p);
            points.push_back({w[0], w[1], w[2]});
        }
    }
    if (points.empty()) throw Error(Errc::InvalidInput, "expected a guess with a surface, got none");
    return points;
}

/// A position, and the distance by which the surface has to move outward there.
struct Target {
    Vec3 at;
    double shift;
};

/// The facets of a convex hull as half-spaces, whose intersection is the hull.
using Facets = std::vector<HalfSpace>;

/// The convex hull of the guess's surface points and of the targets. @param marks  number of targets that are marks;
/// the others are seeds
Facets hull_of(std::vector<Vec3> surface, const std::vector<Target>& targets, std::size_t marks, double h) {
    for (std::size_t n = 0; n < targets.size(); ++n) {
        surface.push_back(targets[n].at);
        if (n < marks) continue;
        // The corrected surface passes kVoxelEnd voxels beyond a seed, in an unknown direction. The hull therefore
        // includes six positions at twice that distance, whose octahedron contains the ball of radius kVoxelEnd.
        for (int a = 0; a < 3; ++a)
            for (const int side : {-1, 1}) {
                surface.push_back(targets[n].at);
                surface.back()[a] += side * 2 * kVoxelEnd * h;
            }
    }
    return detail::convex_hull(surface);
}

/// The facets for which some position within `radius` of `center` lies outside of the facet, or less than `depth`
/// inside.
Facets find_near(const Facets& hull, const Vec3& center, double radius, double depth) {
    Facets near;
    std::copy_if(hull.begin(), hull.end(), std::back_inserter(near),
                 [&](const HalfSpace& facet) { return detail::along(facet, center) > -radius - depth; });
    return near;
}

/// The value of the level set after the bumps have moved the guess outward by `move`. If the moved surface extends
/// beyond the convex hull of guess and marks, the value is the mean of that after the bumps and that of the hull: bumps
/// alone inflate the correct surface beside a missing part, and the hull alone has flat facets between the marks.
double corrected_level(double guess, double move, const Facets& hull, const Vec3& world) {
    const double level = guess - move;
    return move > 0 ? std::max(level, 0.5 * (level + detail::depth_in(hull, world))) : level;
}

/// Whether corrected_level() is negative. The hull is evaluated only if the bumps bring a position inside that is
/// outside of the guess.
bool comes_inside(double guess, double move, const Facets& hull, const Vec3& world) {
    const double level = guess - move;
    if (!(level < 0) || guess < 0) return level < 0;
    return std::none_of(hull.begin(), hull.end(),
                        [&](const HalfSpace& facet) { return level + detail::along(facet, world) >= 0; });
}

bool holds(const WorldBox& box, const Vec3& world) {
    for (int a = 0; a < 3; ++a)
        if (world[a] < box.min[a] || world[a] > box.max[a]) return false;
    return true;
}

double sum_of(const std::vector<Bump>& bumps, const Vec3& world) {
    double sum = 0;
    for (const Bump& b : bumps) {
        const double d2 = detail::squared_distance(b.center, world);
        if (d2 < b.radius * b.radius) sum += b.height * detail::wendland(std::sqrt(d2) / b.radius);
    }
    return sum;
}

/// Heights of bumps of equal radius at the targets whose sum at each target is its shift, up to noise: the solution of
/// (K + noise I) heights = shifts, where K contains the values at each target of bumps of height 1.
std::vector<double> solve(const std::vector<Target>& targets, double radius, double noise) {
    struct Entry {
        std::size_t column;
        double value;
    };
    const std::size_t count = targets.size();
    std::vector<std::vector<Entry>> rows(count);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t n) {
        for (std::size_t m = 0; m < count; ++m) {
            const double k =
                detail::wendland(std::sqrt(detail::squared_distance(targets[n].at, targets[m].at)) / radius) +
                (n == m ? noise : 0.0);
            if (k > 0) rows[n].push_back({m, k});
        }
    });
    // Conjugate gradients: the matrix is symmetric and positive definite.
    const auto dot = [](const std::vector<double>& a, const std::vector<double>& b) {
        return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
    };
    std::vector<double> x(count, 0), r(count), p, q(count);
    for (std::size_t n = 0; n < count; ++n) r[n] = targets[n].shift;
    p = r;
    double norm = dot(r, r);
    const double enough = kSolved * kSolved * norm;
    for (int iteration = 0; iteration < kMaxIterations && norm > enough; ++iteration) {
        tbb::parallel_for(std::size_t(0), count, [&](std::size_t n) {
            double sum = 0;
            for (const Entry& e : rows[n]) sum += e.value * p[e.column];
            q[n] = sum;
        });
        const double alpha = norm / dot(p, q);
        for (std::size_t n = 0; n < count; ++n) {
            x[n] += alpha * p[n];
            r[n] -= alpha * q[n];
        }
        const double next = dot(r, r), beta = next / norm;
        for (std::size_t n = 0; n < count; ++n) p[n] = r[n] + beta * p[n];
        norm = next;
    }
    return x;
}

/// Adds bumps until their sum at each target is its shift, starting with the targets with the largest shifts.
void add_bumps(std::vector<Bump>& bumps, const std::vector<Target>& targets, double min_radius, double precision) {
    std::vector<Target> met, open = targets;
    const auto radius_of = [&](double shift) {
        return std::max(min_radius, (shift > 0 ? kCorrection.radius_outward : -kCorrection.radius_of_residual) * shift);
    };
    while (!open.empty()) {
        std::vector<double> left;
        double radius = min_radius;
        for (const Target& t : open) {
            left.push_back(t.shift - sum_of(bumps, t.at));
            radius = std::max(radius, radius_of(left.back()));
        }
        std::vector<Target> group = met, later;
        double square = 0, fourth = 0;  // sums of powers of the residuals
        std::size_t now = 0;
        for (std::size_t n = 0; n < open.size(); ++n) {
            if (radius_of(left[n]) * kCommon.growth < radius) {
                later.push_back(open[n]);
                continue;
            }
            met.push_back(open[n]);
            group.push_back({open[n].at, left[n]});
            square += left[n] * left[n];
            fourth += left[n] * left[n] * left[n] * left[n];
            ++now;
        }
        for (std::size_t n = 0; n + now < group.size(); ++n) group[n].shift -= sum_of(bumps, group[n].at);
        // `noise` is the squared precision divided by the squared size of the shifts. That size is estimated by fourth
        // / square, which large shifts dominate: with the mean square, many marks with small residuals would make a
        // large shift look like noise.
        const double noise = fourth > 0 ? precision * precision * square / fourth : 1.0;
        const std::vector<double> heights = solve(group, radius, noise);
        for (std::size_t n = 0; n < group.size(); ++n)
            if (heights[n] != 0) bumps.push_back({group[n].at, radius, heights[n]});
        open = std::move(later);
    }
}

/// The bumps that reach the row of voxels (i, j, k) with any i.
std::vector<Bump> beside(const std::vector<Bump>& bumps, const ImageGeometry& geometry, int j, int k) {
    const Vec3 origin = geometry.index_to_world({0, double(j), double(k)});
    std::vector<Bump> near;
    for (const Bump& b : bumps) {
        Vec3 to;
        double along = 0;
        for (int a = 0; a < 3; ++a) {
            to[a] = b.center[a] - origin[a];
            along += to[a] * geometry.direction[a][0];
        }
        const double off = detail::squared_distance(to, {0, 0, 0}) - along * along;
        if (off < 1.001 * b.radius * b.radius) near.push_back(b);
    }
    return near;
}

std::array<double, 2> mean_and_max(const std::vector<Target>& marks, const std::vector<Bump>& bumps) {
    double sum = 0, largest = 0;
    for (const Target& t : marks) {
        const double left = std::abs(t.shift - sum_of(bumps, t.at));
        sum += left;
        largest = std::max(largest, left);
    }
    return {marks.empty() ? 0 : sum / double(marks.size()), largest};
}

}  // namespace

struct GuessCorrection::Data {
    Data(const FloatGridPtr& start, const std::vector<Vec3>& surface) : grid(start), distance(start, surface) {}
    FloatGridPtr grid;
    FarDistance distance;
    FloatGridPtr given;  ///< the guess before it was redrawn; null if it was not
    WorldBox redrawn{};  ///< the part that was redrawn; outside of it `given` and `grid` are equal
    Facets hull;         ///< of the guess, the marks and the active seeds; empty if no bump exceeds the minimum radius
    std::vector<Bump> bumps;
    CorrectionReport report;

    /// The leaf at `origin` after the correction; null if it is so far from the surface that the correction cannot
    /// change it.
    /// @param tree  of the guess: a signed distance that is clamped to plus or minus `clamp`
    [[nodiscard]] std::unique_ptr<Leaf> corrected_leaf(const FloatGrid::TreeType& tree, const openvdb::Coord& origin,
                                                       const Domain& domain, double clamp) const;
};

std::unique_ptr<Leaf> GuessCorrection::Data::corrected_leaf(const FloatGrid::TreeType& tree,
                                                            const openvdb::Coord& origin, const Domain& domain,
                                                            double clamp) const {
    const double half = 0.5 * (Leaf::DIM - 1);
    const Vec3 middle = domain.index_to_world({origin.x() + half, origin.y() + half, origin.z() + half});
    const double reach = half * std::sqrt(3.0) * domain.voxel_size;
    std::vector<Bump> near;
    double slope = 0;
    for (const Bump& b : bumps) {
        if (!(std::sqrt(detail::squared_distance(b.center, middle)) < b.radius + reach)) continue;
        near.push_back(b);
        slope += kSteepestBump * std::abs(b.height) / b.radius;
    }
    // If, by bounds from distance and move at the leaf's middle, the corrected surface stays farther than `clamp` from
    // all voxels, they keep their clamped values. This avoids computing the distance of every voxel.
    const double far = distance.at(middle), move = sum_of(near, middle);
    if (std::abs(far) - std::abs(move) > clamp + (1 + slope) * reach + distance.slack()) return nullptr;
    const Leaf* const before = tree.probeConstLeaf(origin);
    auto leaf = before != nullptr ? std::make_unique<Leaf>(*before)
                                  : std::make_unique<Leaf>(origin, tree.getValue(origin), false);
    const Facets facets = find_near(hull, middle, reach, clamp);
    for (openvdb::Index at = 0; at < Leaf::SIZE; ++at) {
        const openvdb::Coord c = leaf->offsetToGlobalCoord(at);
        const Vec3 world = domain.index_to_world({double(c.x()), double(c.y()), double(c.z())});
        const double shift = sum_of(near, world);
        if (shift == 0) continue;
        const double level = corrected_level(distance.at(world), shift, facets, world);
        leaf->setValueOn(at, float(std::clamp(level, -clamp, clamp)));
    }
    return leaf;
}

GuessCorrection::GuessCorrection(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

double GuessCorrection::shift(const Vec3& world) const { return sum_of(data_->bumps, world); }
double GuessCorrection::guess(const Vec3& world) const { return data_->distance.at(world); }
const CorrectionReport& GuessCorrection::report() const { return data_->report; }

FloatGridPtr GuessCorrection::start(const RunContext& run) const {
    const Domain domain = domain_of(*data_->grid);
    const FloatGridPtr field = data_->grid->deepCopy();
    const double clamp = kHalfWidthVoxels * domain.voxel_size;
    std::vector<openvdb::Coord> origins;
    for (const Bump& b : data_->bumps) {
        openvdb::Coord first, last;
        for (int a = 0; a < 3; ++a) {
            const double middle = domain.world_to_index(b.center)[a], reach = b.radius / domain.voxel_size;
            first[a] = std::max(int(std::floor(middle - reach)), domain.min[a]) & ~7;
            last[a] = std::min(int(std::ceil(middle + reach)), domain.max[a]);
        }
        for (int i = first.x(); i <= last.x(); i += 8)
            for (int j = first.y(); j <= last.y(); j += 8)
                for (int k = first.z(); k <= last.z(); k += 8) origins.emplace_back(i, j, k);
    }
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    std::vector<std::unique_ptr<Leaf>> leaves(origins.size());
    with_threads(run, [&] {
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
            leaves[n] = data_->corrected_leaf(field->tree(), origins[n], domain, clamp);
        });
    });
    for (std::unique_ptr<Leaf>& leaf : leaves)
        if (leaf) field->tree().addLeaf(leaf.release());
    run.check();
    return start_from_grid(domain, *field, run);
}

GuessCorrection correct_guess(const FloatGridPtr& guess, const std::vector<Vec3>& marks,
                              const std::vector<Vec3>& inside, const std::vector<Vec3>& outside,
                              const CorrectionOptions& options, const RunContext& run, const RedrawnGuess& redrawn) {
    require_valid(options, "correct_guess");
    const FloatGridPtr& start = redrawn.u ? redrawn.u : guess;
    const std::vector<Vec3> surface = find_crossings(*start);
    auto data = std::make_shared<GuessCorrection::Data>(start, surface);
    if (start != guess) {
        data->given = guess;
        data->redrawn = redrawn.box;
    }
    with_threads(run, [&] {
        const double h = guess->voxelSize()[0];
        const double precision = options.precision.value_or(kCommon.precision_voxels * h);
        const double minimum = options.min_radius.value_or(kCorrectionVoxels * h);
        std::vector<Target> on_surface;
        on_surface.reserve(marks.size());
        for (const Vec3& mark : marks) on_surface.push_back({mark, data->distance.at(mark)});
        std::vector<Target> targets = on_surface;
        std::vector<char> used(inside.size() + outside.size(), 0);
        // A seed becomes a target as soon as it is on the wrong side of the corrected surface.
        for (int round = 0; round < kCommon.rounds; ++round) {
            run.check();
            data->bumps.clear();
            add_bumps(data->bumps, targets, minimum, precision);
            const std::size_t before = targets.size();
            for (std::size_t n = 0; n < used.size(); ++n) {
                const bool in = n < inside.size();
                const Vec3& seed = in ? inside[n] : outside[n - inside.size()];
                const double distance = data->distance.at(seed), now = distance - sum_of(data->bumps, seed);
                if (used[n] || (in ? now < 0 : now > 0)) continue;
                used[n] = 1;
                targets.push_back({seed, distance + (in ? 1 : -1) * kVoxelEnd * h});
            }
            if (targets.size() == before) break;
        }
        CorrectionReport& report = data->report;
        report.depth = data->distance.depth();
        report.marks = marks.size();
        report.seeds = targets.size() - marks.size();
        const auto before = mean_and_max(on_surface, {}), after = mean_and_max(on_surface, data->bumps);
        report.before_mean = before[0];
        report.before_max = before[1];
        report.after_mean = after[0];
        report.after_max = after[1];
        report.min_radius = minimum;
        for (const Bump& b : data->bumps) report.largest_radius = std::max(report.largest_radius, b.radius);
        if (report.largest_radius > minimum) data->hull = hull_of(surface, targets, marks.size(), h);
    });
    return GuessCorrection(data);
}

CorrectedMask GuessCorrection::apply(const Image& mask, int label, const RunContext& run) const {
    const ImageGeometry& geometry = mask.geometry();
    const auto [ni, nj, nk] = geometry.size;
    CorrectedMask result;
    result.values.resize(std::size_t(ni) * std::size_t(nj) * std::size_t(nk));
    std::atomic<std::size_t> added = 0, removed = 0, reached = 0;
    std::atomic<bool> broken = false;
    with_threads(run, [&, ni = ni, nj = nj, nk = nk] {
        tbb::parallel_for(0, nk, [&](int k) {
            std::size_t added_here = 0, removed_here = 0, near = 0;
            std::int32_t* value = result.values.data() + std::size_t(k) * std::size_t(nj) * std::size_t(ni);
            for (int j = 0; j < nj; ++j) {
                const std::vector<Bump> bumps = beside(data_->bumps, geometry, j, k);
                double at_least = 0;  // lower bound of the distance to the guess, from that of the voxels before
                for (int i = 0; i < ni; ++i, ++value, at_least -= geometry.spacing[0]) {
                    const double old = mask.at(i, j, k);
                    if (old != std::floor(old) || std::abs(old) > 2147483647.0) broken = true;
                    *value = broken ? 0 : std::int32_t(old);
                    const Vec3 world = geometry.index_to_world({double(i), double(j), double(k)});
                    const double move = sum_of(bumps, world);
                    const bool is_redrawn = data_->given && holds(data_->redrawn, world);
                    const bool is_unchanged = move == 0 || std::abs(move) < at_least;  // by the bumps
                    near += move != 0;
                    if (is_unchanged && !is_redrawn) continue;
                    bool was = false, in = false;
                    if (is_unchanged) {
                        in = detail::level_at(*data_->grid, world) < 0;
                    } else {
                        const double before = data_->distance.at(world);
                        at_least = std::abs(before) - data_->distance.slack();
                        was = before < 0;
                        in = comes_inside(before, move, data_->hull, world);
                    }
                    if (is_redrawn) was = detail::level_at(*data_->given, world) < 0;
                    if (was == in) continue;
                    near += move == 0;
                    if (in && *value == 0) {
                        *value = label;
                        ++added_here;
                    } else if (!in && *value == label) {
                        *value = 0;
                        ++removed_here;
                    }
                }
            }
            added += added_here;
            removed += removed_here;
            reached += near;
        });
    });
    run.check();
    if (broken) throw Error(Errc::InvalidInput, mask.path() + ": expected a label image of whole numbers");
    result.added = added;
    result.removed = removed;
    result.reached = reached;
    return result;
}

}  // namespace covol
