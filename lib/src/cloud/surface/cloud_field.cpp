#include "cloud/surface/cloud_field.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/geometry.h"
#include "base/heuristics.h"
#include "base/median.h"
#include "cloud/indicator/heuristics.h"
#include "cloud/surface/blend_kernel.h"
#include "cloud/surface/heuristics.h"
#include "cloud/surface/local_fit.h"
#include "cloud/surface/sharp_mesh.h"
#include "covol/error.h"
#include "grid/flood_tiles.h"
#include "grid/leaf_band.h"
#include "points/point_cells.h"

namespace covol::cloud {

using openvdb::Coord;
using Leaf = FloatGrid::TreeType::LeafNodeType;

/// Quadrics, sorted into cells, each with its reach: the distance from its foot up to which it applies.
class CloudField::Pieces {
public:
    Pieces(std::vector<Quadric> quadrics, double h)
        : quadrics_(std::move(quadrics)), h_(h), cells_(feet(quadrics_), 4 * h) {
        std::vector<Quadric> sorted;
        // A quadric applies at least up to kCloud.coarse edges of the finest cells, each of which has a node with a
        // quadric, even if the voxels are wider than the neighbourhood of its fit.
        const double shortest = kCloud.coarse * kBlend.node_voxels * h;
        for (const std::uint32_t n : cells_.order()) {
            const Quadric& q = quadrics_[n];
            sorted.push_back(q);
            const double wanted = std::max(
                {kBlend.reach_voxels * h, kBlend.reach_of_min * q.min_radius, kBlend.reach_of_radius * q.radius});
            // Above this minimum, the reach is limited to less than the radius, because the quadric was not fitted to
            // points beyond the radius.
            reach_.push_back(float(std::max(shortest, std::min(wanted, q.radius / kCommon.growth))));
            longest_ = std::max(longest_, double(reach_.back()));
        }
        quadrics_ = std::move(sorted);
    }

    [[nodiscard]] std::size_t size() const { return quadrics_.size(); }
    [[nodiscard]] const Quadric& operator[](std::size_t n) const { return quadrics_[n]; }
    [[nodiscard]] double reach(std::size_t n) const { return double(reach_[n]); }
    [[nodiscard]] const Vec3& foot(std::size_t n) const { return cells_.sorted()[n]; }
    /// Maximum lateral distance from its foot at which a piece applies: beyond it, other pieces are nearer if the
    /// surface continues.
    [[nodiscard]] double own_radius(std::size_t n) const {
        const Quadric& q = quadrics_[n];
        return std::max(q.min_radius, kCloud.coarse * q.apart);
    }
    /// Half the edges of a box around the foot that contains the part of the narrow band within own_radius() and
    /// reach().
    [[nodiscard]] Vec3 own_box(std::size_t n) const {
        const Quadric& q = quadrics_[n];
        const double beside = std::min(own_radius(n), reach(n));
        const double up = kHalfWidthVoxels * h_ + 0.5 * q.curvature() * beside * beside;
        Vec3 half;
        for (int a = 0; a < 3; ++a) {
            const double along = q.axes[2][a];
            half[a] = std::min(reach(n), beside * std::sqrt(std::max(0.0, 1 - along * along)) + up * std::abs(along));
        }
        return half;
    }
    /// The pieces that may reach the box.
    void find(const WorldBox& box, std::vector<PointCells::Range>& ranges) const {
        WorldBox wide = box;
        for (int a = 0; a < 3; ++a) {
            wide.min[a] -= longest_;
            wide.max[a] += longest_;
        }
        cells_.find(wide, ranges);
    }

private:
    static std::vector<Vec3> feet(const std::vector<Quadric>& quadrics) {
        std::vector<Vec3> at;
        at.reserve(quadrics.size());
        for (const Quadric& q : quadrics) at.push_back(q.foot());
        return at;
    }
    std::vector<Quadric> quadrics_;
    double h_;
    PointCells cells_;
    std::vector<float> reach_;
    double longest_ = 0;
};

namespace {

// Maximum of the estimated number of leaves crossed by the indicator's surface, including duplicates.
constexpr double kMaxLeaves = 2e7;

/// Collects leaves of the domain from boxes of voxels.
class LeafList {
public:
    explicit LeafList(const Domain& domain) : domain_(domain) {}

