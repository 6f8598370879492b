#include "start/grow.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

#include "base/heuristics.h"
#include "base/median.h"
#include "base/number.h"
#include "covol/start.h"
#include "start/heuristics.h"

namespace covol::detail {
namespace {

using openvdb::Coord;

constexpr std::size_t kMaxVoxels = 24u << 20;

struct Spread {
    double middle = 0, width = 0;  // median, and the standard deviation estimated from the median absolute deviation
};

Spread spread_of(std::vector<float> values) {
    Spread spread;
    spread.middle = cloud::median(values);
    for (float& v : values) v = std::abs(v - float(spread.middle));
    spread.width = 1.4826 * cloud::median(values);
    return spread;
}

/// A box of voxels of the domain; k varies fastest.
class Box {
public:
    Box(const Coord& min, const Coord& max) : min_(min), size_(max - min + Coord(1)) {}
    [[nodiscard]] std::size_t count() const {
        return std::size_t(size_[0]) * std::size_t(size_[1]) * std::size_t(size_[2]);
    }
    [[nodiscard]] Coord at(std::size_t n) const {
        const auto k = int(n % std::size_t(size_[2])), j = int(n / std::size_t(size_[2]) % std::size_t(size_[1])),
                   i = int(n / std::size_t(size_[2]) / std::size_t(size_[1]));
        return min_ + Coord(i, j, k);
    }
    [[nodiscard]] const Coord& min() const { return min_; }
    [[nodiscard]] Coord max() const { return min_ + size_ - Coord(1); }
    [[nodiscard]] std::size_t stride(int axis) const {
        return axis == 2 ? 1 : axis == 1 ? std::size_t(size_[2]) : std::size_t(size_[2]) * std::size_t(size_[1]);
    }
    /// Calls visit(neighbour, axis) for the neighbours across the six faces.
    template <typename Visit>
    void for_each_neighbour(std::size_t n, const Visit& visit) const {
        const Coord c = at(n) - min_;
        for (int axis = 0; axis < 3; ++axis) {
            if (c[axis] > 0) visit(n - stride(axis), axis);
            if (c[axis] + 1 < size_[axis]) visit(n + stride(axis), axis);
        }
    }
    void blur(std::vector<float>& values, double sigma) const;

private:
    Coord min_, size_;
};

void Box::blur(std::vector<float>& values, double sigma) const {
    if (!(sigma > 0)) return;
    const int reach = std::max(1, int(std::ceil(3 * sigma)));
    std::vector<double> weight;
    double sum = 0;
    for (int n = -reach; n <= reach; ++n) sum += weight.emplace_back(std::exp(-0.5 * n * n / (sigma * sigma)));
    std::vector<float> line, result(values.size());
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t step = stride(axis);
        const int length = size_[axis];
        for (std::size_t start = 0; start < values.size(); ++start) {
            if ((at(start) - min_)[axis] != 0) continue;
            for (int n = 0; n < length; ++n) {
                double value = 0;
                for (int m = -reach; m <= reach; ++m)
                    value += weight[std::size_t(m + reach)] *
                             double(values[start + std::size_t(std::clamp(n + m, 0, length - 1)) * step]);
                result[start + std::size_t(n) * step] = float(value / sum);
            }
        }
        values.swap(result);
    }
}

/// A front that begins at the start and takes the voxels of a box in the order in which it arrives at them.
class Front {
public:
    /// @param sigma  standard deviation of the Gaussian with which the image was smoothed, voxels
    Front(const Box& box, const std::vector<float>& image, const std::vector<float>& level, double voxel, double sigma)
        : box_(box), image_(image), level_(level), voxel_(voxel), correlated_faces_(1 + 4 * M_PI * sigma * sigma) {}

