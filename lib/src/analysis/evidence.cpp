// Determines which parts of a surface are supported by marks or image edges, slice by slice, and suggests slices for
// further marks.
#include "covol/evidence.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "covol/distance.h"
#include "covol/error.h"
#include "covol/points.h"
#include "mesh/triangle.h"
#include "meshing/mesh_distance.h"
#include "points/kd_tree.h"

namespace covol {
namespace {

std::vector<float> distances_to(const TriangleMesh& mesh, const std::vector<Vec3>& marks) {
    if (marks.empty()) return {};
    const detail::KdTree tree(marks);
    std::vector<float> result(mesh.vertices.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, result.size(), 1024), [&](const auto& range) {
        for (std::size_t v = range.begin(); v != range.end(); ++v)
            result[v] = static_cast<float>(std::sqrt(tree.nearest(mesh.place(v))));
    });
    return result;
}

std::vector<float> strengths_on(const TriangleMesh& mesh, const FloatGrid* edge) {
    if (edge == nullptr) return {};
    std::vector<float> result(mesh.vertices.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, result.size(), 1024), [&](const auto& range) {
        const auto accessor = edge->getConstAccessor();
        const openvdb::tools::GridSampler<FloatGrid::ConstAccessor, openvdb::tools::BoxSampler> g(accessor,
                                                                                                  edge->transform());
        for (std::size_t v = range.begin(); v != range.end(); ++v) {
            const Vec3 x = mesh.place(v);
            result[v] = std::clamp(1.0F - g.wsSample(openvdb::Vec3d(x[0], x[1], x[2])), 0.0F, 1.0F);
        }
    });
    return result;
}

/// A triangle of the surface, with the values that are summed over the triangles of each slice.
struct Piece {
    Vec3 center;                   ///< centroid, world units
    std::array<double, 3> levels;  ///< the corners' third image index, ascending
    double area;
    double to_marks;  ///< mean distance of the corners to the nearest mark, world units; 0 without marks
    double strength;  ///< mean edge strength 1 - g at the corners; 0 without an edge grid
    bool unsupported;
};

/// The fraction of a triangle's area in which the third image index is below `level`.
/// @param l  this index at the triangle's corners, ascending
double fraction_below(const std::array<double, 3>& l, double level) {
    if (level <= l[0]) return 0;
    if (level >= l[2]) return 1;
    if (level < l[1]) return (level - l[0]) * (level - l[0]) / ((l[1] - l[0]) * (l[2] - l[0]));
    return 1 - (l[2] - level) * (l[2] - level) / ((l[2] - l[1]) * (l[2] - l[0]));
}

/// The assessment of one mesh.
class EvidenceAssessment {
public:
    EvidenceAssessment(const TriangleMesh& mesh, const std::vector<Vec3>& marks, const ImageGeometry& geometry,
                       const EvidenceOptions& options, const RunContext& run)
        : mesh_(mesh), marks_(marks), geometry_(geometry), options_(options), run_(run) {}

    Evidence go(const FloatGrid* edge) {
        result_.reach = options_.reach;
        result_.weak_edge = options_.weak_edge;
        result_.distance_to_marks = distances_to(mesh_, marks_);
        run_.check();
        result_.edge_strength = strengths_on(mesh_, edge);
        find_levels();
        find_pieces();
        add_surface();
        add_marks();
        for (auto& [k, slice] : slices_) result_.slices.push_back(slice);
        suggest();
        return std::move(result_);
    }

private:
    [[nodiscard]] int slice_of(double level) const {
        return std::clamp(static_cast<int>(std::lround(level)), 0, geometry_.size[2] - 1);
    }

    SliceEvidence& slice(int k) {
        SliceEvidence& found = slices_[k];
        found.slice = k;
        return found;
    }