    void add(const Vec3& low, const Vec3& high) {
        Coord first, last;
        for (int a = 0; a < 3; ++a) {
            first[a] = std::max(int(std::floor(low[a])), domain_.min[a]) & ~7;
            last[a] = std::min(int(std::ceil(high[a])), domain_.max[a]) & ~7;
        }
        if (first == first_ && last == last_) return;  // consecutive boxes are often in the same leaves
        first_ = first, last_ = last;
        for (int i = first.x(); i <= last.x(); i += 8)
            for (int j = first.y(); j <= last.y(); j += 8)
                for (int k = first.z(); k <= last.z(); k += 8) leaves_.emplace_back(i, j, k);
        if (leaves_.size() > 2 * settled_ + 100000) settle();
    }
    /// Sorted, without duplicates.
    std::vector<Coord> take() {
        settle();
        return std::move(leaves_);
    }

private:
    void settle() {
        std::sort(leaves_.begin(), leaves_.end());
        leaves_.erase(std::unique(leaves_.begin(), leaves_.end()), leaves_.end());
        settled_ = leaves_.size();
    }
    const Domain& domain_;
    std::vector<Coord> leaves_;
    std::size_t settled_ = 0;
    Coord first_ = Coord::max(), last_ = Coord::min();
};

/// Calls visit(part) for the parts of a box, with edges of at most `edge`, that the indicator's level 1/2 may cross.
template <typename Visit>
void add_crossed(const Indicator& indicator, const WorldBox& box, double edge, const Visit& visit) {
    const double side = box.max[0] - box.min[0];
    if (side <= edge) {
        visit(box);
        return;
    }
    for (int part = 0; part < 8; ++part) {
        WorldBox half = box;
        for (int a = 0; a < 3; ++a) ((part >> a & 1) != 0 ? half.min : half.max)[a] = 0.5 * (box.min[a] + box.max[a]);
        const Indicator::Sample at = indicator.at(times(0.5, plus(half.min, half.max)));
        // The corners of the part are 0.43 sides of the whole box from the part's centre; 0.6 includes a margin.
        if (std::abs(at.inside - 0.5) <= 0.6 * side * length(at.gradient)) add_crossed(indicator, half, edge, visit);
    }
}

/// The leaves of the domain that contain the narrow band of a quadric or are crossed by the indicator's surface.
/// @throws Error InvalidInput if the indicator's cells are so much larger than the voxels that the leaves of its
/// surface do not fit into memory, as for small parts that are far apart
std::vector<Coord> leaves_of(const CloudField::Pieces& pieces, const Indicator& indicator, const Domain& domain) {
    constexpr std::size_t kParts = 32;
    std::vector<std::vector<Coord>> parts(kParts + 1);
    const double h = domain.voxel_size;
    tbb::parallel_for(std::size_t(0), kParts, [&](std::size_t part) {
        LeafList list(domain);
        for (std::size_t n = part * pieces.size() / kParts; n < (part + 1) * pieces.size() / kParts; ++n) {
            const Vec3 foot = domain.world_to_index(pieces.foot(n)), half = pieces.own_box(n);
            list.add(minus(foot, times(1 / h, half)), plus(foot, times(1 / h, half)));
        }
        parts[part] = list.take();
    });
    const double across = indicator.cell() / h, in_a_cell = std::pow(across / 8 + 2, 3);
    double crossed = 0;
    LeafList list(domain);
    indicator.crossed([&](const WorldBox& box) {
        if ((crossed += in_a_cell) > kMaxLeaves)
            throw Error(
                Errc::InvalidInput,
                "reconstruct: the points form small parts, far apart: the finest cells that cover all of them are " +
                    std::to_string(std::int64_t(across)) +
                    " voxels wide; reconstruct each part separately, or use a larger `voxel_size`",
                "voxel_size");
        add_crossed(indicator, box, 8 * h, [&](const WorldBox& part) {
            list.add(domain.world_to_index(part.min), domain.world_to_index(part.max));
        });
    });
    parts[kParts] = list.take();
    std::vector<Coord> leaves;
    for (const std::vector<Coord>& part : parts) leaves.insert(leaves.end(), part.begin(), part.end());
    tbb::parallel_sort(leaves.begin(), leaves.end());
    leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
    return leaves;
}

/// Offsets, in voxels, to those neighbouring leaves into which the narrow band continues: the leaves across the faces
/// at which an absolute value is below `limit`.
std::vector<Coord> continuing_faces(const Leaf& leaf, float limit) {
    const float* values = leaf.buffer().data();
    const auto inside = [&](int i, int j, int k) { return std::abs(values[i << 6 | j << 3 | k]) < limit; };
    bool on[6] = {};
    for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b) {
            on[0] |= inside(0, a, b), on[1] |= inside(7, a, b);
            on[2] |= inside(a, 0, b), on[3] |= inside(a, 7, b);
            on[4] |= inside(a, b, 0), on[5] |= inside(a, b, 7);
        }
    std::vector<Coord> ways;
    for (int face = 0; face < 6; ++face)
        if (on[face]) {
            Coord way(0, 0, 0);
            way[face / 2] = face % 2 == 0 ? -8 : 8;
            ways.push_back(way);
        }
    return ways;
}

/// The sheet, relative to the position of a leaf.
BlendSheet blend_sheet(const Sheet& sheet, const Vec3& leaf) {
    BlendSheet result;
    for (int a = 0; a < 3; ++a) {
        result.origin[a] = float(sheet.origin[a] - leaf[a]);
        for (int b = 0; b < 3; ++b) result.axes[a][b] = float(sheet.axes[a][b]);
    }
    for (std::size_t c = 0; c < 6; ++c) result.c[c] = float(sheet.c[c]);
    return result;
}

/// Fills leaves with the blend of the quadrics and the indicator, one leaf at a time.
class Blend {
public:
    Blend(const CloudField::Pieces& pieces, const Indicator& indicator, const Domain& domain)
        : pieces_(pieces), indicator_(indicator), domain_(domain) {}

