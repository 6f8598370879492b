// The solid behind a scan that encloses nothing: the smallest closing of the points that carries them, less the hollows
// that it need not have bridged. All on one coarse dense grid.
#include "covol/scan_solid.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "covol/distance.h"
#include "covol/error.h"
#include "detail/dense_volume.h"

namespace covol {
namespace {

using detail::DenseMask;
using detail::DenseVolume;

// Lengths are in voxels of the analysis.
constexpr double kLongestSide = 110;
constexpr double kCarryRadius = 2.0;   // what lies behind a point: room for a ball of this radius,
constexpr double kCarryReach = 3.5;    // with its centre no farther than this
constexpr double kCarriedShare = 0.95;
constexpr double kKeptShare = 0.5;     // of the voxels with points, once skins are taken away
constexpr double kFirstRadius = 4.0, kRadiusGrowth = 1.12, kLargestRadius = 1.0;  // the largest: in longest sides
constexpr double kDeeperGrowth = 1.3, kLargestDeeper = 1.0;  // of the balls that fill in deeper
constexpr int kRim = 4;                // around the points' box
constexpr double kBasinDepth = 1.4;    // a basin's inner radius over that of its widest way out, where it is one of its own
constexpr double kLeastBasin = 4.0;    // inner radius of a hollow that may be opened
constexpr double kFinest = 3.0;        // radius of the finest ball that opens dents again
constexpr double kBuried = 2.5;        // a point deeper than this no longer lies on the surface
constexpr double kSkin = 1.5;          // of a filling, left out so that fillings of different gaps do not touch
constexpr std::size_t kLeastPiece = 30;  // voxels
constexpr double kThinnest = 1.5;        // radius of the ball that opens the solid in the end: thinner skins would not last
constexpr double kTunnel = 2.0;          // and of the one that closes it
constexpr double kLeastPart = 0.01;      // of the largest part's volume
constexpr double kMayLose = 0.03;      // share of the points at a basin that may lose what is behind them

class Solid {
public:
    Solid(const std::vector<Vec3>& points, double voxel_size, const RunContext& run) : run_(run) {
        const WorldBox box = bounding_box(points);
        double longest = 0;
        for (int a = 0; a < 3; ++a) longest = std::max(longest, box.max[a] - box.min[a]);
        voxel_ = std::max(voxel_size, longest / kLongestSide);
        side_ = longest / voxel_;
        for (int a = 0; a < 3; ++a) {
            origin_[a] = box.min[a] - kRim * voxel_;
            size_[a] = int(std::lround((box.max[a] - box.min[a]) / voxel_)) + 1 + 2 * kRim;
        }
        DenseMask taken(size_, 0);
        for (const Vec3& p : points) {
            Index3 v;
            for (int a = 0; a < 3; ++a)
                v[a] = std::clamp(int(std::lround((p[a] - origin_[a]) / voxel_)), kRim, size_[a] - 1 - kRim);
            taken.values[taken.at(v[0], v[1], v[2])] = 1;
        }
        occupied_ = std::move(taken);
        // Voxels count, not points: a part that was seen twice is no larger.
        for (std::size_t n = 0; n < occupied_.values.size(); ++n)
            if (occupied_.values[n]) sites_.push_back(n);
    }