    /// Empty if the start can be grown, else the reason against it.
    std::string check_start() {
        std::vector<float> inside, shell, all;
        const std::size_t skip = 1 + image_.size() / 200'000;
        for (std::size_t n = 0; n < image_.size(); n += skip) all.push_back(image_[n]);
        for (std::size_t n = 0; n < image_.size(); ++n) {
            if (level_[n] < 0) inside.push_back(image_[n]);
            if (std::abs(level_[n]) < 1.5 * voxel_) shell.push_back(image_[n]);
        }
        if (inside.empty() || shell.empty()) return "the start contains no voxel";
        std::sort(all.begin(), all.end());
        const double range = double(all[std::size_t(0.995 * double(all.size() - 1))]) -
                             double(all[std::size_t(0.005 * double(all.size() - 1))]);
        if (!(range > 0)) return "the image is constant";
        inside_ = spread_of(inside);
        inside_.width = std::max(inside_.width, kCommon.negligible * range);
        Spread surface = spread_of(shell);
        surface.width = std::max({surface.width, inside_.width, 2 * kCommon.negligible * range});
        const auto unlike = std::count_if(inside.begin(), inside.end(), [&](float v) {
            return std::abs(v - surface.middle) > kCommon.errors * surface.width;
        });
        if (double(unlike) > kCommon.negligible * double(inside.size()))
            return "the image differs between the inside and the surface of the start";
        return {};
    }

    void march(const RunContext& run) {
        arrival_.assign(image_.size(), std::numeric_limits<float>::max());
        taken_.assign(image_.size(), 0);
        std::vector<std::size_t> first;
        for (std::size_t n = 0; n < image_.size(); ++n)
            if (level_[n] < 0) {
                arrival_[n] = 0;
                take(n);
                first.push_back(n);
            }
        start_edge_ = edge();
        start_count_ = order_.size();
        for (const std::size_t n : first) offer_neighbours(n);
        while (!waiting_.empty()) {
            const auto [time, n] = waiting_.top();
            waiting_.pop();
            if (taken_[n] || time > arrival_[n]) continue;
            take(n);
            offer_neighbours(n);
            if (edge() > best_edge_ && order_.size() > start_count_) {
                best_edge_ = edge();
                best_count_ = order_.size();
            }
            // The front has passed the best edge if its present one is clearly weaker.
            if (kCommon.clear_ratio * edge() < best_edge_ && is_clear()) break;
            if (order_.size() % 65536 == 0) run.check();
        }
    }

    [[nodiscard]] bool is_clear() const { return best_edge_ > kGrow.clear * inside_.width; }
    [[nodiscard]] bool starts_at_edge() const { return kCommon.clear_ratio * start_edge_ > best_edge_; }
    [[nodiscard]] double growth() const { return double(best_count_) / double(std::max<std::size_t>(start_count_, 1)); }
    [[nodiscard]] double best_edge() const { return best_edge_; }
    [[nodiscard]] double spread() const { return inside_.width; }

    /// 1 inside the best front, else 0.
    [[nodiscard]] std::vector<float> region() const {
        std::vector<float> in(image_.size(), 0.0F);
        for (std::size_t n = 0; n < best_count_; ++n) in[order_[n]] = 1;
        return in;
    }
    /// Whether the best front reaches a side of the box that is not a side of the domain.
    [[nodiscard]] bool needs_more(const Domain& domain) const {
        for (std::size_t n = 0; n < best_count_; ++n) {
            const Coord at = box_.at(order_[n]);
            for (int a = 0; a < 3; ++a)
                if ((at[a] == box_.min()[a] && at[a] > domain.min[a]) ||
                    (at[a] == box_.max()[a] && at[a] < domain.max[a]))
                    return true;
        }
        return false;
    }

private:
    /// The mean change of the image across the front's faces, minus the error that noise causes in this mean.
    [[nodiscard]] double edge() const {
        if (faces_ <= 0) return 0;
        const auto count = double(faces_);
        const double error = inside_.width / std::sqrt(count / correlated_faces_);
        return std::max(std::abs(change_) / count - kCommon.errors * error, 0.0);
    }

    void take(std::size_t n) {
        taken_[n] = 1;
        order_.push_back(std::uint32_t(n));
        box_.for_each_neighbour(n, [&](std::size_t other, int) {
            const double step = double(image_[n]) - double(image_[other]);
            // The changes at a face between two voxels of the region cancel, and the face is not counted.
            change_ += step;
            faces_ += taken_[other] ? -1 : 1;
        });
    }

    void offer_neighbours(std::size_t n) {
        box_.for_each_neighbour(n, [&](std::size_t other, int) {
            if (taken_[other]) return;
            const float time = arrival_at(other);
            if (time >= arrival_[other]) return;
            arrival_[other] = time;
            waiting_.push({time, std::uint32_t(other)});
        });
    }