    void find_levels() {
        levels_.resize(mesh_.vertices.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, levels_.size(), 4096), [&](const auto& range) {
            for (std::size_t v = range.begin(); v != range.end(); ++v)
                levels_[v] = geometry_.world_to_index(mesh_.place(v))[2];
        });
    }

    void find_pieces() {
        pieces_.resize(mesh_.triangles.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pieces_.size(), 4096), [&](const auto& range) {
            for (std::size_t n = range.begin(); n != range.end(); ++n) pieces_[n] = piece(mesh_.triangles[n]);
        });
    }

    [[nodiscard]] Piece piece(const std::array<std::uint32_t, 3>& t) const {
        const Vec3 a = mesh_.place(t[0]), b = mesh_.place(t[1]), c = mesh_.place(t[2]);
        const auto mean = [&](const auto& values) {
            return values.empty() ? 0.0 : (double(values[t[0]]) + values[t[1]] + values[t[2]]) / 3;
        };
        Piece p{{},
                {levels_[t[0]], levels_[t[1]], levels_[t[2]]},
                meshing::area(a, b, c),
                mean(result_.distance_to_marks),
                mean(result_.edge_strength),
                false};
        std::sort(p.levels.begin(), p.levels.end());
        for (int axis = 0; axis < 3; ++axis) p.center[axis] = (a[axis] + b[axis] + c[axis]) / 3;
        p.unsupported = (marks_.empty() || p.to_marks > options_.reach) && p.strength < options_.weak_edge;
        return p;
    }

    void add_surface() {
        for (const Piece& p : pieces_) {
            result_.area += p.area;
            result_.unsupported_area += p.unsupported ? p.area : 0;
            double below = 0;
            const int last = slice_of(p.levels[2]);
            for (int k = slice_of(p.levels[0]); k <= last; ++k) {
                const double upto = k == last ? 1.0 : fraction_below(p.levels, k + 0.5);
                add(p, (upto - below) * p.area, slice(k));
                below = upto;
            }
        }
        for (auto& [k, s] : slices_) {
            if (!(s.area > 0)) continue;
            s.to_marks_mean /= s.area;
            s.edge_strength /= s.area;
        }
    }

    static void add(const Piece& p, double area, SliceEvidence& s) {
        s.area += area;
        s.to_marks_mean += area * p.to_marks;
        s.to_marks_max = std::max(s.to_marks_max, p.to_marks);
        s.edge_strength += area * p.strength;
        s.unsupported_area += p.unsupported ? area : 0;
    }

    void add_marks() {
        if (marks_.empty()) return;
        const std::vector<double> distances = detail::distances_to(mesh_, marks_);
        for (std::size_t n = 0; n < marks_.size(); ++n) {
            SliceEvidence& s = slice(slice_of(geometry_.world_to_index(marks_[n])[2]));
            ++s.marks;
            s.marks_mean += distances[n];
            s.marks_max = std::max(s.marks_max, distances[n]);
        }
        for (auto& [k, s] : slices_)
            if (s.marks > 0) s.marks_mean /= s.marks;
    }

    // ---- suggestions ---------------------------------------------------------------------------------------------

    /// Positions on the outline of the surface in each slice, world units: the midpoints of the segments in which the
    /// slice's plane intersects the triangles.
    [[nodiscard]] std::vector<std::vector<Vec3>> outlines() const {
        std::vector<std::vector<Vec3>> result(geometry_.size[2]);
        for (const auto& t : mesh_.triangles) {
            const auto [low, high] = std::minmax({levels_[t[0]], levels_[t[1]], levels_[t[2]]});
            const int first = std::max(0, static_cast<int>(std::ceil(low)));
            const int last = std::min(geometry_.size[2] - 1, static_cast<int>(std::floor(high)));
            for (int k = first; k <= last; ++k)
                if (low < high) result[k].push_back(middle_of_cut(t, k));
        }
        return result;
    }

    [[nodiscard]] Vec3 middle_of_cut(const std::array<std::uint32_t, 3>& t, double k) const {
        Vec3 sum{0, 0, 0};
        int count = 0;
        for (int side = 0; side < 3; ++side) {
            const std::uint32_t a = t[side], b = t[(side + 1) % 3];
            if ((levels_[a] <= k) == (levels_[b] <= k)) continue;
            const double x = (k - levels_[a]) / (levels_[b] - levels_[a]);
            const Vec3 from = mesh_.place(a), to = mesh_.place(b);
            for (int axis = 0; axis < 3; ++axis) sum[axis] += from[axis] + x * (to[axis] - from[axis]);
            ++count;
        }
        // If the slice's plane touches the triangle only at its highest corner or side, no side counts as intersected;
        // the result is then the highest corner.
        if (count == 0)
            return mesh_.place(*std::max_element(
                t.begin(), t.end(), [&](std::uint32_t a, std::uint32_t b) { return levels_[a] < levels_[b]; }));
        for (double& x : sum) x /= count;
        return sum;
    }

    /// For each slice, the indices of the unsupported triangles whose centroid is within `reach` of the outline in this
    /// slice.
    [[nodiscard]] std::vector<std::vector<std::uint32_t>> coverage(
        const std::vector<std::vector<Vec3>>& outline) const {
        std::vector<std::uint32_t> unsupported_pieces;
        for (std::size_t n = 0; n < pieces_.size(); ++n)
            if (pieces_[n].unsupported) unsupported_pieces.push_back(static_cast<std::uint32_t>(n));
        const double levels = options_.reach / geometry_.spacing[2];
        std::vector<std::vector<std::uint32_t>> result(outline.size());
        tbb::parallel_for(std::size_t(0), outline.size(), [&](std::size_t k) {
            if (outline[k].empty()) return;
            const detail::KdTree tree(outline[k]);
            for (const std::uint32_t n : unsupported_pieces)
                if (pieces_[n].levels[0] - double(k) <= levels && double(k) - pieces_[n].levels[2] <= levels &&
                    tree.nearest(pieces_[n].center) <= options_.reach * options_.reach)
                    result[k].push_back(n);
        });
        return result;
    }

    void suggest() {
        if (options_.suggestions == 0 || !(result_.unsupported_area > 0)) return;
        const std::vector<std::vector<Vec3>> outline = outlines();
        std::vector<std::vector<std::uint32_t>> covers = coverage(outline);
        while (int(result_.suggestions.size()) < options_.suggestions) {
            run_.check();
            std::size_t best = 0;
            double maximum = 0;
            for (std::size_t k = 0; k < covers.size(); ++k) {
                std::erase_if(covers[k], [&](std::uint32_t n) { return !pieces_[n].unsupported; });
                double sum = 0;
                for (const std::uint32_t n : covers[k]) sum += pieces_[n].area;
                if (sum <= maximum) continue;
                maximum = sum;
                best = k;
            }
            if (!(maximum > 0)) return;
            Suggestion s{static_cast<int>(best), maximum, {}, place(outline[best], covers[best])};
            s.index = geometry_.world_to_index(s.world);
            result_.suggestions.push_back(s);
            for (const std::uint32_t n : covers[best]) pieces_[n].unsupported = false;
        }
    }

    /// The point of the outline around which, within `reach`, the area of the triangles in `covered` is largest. Of
    /// more than kSample points or triangles, only every n-th is examined.
    [[nodiscard]] Vec3 place(const std::vector<Vec3>& outline, const std::vector<std::uint32_t>& covered) const {
        constexpr std::size_t kSample = 2000;
        const std::size_t step = covered.size() / kSample + 1, stride = outline.size() / kSample + 1;
        Vec3 best = outline.front();
        double maximum = -1;
        for (std::size_t m = 0; m < outline.size(); m += stride) {
            double sum = 0;
            for (std::size_t n = 0; n < covered.size(); n += step) {
                const Piece& p = pieces_[covered[n]];
                if (detail::squared_distance(p.center, outline[m]) <= options_.reach * options_.reach) sum += p.area;
            }
            if (sum <= maximum) continue;
            maximum = sum;
            best = outline[m];
        }
        return best;
    }

    const TriangleMesh& mesh_;
    const std::vector<Vec3>& marks_;
    const ImageGeometry& geometry_;
    const EvidenceOptions& options_;
    const RunContext& run_;
    std::vector<double> levels_;  ///< the third image index of each vertex
    std::vector<Piece> pieces_;   ///< one for each triangle
    std::map<int, SliceEvidence> slices_;
    Evidence result_;
};

}  // namespace