    ScanSolid find() {
        ScanSolid result;
        result.voxel_size = voxel_;
        double radius = kFirstRadius;
        for (; radius <= kLargestRadius * side_; radius *= kRadiusGrowth) {
            run_.check();
            body_ = closing(radius);
            carried_ = carried(body_);
            result.carried = share(carried_);
            if (result.carried >= kCarriedShare) break;
        }
        result.ball_radius = radius * voxel_;
        if (result.carried < kCarriedShare) return result;
        for (double larger = radius * kDeeperGrowth; larger <= kLargestDeeper * side_; larger *= kDeeperGrowth) {
            run_.check();
            fill_deeper(closing(larger));
        }
        result.carved = open_hollows();
        for (double finer = radius / kDeeperGrowth; finer >= kFinest; finer /= kDeeperGrowth) {
            run_.check();
            result.carved += open_finer(closing(finer));
        }
        smooth();
        result.carried = share(carried_);
        // Of points that fill space nothing but skins may have been left.
        if (result.carried >= kKeptShare) result.level_set = level_set();
        return result;
    }

private:
    /// What a ball of this radius cannot sweep that rolls outside, over the points.
    DenseMask closing(double radius) const {
        const int pad = int(std::ceil(radius)) + 2;
        DenseMask wide({size_[0] + 2 * pad, size_[1] + 2 * pad, size_[2] + 2 * pad}, 0);
        for (const std::size_t site : sites_) {
            const Index3 v = occupied_.voxel(site);
            wide.values[wide.at(v[0] + pad, v[1] + pad, v[2] + pad)] = 1;
        }
        const DenseVolume<float> d = detail::squared_distance(wide, true);
        const auto squared = static_cast<float>(radius * radius);
        DenseMask centers(wide.size, 0);
        std::vector<std::size_t> front{0};
        centers.values[0] = 1;
        while (!front.empty()) {
            const std::size_t n = front.back();
            front.pop_back();
            centers.neighbours(n, [&](std::size_t other) {
                if (centers.values[other] || !(d.values[other] > squared)) return;
                centers.values[other] = 1;
                front.push_back(other);
            });
        }
        const DenseVolume<float> e = detail::squared_distance(centers, true);
        DenseMask body(size_, 0);
        for (std::size_t n = 0; n < body.values.size(); ++n) {
            const Index3 v = body.voxel(n);
            body.values[n] = e.values[e.at(v[0] + pad, v[1] + pad, v[2] + pad)] >= squared;
        }
        return body;
    }

    /// By site: whether the body has room behind it.
    std::vector<std::uint8_t> carried(const DenseMask& body) const {
        const DenseVolume<float> depth = detail::squared_distance(body, false);
        DenseMask room(size_, 0);
        for (std::size_t n = 0; n < room.values.size(); ++n) room.values[n] = depth.values[n] > kCarryRadius * kCarryRadius;
        const DenseVolume<float> way = detail::squared_distance(room, true);
        std::vector<std::uint8_t> is_carried(sites_.size());
        for (std::size_t s = 0; s < sites_.size(); ++s) is_carried[s] = way.values[sites_[s]] < kCarryReach * kCarryReach;
        return is_carried;
    }

    std::vector<std::uint8_t> buried(const DenseMask& body, double deep = kBuried) const {
        const DenseVolume<float> depth = detail::squared_distance(body, false);
        std::vector<std::uint8_t> is_buried(sites_.size());
        for (std::size_t s = 0; s < sites_.size(); ++s) is_buried[s] = depth.values[sites_[s]] > deep * deep;
        return is_buried;
    }

    /// A larger ball dips less into wide gaps, and bridges what should stay open: each piece that it adds is taken when it
    /// comes to lie behind more points than it buries.
    void fill_deeper(const DenseMask& larger) {
        const DenseVolume<float> depth = detail::squared_distance(larger, false);
        DenseMask rest(size_, 0);
        for (std::size_t n = 0; n < rest.values.size(); ++n)
            rest.values[n] = !body_.values[n] && depth.values[n] > kSkin * kSkin;
        std::vector<std::uint8_t> was_buried = buried(body_);
        for (std::size_t seed = 0; seed < rest.values.size(); ++seed) {
            if (!rest.values[seed]) continue;
            const std::vector<std::size_t> piece = take_piece(rest, seed);
            if (piece.size() < kLeastPiece) continue;
            DenseMask filled = body_;
            for (const std::size_t n : piece) filled.values[n] = 1;
            std::vector<std::uint8_t> now = carried(filled), now_buried = buried(filled);
            std::ptrdiff_t gain = 0;
            for (std::size_t s = 0; s < sites_.size(); ++s)
                gain += (now[s] - carried_[s]) - (now_buried[s] - was_buried[s]);
            if (gain <= 0) continue;
            body_ = std::move(filled);
            carried_ = std::move(now);
            was_buried = std::move(now_buried);
        }
    }