    /// The time T at which the front arrives at voxel n: Godunov's upwind solution of speed |grad T| = 1 (Sethian,
    /// PNAS 93, 1996).
    [[nodiscard]] float arrival_at(std::size_t n) const {
        std::array<double, 3> near;
        near.fill(std::numeric_limits<double>::infinity());
        box_.for_each_neighbour(n, [&](std::size_t other, int axis) {
            if (taken_[other]) near[axis] = std::min(near[axis], double(arrival_[other]));
        });
        std::sort(near.begin(), near.end());
        // At a difference of kCommon.errors standard deviations, which noise hardly explains, the front is half as
        // fast as inside; at larger ones it is much slower.
        const double away = std::abs(double(image_[n]) - inside_.middle) / (kCommon.errors * inside_.width);
        const double slowness = 1 + away * away * away * away;
        double time = near[0] + slowness, sum = near[0], squares = near[0] * near[0];
        for (int m = 1; m < 3 && near[m] < time; ++m) {
            sum += near[m];
            squares += near[m] * near[m];
            const double root = sum * sum - (m + 1) * (squares - slowness * slowness);
            if (root < 0) break;
            time = (sum + std::sqrt(root)) / (m + 1);
        }
        return float(time);
    }

    struct Waiting {
        float time;
        std::uint32_t voxel;
        bool operator<(const Waiting& other) const {
            return time > other.time || (time == other.time && voxel > other.voxel);
        }
    };

    const Box& box_;
    const std::vector<float>&image_, &level_;
    // Edge of a voxel, world units; and number of faces of a front whose errors are correlated by the smoothing.
    double voxel_, correlated_faces_;
    Spread inside_;
    std::vector<float> arrival_;
    std::vector<char> taken_;
    std::vector<std::uint32_t> order_;
    std::priority_queue<Waiting> waiting_;
    // Sum of the image's changes over the front's faces, from inside to outside; edge() of the start; maximum of edge()
    // of later fronts.
    double change_ = 0, start_edge_ = 0, best_edge_ = 0;
    std::int64_t faces_ = 0;
    std::size_t start_count_ = 0, best_count_ = 0;
};

FloatGridPtr level_set_of(const Box& box, std::vector<float> region, const Domain& domain, const RunContext& run) {
    box.blur(region, 0.7);  // smooths the steps of the voxels
    FloatGridPtr grid = make_grid(domain, 0.5F, "region");
    auto accessor = grid->getAccessor();
    for (std::size_t n = 0; n < region.size(); ++n)
        if (region[n] > 1e-4F) accessor.setValue(box.at(n), 0.5F - region[n]);
    return start_from_grid(domain, *grid, run);
}

}  // namespace

GrownStart grow_to_edges(const Image& image, const FloatGrid& start, double sigma, const RunContext& run) {
    const Domain domain = domain_of(start);
    const openvdb::CoordBBox active = start.evalActiveVoxelBoundingBox();
    // [voxels] First margin around the start. It is at least as wide as the band, which the box therefore contains.
    int pad = active.dim()[active.dim().maxIndex()];
    for (;; pad *= 2) {
        Coord lo, hi;
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::max(domain.min[a], active.min()[a] - pad);
            hi[a] = std::min(domain.max[a], active.max()[a] + pad);
        }
        const Box box(lo, hi);
        if (box.count() > kMaxVoxels) return {nullptr, "the part of the image to be searched is too large"};
        std::vector<float> values(box.count()), level(box.count());
        image.sample(domain, {lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}, values.data());
        image.release();
        box.blur(values, sigma / domain.voxel_size);
        const auto accessor = start.getConstAccessor();
        for (std::size_t n = 0; n < level.size(); ++n) level[n] = accessor.getValue(box.at(n));
        run.check();
        Front front(box, values, level, domain.voxel_size, sigma / domain.voxel_size);
        if (std::string why = front.check_start(); !why.empty()) return {nullptr, why};
        front.march(run);
        if (front.needs_more(domain)) continue;
        if (!front.is_clear()) return {nullptr, "no position of the front has a clear edge"};
        if (front.starts_at_edge()) return {nullptr, "the start already lies at an edge"};
        return {level_set_of(box, front.region(), domain, run),
                "from " + number(1 / front.growth()) + " of the volume: across the front, the image changes by " +
                    number(front.best_edge() / front.spread()) + " times its spread inside per voxel"};
    }
}

}  // namespace covol::detail