namespace {

Evidence assess(const TriangleMesh& mesh, const std::vector<Vec3>& marks, const FloatGrid* edge,
                const ImageGeometry& geometry, const EvidenceOptions& options, const RunContext& run) {
    require_valid(options, "assess_evidence");
    if (mesh.empty()) throw Error(Errc::InvalidInput, "mesh: expected a surface, got an empty one");
    Evidence result;
    with_threads(run, [&] { result = EvidenceAssessment(mesh, marks, geometry, options, run).go(edge); });
    return result;
}

}  // namespace

Evidence assess_evidence(const TriangleMesh& mesh, const std::vector<Vec3>& marks, const FloatGrid& edge,
                         const ImageGeometry& geometry, const EvidenceOptions& options, const RunContext& run) {
    return assess(mesh, marks, &edge, geometry, options, run);
}

Evidence assess_evidence(const TriangleMesh& mesh, const std::vector<Vec3>& marks, const ImageGeometry& geometry,
                         const EvidenceOptions& options, const RunContext& run) {
    return assess(mesh, marks, nullptr, geometry, options, run);
}

double measure_fraction_without_points(const TriangleMesh& mesh, const FloatGrid& distance, double reach,
                                       const RunContext& run) {
    struct Areas {
        double total = 0, bare = 0;
    } areas;
    with_threads(run, [&] {
        // This reduction divides the range in the same way for any number of threads, so that the sums are
        // bit-identical.
        areas = tbb::parallel_deterministic_reduce(
            tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), Areas{},
            [&](const tbb::blocked_range<std::size_t>& range, Areas sum) {
                const auto known = distance.getConstAccessor();
                for (std::size_t t = range.begin(); t != range.end(); ++t) {
                    openvdb::Vec3d corner[3];
                    for (int n = 0; n < 3; ++n) {
                        const Vec3 v = mesh.place(mesh.triangles[t][n]);
                        corner[n] = {v[0], v[1], v[2]};
                    }
                    const double area = 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]).length();
                    const openvdb::Vec3d at = distance.worldToIndex((corner[0] + corner[1] + corner[2]) / 3.0);
                    float d = 0;
                    const bool near = known.probeValue(openvdb::Coord::round(at), d) && d <= reach;
                    sum.total += area;
                    if (!near) sum.bare += area;
                }
                return sum;
            },
            [](const Areas& a, const Areas& b) {
                return Areas{a.total + b.total, a.bare + b.bare};
            });
    });
    return areas.total > 0 ? areas.bare / areas.total : 0.0;
}

double measure_fraction_without_points(const TriangleMesh& mesh, const std::vector<Vec3>& points, double reach,
                                       const RunContext& run) {
    if (points.empty() || mesh.empty()) return 0;
    const Domain domain = make_domain(bounding_box(points, reach), reach / 3);
    return measure_fraction_without_points(mesh, *compute_distance(points, domain, {reach}, run).grid, reach, run);
}

}  // namespace covol