    /// A smaller ball dips deeper: into dents that have points at their bottom, and into what should stay filled. Each piece
    /// that it takes is given up when that brings more points to the surface than lose what is behind them,
    /// and leaves the body's topology as it was.
    int open_finer(const DenseMask& smaller) {
        DenseMask dips(size_, 0);
        for (std::size_t n = 0; n < dips.values.size(); ++n) dips.values[n] = body_.values[n] && !smaller.values[n];
        // Without their skin, dips beside each other do not touch.
        DenseMask rest = eroded(dips, 1.0);
        std::vector<std::uint8_t> was_buried = buried(body_, kSkin);
        const std::int64_t euler = euler_characteristic(body_);
        int opened = 0;
        for (std::size_t seed = 0; seed < rest.values.size(); ++seed) {
            if (!rest.values[seed]) continue;
            const std::vector<std::size_t> piece = take_piece(rest, seed);
            if (piece.size() < kLeastPiece) continue;
            DenseMask dip(size_, 0);
            for (const std::size_t n : piece) dip.values[n] = 1;
            dip = dilated(dip, kSkin);
            DenseMask opening = body_;
            for (std::size_t n = 0; n < dip.values.size(); ++n)
                if (dip.values[n] && dips.values[n]) opening.values[n] = 0;
            std::vector<std::uint8_t> now = carried(opening), now_buried = buried(opening, kSkin);
            std::ptrdiff_t gain = 0;
            for (std::size_t s = 0; s < sites_.size(); ++s)
                gain += (was_buried[s] - now_buried[s]) - 2 * (carried_[s] - now[s]);
            if (gain <= 0 || euler_characteristic(opening) != euler) continue;
            body_ = std::move(opening);
            carried_ = std::move(now);
            was_buried = std::move(now_buried);
            ++opened;
        }
        return opened;
    }

    /// Of the union of the body's closed voxels: vertices - edges + faces - cells.
    static std::int64_t euler_characteristic(const DenseMask& body) {
        // A vertex, edge or face belongs to the union when one of the voxels around it does: those one lower along some axes.
        std::int64_t sum = 0;
        for (int i = 0; i <= body.size[0]; ++i)
            for (int j = 0; j <= body.size[1]; ++j)
                for (int k = 0; k <= body.size[2]; ++k) {
                    std::array<bool, 8> set{};
                    for (int c = 0; c < 8; ++c) {
                        const int x = i - (c >> 2), y = j - (c >> 1 & 1), z = k - (c & 1);
                        set[c] = body.contains(x, y, z) && body.values[body.at(x, y, z)];
                    }
                    // All axes: the vertex; two: an edge; one: a face; none: the voxel itself.
                    for (int axes = 0; axes < 8; ++axes) {
                        bool any = false;
                        for (int c = 0; c < 8; ++c) any |= set[c] && (c & ~axes) == 0;
                        if (any) sum += std::popcount(unsigned(axes)) % 2 == 1 ? 1 : -1;
                    }
                }
        return sum;
    }

    /// Moves the connected piece with `seed` out of `mask`.
    static std::vector<std::size_t> take_piece(DenseMask& mask, std::size_t seed) {
        std::vector<std::size_t> piece{seed};
        mask.values[seed] = 0;
        for (std::size_t next = 0; next < piece.size(); ++next)
            mask.neighbours(piece[next], [&](std::size_t other) {
                if (!mask.values[other]) return;
                mask.values[other] = 0;
                piece.push_back(other);
            });
        return piece;
    }

    static double share(const std::vector<std::uint8_t>& flags) {
        return flags.empty() ? 0.0 : double(std::accumulate(flags.begin(), flags.end(), 0)) / double(flags.size());
    }