    /// Sets all values of a leaf. Voxels beyond the domain are outside, so that the surface is closed at the domain's
    /// end.
    void fill(Leaf& leaf) {
        const double h = domain_.voxel_size;
        const Coord origin = leaf.origin();
        const WorldBox box{domain_.index_to_world({double(origin.x()), double(origin.y()), double(origin.z())}),
                           domain_.index_to_world({origin.x() + 7.0, origin.y() + 7.0, origin.z() + 7.0})};
        gather(box);
        const double limit = kHalfWidthVoxels * h;
        blend(near_.data(), near_.size(), float(h), float(limit), leaf_);
        for (int at = 0; at < 512; ++at) {
            double own = 0, trust = 0;
            const std::size_t n = std::size_t(at);
            if (leaf_.nearest[n] >= 0) {
                own = std::clamp(double(leaf_.sum[n] / leaf_.weight[n]), -limit, limit);
                trust = faded(std::sqrt(double(leaf_.fraction[n]))) *
                        faded(beside(pieces_of_near_[std::size_t(leaf_.nearest[n])], place(origin, at)));
            }
            double value = trust * own;
            if (trust < 1) value += (1 - trust) * indicator_distance(place(origin, at), limit);
            leaf.setValueOn(openvdb::Index(at), float(std::max(value, std::min(beyond_end(origin, at) * h, limit))));
        }
    }

private:
    /// Approximate distance from the indicator's level 1/2, limited to the range -limit to limit, whose ends only
    /// distinguish inside and outside.
    [[nodiscard]] double indicator_distance(const Vec3& world, double limit) const {
        const Indicator::Sample at = indicator_.at(world);
        const double off = 0.5 - at.inside, beyond = (std::abs(off) - kBlend.sure) / kBlend.sure;
        const double far = std::max(std::abs(off) * at.cell / kBlend.slope, limit * beyond);
        return std::copysign(std::min(far, limit), off);
    }

    /// Distance beyond the end of the domain, in voxels; negative within.
    [[nodiscard]] double beyond_end(const Coord& origin, int at) const {
        const Coord voxel = origin.offsetBy(at >> 6, at >> 3 & 7, at & 7);
        int beyond = std::numeric_limits<int>::min();
        for (int a = 0; a < 3; ++a) beyond = std::max({beyond, domain_.min[a] - voxel[a], voxel[a] - domain_.max[a]});
        return beyond - 0.5;
    }

    /// Weight of a piece at this fraction of its maximum distance: 1 up to kBlend.trusted, then decreasing smoothly to
    /// 0 at 1.
    static double faded(double fraction) {
        const double beyond = std::clamp((fraction - kBlend.trusted) / (1 - kBlend.trusted), 0.0, 1.0);
        return 1 - beyond * beyond * (3 - 2 * beyond);
    }