    /// Labels of the basins of the distance to the points and to the body's surface: voxels enter from the deepest on, and
    /// two basins stay apart where both are kBasinDepth times as deep as the way between them. -1 outside.
    /// @param depth  out: by label, of the basins' deepest voxels; 0 for labels that went into others
    std::vector<std::int32_t> basins(std::vector<double>& depth) const {
        DenseMask room = body_;
        for (const std::size_t site : sites_) room.values[site] = 0;
        const DenseVolume<float> d = detail::squared_distance(room, false);
        std::vector<std::size_t> order;
        for (std::size_t n = 0; n < room.values.size(); ++n)
            if (room.values[n]) order.push_back(n);
        std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            return d.values[a] != d.values[b] ? d.values[a] > d.values[b] : a < b;
        });
        std::vector<std::int32_t> label(room.values.size(), -1), parent;
        const auto root_of = [&](std::int32_t l) {
            while (parent[l] != l) l = parent[l] = parent[parent[l]];
            return l;
        };
        for (const std::size_t n : order) {
            const double here = std::sqrt(double(d.values[n]));
            std::int32_t best = -1;
            room.neighbours(n, [&](std::size_t other) {
                if (label[other] < 0) return;
                const std::int32_t root = root_of(label[other]);
                if (best < 0 || root == best) {
                    best = root;
                    return;
                }
                const std::int32_t deep = depth[root] > depth[best] ? root : best, shallow = deep == root ? best : root;
                if (depth[shallow] < kBasinDepth * here) parent[shallow] = deep;
                best = deep;
            });
            if (best < 0) {
                best = std::int32_t(parent.size());
                parent.push_back(best);
                depth.push_back(here);
            }
            label[n] = best;
        }
        for (std::int32_t& l : label)
            if (l >= 0) l = root_of(l);
        for (std::int32_t l = 0; l < std::int32_t(depth.size()); ++l)
            if (parent[l] != l) depth[l] = 0;
        return label;
    }

    /// Cuts out the basins at the surface that carry nothing, from the shallowest on. @return how many
    int open_hollows() {
        std::vector<double> depth;
        const std::vector<std::int32_t> label = basins(depth);
        std::vector<std::int32_t> order;
        for (std::int32_t l = 0; l < std::int32_t(depth.size()); ++l)
            if (depth[l] >= kLeastBasin) order.push_back(l);
        std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) { return depth[a] < depth[b]; });
        int opened = 0;
        for (const std::int32_t basin : order) {
            run_.check();
            DenseMask hollow(size_, 0);
            for (std::size_t n = 0; n < label.size(); ++n) hollow.values[n] = label[n] == basin;
            if (!lies_at_surface(hollow)) continue;
            DenseMask rest = body_;
            for (std::size_t n = 0; n < label.size(); ++n)
                if (hollow.values[n]) rest.values[n] = 0;
            std::vector<std::uint8_t> still = carried(rest);
            const DenseVolume<float> way = detail::squared_distance(hollow, true);
            std::size_t around = 0, lost = 0;
            for (std::size_t s = 0; s < sites_.size(); ++s) {
                if (!(way.values[sites_[s]] < 9.0F)) continue;
                ++around;
                lost += carried_[s] && !still[s];
            }
            if (double(lost) > kMayLose * double(around)) continue;
            body_ = std::move(rest);
            carried_ = std::move(still);
            ++opened;
        }
        return opened;
    }

    bool lies_at_surface(const DenseMask& hollow) const {
        for (std::size_t n = 0; n < hollow.values.size(); ++n) {
            if (!hollow.values[n]) continue;
            bool open = false;
            hollow.neighbours(n, [&](std::size_t other) { open |= !body_.values[other]; });
            if (open) return true;
        }
        return false;
    }

    /// Takes away skins, then tunnels through what is left and parts of no size.
    void smooth() {
        body_ = dilated(eroded(body_, kThinnest), kThinnest);
        body_ = eroded(dilated(body_, kTunnel), kTunnel);
        carried_ = carried(body_);
        DenseMask rest = body_;
        std::vector<std::vector<std::size_t>> parts;
        std::size_t largest = 0;
        for (std::size_t seed = 0; seed < rest.values.size(); ++seed) {
            if (!rest.values[seed]) continue;
            parts.push_back(take_piece(rest, seed));
            largest = std::max(largest, parts.back().size());
        }
        for (const std::vector<std::size_t>& part : parts)
            if (double(part.size()) < kLeastPart * double(largest))
                for (const std::size_t n : part) body_.values[n] = 0;
    }

    static DenseMask eroded(const DenseMask& body, double radius) {
        const DenseVolume<float> depth = detail::squared_distance(body, false);
        DenseMask result(body.size, 0);
        for (std::size_t n = 0; n < result.values.size(); ++n) result.values[n] = depth.values[n] > radius * radius;
        return result;
    }
    static DenseMask dilated(const DenseMask& body, double radius) {
        const DenseVolume<float> way = detail::squared_distance(body, true);
        DenseMask result(body.size, 0);
        for (std::size_t n = 0; n < result.values.size(); ++n) result.values[n] = way.values[n] <= radius * radius;
        return result;
    }

    FloatGridPtr level_set() const {
        const DenseVolume<float> inside = detail::squared_distance(body_, false), outside = detail::squared_distance(body_, true);
        const Domain domain{voxel_, origin_, {0, 0, 0}, {size_[0] - 1, size_[1] - 1, size_[2] - 1}};
        FloatGridPtr grid = make_grid(domain, static_cast<float>(kRim * voxel_), "solid");
        auto accessor = grid->getAccessor();
        for (std::size_t n = 0; n < body_.values.size(); ++n) {
            const double d = body_.values[n] ? 0.5 - std::sqrt(double(inside.values[n])) : std::sqrt(double(outside.values[n])) - 0.5;
            const Index3 v = body_.voxel(n);
            accessor.setValue(openvdb::Coord(v[0], v[1], v[2]), static_cast<float>(voxel_ * d));
        }
        return grid;
    }

    const RunContext& run_;
    double voxel_ = 0, side_ = 0;  ///< the longest side in voxels
    Vec3 origin_{};
    Index3 size_{};
    DenseMask occupied_, body_;
    std::vector<std::size_t> sites_;  ///< the voxels with a point
    std::vector<std::uint8_t> carried_;
};

}  // namespace