    /// Lateral distance of a position from the piece's foot, as a fraction of the piece's own_radius().
    [[nodiscard]] double beside(std::size_t piece, const Vec3& world) const {
        const Vec3 to = minus(world, pieces_.foot(piece));
        const double up = dot(to, pieces_[piece].axes[2]);
        return std::sqrt(std::max(0.0, dot(to, to) - up * up)) / pieces_.own_radius(piece);
    }

    [[nodiscard]] Vec3 place(const Coord& origin, int at) const {
        return domain_.index_to_world(
            {double(origin.x() + (at >> 6)), double(origin.y() + (at >> 3 & 7)), double(origin.z() + (at & 7))});
    }

    /// Collects the pieces that may reach the voxels of the box, with positions relative to the box's lowest corner.
    void gather(const WorldBox& box) {
        pieces_.find(box, ranges_);
        near_.clear();
        pieces_of_near_.clear();
        for (const PointCells::Range& range : ranges_)
            for (std::uint32_t n = range.begin; n < range.end; ++n) {
                const Vec3& foot = pieces_.foot(n);
                double off = 0;
                for (int a = 0; a < 3; ++a) {
                    const double beyond = std::max({box.min[a] - foot[a], foot[a] - box.max[a], 0.0});
                    off += beyond * beyond;
                }
                const double reach = pieces_.reach(n);
                if (off >= reach * reach) continue;
                const Quadric& q = pieces_[n];
                BlendPiece piece{};
                piece.reach = float(reach);
                for (int a = 0; a < 3; ++a) {
                    piece.foot[a] = float(foot[a] - box.min[a]);
                    piece.normal[a] = float(q.axes[2][a]);
                }
                piece.count = q.crease ? int(q.crease->count) : 1;
                for (int s = 0; s < piece.count; ++s)
                    piece.sheets[s] = blend_sheet(q.crease ? q.crease->sheets[std::size_t(s)] : q, box.min);
                if (q.crease) {
                    piece.first_is_convex = q.crease->first_is_convex;
                    piece.others_are_convex = q.crease->others_are_convex;
                }
                near_.push_back(piece);
                pieces_of_near_.push_back(n);
            }
    }

    const CloudField::Pieces& pieces_;
    const Indicator& indicator_;
    const Domain& domain_;
    std::vector<PointCells::Range> ranges_;
    std::vector<BlendPiece> near_;
    std::vector<std::size_t> pieces_of_near_;
    BlendLeaf leaf_;
};

/// The distance according to the pieces where they apply, and elsewhere according to the indicator's level 1/2. The
/// active voxels are whole leaves, not yet a narrow band.
FloatGridPtr level_set_of(const CloudField::Pieces& pieces, const Indicator& indicator, const Domain& within,
                          const RunContext& run) {
    const auto limit = float(kHalfWidthVoxels * within.voxel_size);
    FloatGridPtr field = make_grid(within, limit, "u");
    // A surface that leaves the domain is closed so far outside it that the values within do not change.
    constexpr int kBeyond = int(kHalfWidthVoxels) + 1;
    const Domain domain = widened(within, kBeyond);
    openvdb::CoordBBox box = detail::box_of(domain);
    box.expand(kBeyond);
    // Proceeds from leaf to leaf as far as the band continues.
    for (std::vector<Coord> front = leaves_of(pieces, indicator, domain); !front.empty();) {
        std::vector<Leaf*> leaves;
        for (const Coord& origin : front) leaves.push_back(field->tree().touchLeaf(origin));
        std::vector<std::vector<Coord>> ways(leaves.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 8), [&](const auto& range) {
            if (run.cancelled()) return;
            Blend blend(pieces, indicator, domain);
            for (std::size_t n = range.begin(); n < range.end(); ++n) {
                blend.fill(*leaves[n]);
                ways[n] = continuing_faces(*leaves[n], limit);
            }
        });
        run.check();
        std::vector<Coord> next;
        for (std::size_t n = 0; n < leaves.size(); ++n)
            for (const Coord& way : ways[n]) {
                const Coord origin = front[n] + way;
                if (box.hasOverlap(openvdb::CoordBBox::createCube(origin, 8)) &&
                    field->tree().probeConstLeaf(origin) == nullptr)
                    next.push_back(origin);
            }
        std::sort(next.begin(), next.end());
        next.erase(std::unique(next.begin(), next.end()), next.end());
        front = std::move(next);
    }
    detail::flood_tiles(*field, domain);
    return field;
}