ScanSolid solid_from_scan(const std::vector<Vec3>& points, double voxel_size, const RunContext& run) {
    if (points.empty()) throw Error(Errc::InvalidInput, "solid_from_scan: expected at least one point, got none");
    if (!(voxel_size > 0) || !std::isfinite(voxel_size))
        throw Error(Errc::InvalidOptions, "solid_from_scan: voxel_size: expected > 0, got " + std::to_string(voxel_size));
    ScanSolid solid;
    with_threads(run, [&] { solid = Solid(points, voxel_size, run).find(); });
    return solid;
}

double share_without_points(const TriangleMesh& mesh, const FloatGrid& distance, double reach, const RunContext& run) {
    struct Areas {
        double total = 0, bare = 0;
    } areas;
    with_threads(run, [&] {
        // The same splits, and so the same bits, on any number of threads.
        areas = tbb::parallel_deterministic_reduce(
            tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), Areas{},
            [&](const tbb::blocked_range<std::size_t>& range, Areas sum) {
                const auto known = distance.getConstAccessor();
                for (std::size_t t = range.begin(); t != range.end(); ++t) {
                    openvdb::Vec3d corner[3];
                    for (int n = 0; n < 3; ++n) {
                        const auto& v = mesh.vertices[mesh.triangles[t][n]];
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
            [](const Areas& a, const Areas& b) { return Areas{a.total + b.total, a.bare + b.bare}; });
    });
    return areas.total > 0 ? areas.bare / areas.total : 0.0;
}

double share_without_points(const TriangleMesh& mesh, const std::vector<Vec3>& points, double reach, const RunContext& run) {
    if (points.empty() || mesh.empty()) return 0;
    const Domain domain = domain_of_box(bounding_box(points, reach), reach / 3);
    return share_without_points(mesh, *distance(points, domain, {reach}, run).grid, reach, run);
}

}  // namespace covol