/// Moves those points to the indicator's surface that are no farther from it than noise may have displaced them. The
/// nodes of the quadrics are taken from the moved points; otherwise, there would be nodes throughout the thickness of a
/// noisy layer of points.
OrientedCloud near_level(OrientedCloud points, const Indicator& indicator, double noise) {
    const double maximum = kCommon.errors * noise;
    points.squares_off.clear();
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        Vec3 place = points.points[n];
        for (int step = 0; step < kCommon.rounds; ++step) {
            const auto [inside, gradient, cell] = indicator.at(place);
            const double steep = dot(gradient, gradient);
            if (!(steep > 0)) return;
            place = plus(place, times((0.5 - inside) / steep, gradient));
        }
        const Vec3 moved = minus(place, points.points[n]);
        if (dot(moved, moved) < maximum * maximum) points.points[n] = place;
    });
    return points;
}

/// Squared distances of the points to the indicator's level 1/2, to first order; infinite where its slope is 0.
std::vector<float> squared_distances(const std::vector<Vec3>& points, const Indicator& indicator) {
    std::vector<float> squares(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const auto [inside, gradient, cell] = indicator.at(points[n]);
        const double steep = dot(gradient, gradient), off = 0.5 - inside;
        squares[n] = steep > 0 ? float(off * off / steep) : std::numeric_limits<float>::infinity();
    });
    return squares;
}

std::vector<Quadric> quadrics_of(const CloudOrientation& cloud, const Indicator& indicator, double h,
                                 CloudReport& report, const RunContext& run) {
    const OrientedCloud points{cloud.points, cloud.orientation.normals, std::vector<float>(cloud.points.size(), 1.0F),
                               squared_distances(cloud.points, indicator)};
    std::vector<Quadric> quadrics =
        quadrics_over(near_level(points, indicator, cloud.scale.noise), points, kBlend.node_voxels * h,
                      cloud.scale.spacing, cloud.scale.noise, report.bare_nodes, run);
    std::vector<double> noise, radius;
    for (const Quadric& q : quadrics) {
        noise.push_back(q.noise);
        radius.push_back(q.radius);
    }
    report.noise = median(noise);
    report.radius = median(radius);
    return quadrics;
}

std::shared_ptr<const Creases> creases_of(const CloudField::Pieces& pieces) {
    std::vector<Quadric> quadrics;
    std::vector<double> reach;
    for (std::size_t n = 0; n < pieces.size(); ++n)
        if (pieces[n].crease) {
            quadrics.push_back(pieces[n]);
            reach.push_back(pieces.reach(n));
        }
    if (quadrics.empty()) return nullptr;
    return std::make_shared<const Creases>(std::move(quadrics), std::move(reach));
}

}  // namespace

CloudField::CloudField(const CloudOrientation& cloud, double h, CloudReport& report, const RunContext& run)
    : indicator_(cloud.orientation.screened ? cloud.orientation.screened : cloud.orientation.indicator) {
    report.spacing = cloud.scale.spacing;
    report.noise = cloud.scale.noise;
    report.nearest = cloud.scale.nearest;
    report.near_reach = cloud.scale.near_reach;
    report.near_noise = cloud.scale.near_noise;
    report.stray = cloud.stray;
    report.encloses = cloud.encloses;
    report.fills = cloud.fills;
    report.enclosed = cloud.enclosed;
    report.layered = cloud.orientation.layered;
    report.hints = cloud.hints;
    report.iterations = cloud.orientation.iterations;
    report.indicator_cell = cloud.orientation.indicator->cell();
    report.turned = cloud.orientation.turned;
    pieces_ = std::make_unique<const Pieces>(
        cloud.has_quadrics ? quadrics_of(cloud, *indicator_, h, report, run) : std::vector<Quadric>{}, h);
    creases_ = creases_of(*pieces_);
}

CloudField::~CloudField() = default;

FloatGridPtr CloudField::on(const Domain& domain, const RunContext& run) const {
    return level_set_of(*pieces_, *indicator_, domain, run);
}

FloatGridPtr level_set_of(const Indicator& indicator, const Domain& domain, const RunContext& run) {
    return level_set_of(CloudField::Pieces({}, domain.voxel_size), indicator, domain, run);
}

}  // namespace covol::cloud
