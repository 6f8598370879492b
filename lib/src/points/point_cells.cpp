#include "points/point_cells.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "base/geometry.h"

namespace covol::cloud {
namespace {

constexpr int kKeyBits = 20;  // number of bits of a cell's index along each axis
constexpr std::int64_t kMaxRowsPerCell = 4;

std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    return (std::uint64_t(i) << (2 * kKeyBits)) | (std::uint64_t(j) << kKeyBits) | std::uint64_t(k);
}

}  // namespace

PointCells::PointCells(const std::vector<Vec3>& points, double edge) : edge_(edge) {
    if (points.empty()) {
        count_ = {0, 0, 0};
        lowest_ = {0, 0, 0};
        starts_ = {0};
        return;
    }
    const WorldBox box = bounding_box(points);
    lowest_ = box.min;
    for (int a = 0; a < 3; ++a) edge_ = std::max(edge_, (box.max[a] - box.min[a]) / double((1 << kKeyBits) - 1));
    for (int a = 0; a < 3; ++a) count_[a] = std::int64_t((box.max[a] - box.min[a]) / edge_) + 1;
    struct Entry {
        std::uint64_t key;
        std::uint32_t index;
        bool operator<(const Entry& other) const { return key != other.key ? key < other.key : index < other.index; }
    };
    std::vector<Entry> entries(points.size());
    tbb::parallel_for(std::size_t(0), points.size(), [&](std::size_t n) {
        const Vec3& p = points[n];
        entries[n] = {key(cell_along(p[0], 0), cell_along(p[1], 1), cell_along(p[2], 2)), std::uint32_t(n)};
    });
    tbb::parallel_sort(entries.begin(), entries.end());
    order_.resize(points.size());
    sorted_.resize(points.size());
    for (std::size_t n = 0; n < entries.size(); ++n) {
        if (n == 0 || entries[n].key != entries[n - 1].key) {
            keys_.push_back(entries[n].key);
            starts_.push_back(std::uint32_t(n));
        }
        order_[n] = entries[n].index;
        sorted_[n] = points[entries[n].index];
    }
    starts_.push_back(std::uint32_t(points.size()));
    index_rows();
}

void PointCells::index_rows() {
    const std::int64_t count = count_[0] * count_[1];
    if (count > kMaxRowsPerCell * std::int64_t(keys_.size())) return;
    rows_.assign(std::size_t(count) + 1, 0);
    for (const std::uint64_t k : keys_)
        ++rows_[std::size_t((k >> (2 * kKeyBits)) * std::uint64_t(count_[1]) +
                            (k >> kKeyBits & ((1U << kKeyBits) - 1))) +
                1];
    for (std::size_t n = 1; n < rows_.size(); ++n) rows_[n] += rows_[n - 1];
}

std::int64_t PointCells::cell_along(double x, int axis) const {
    const double at = (x - lowest_[axis]) / edge_;
    return std::int64_t(std::clamp(std::floor(at), 0.0, double(count_[axis] - 1)));
}

void PointCells::find(const WorldBox& box, std::vector<Range>& ranges) const {
    ranges.clear();
    if (order_.empty()) return;
    std::array<std::int64_t, 3> first, last;
    for (int a = 0; a < 3; ++a) {
        first[a] = cell_along(box.min[a], a);
        last[a] = cell_along(box.max[a], a);
    }
    for (std::int64_t i = first[0]; i <= last[0]; ++i)
        for (std::int64_t j = first[1]; j <= last[1]; ++j) {
            auto begin = keys_.begin(), end = keys_.end();
            if (!rows_.empty()) {
                const std::size_t row = std::size_t(i * count_[1] + j);
                end = begin + rows_[row + 1];
                begin += rows_[row];
            }
            const auto from = std::lower_bound(begin, end, key(i, j, first[2]));
            const auto to = std::upper_bound(from, end, key(i, j, last[2]));
            if (from != to)
                ranges.push_back(
                    {starts_[std::size_t(from - keys_.begin())], starts_[std::size_t(to - keys_.begin())]});
        }
}

void PointCells::find(const Vec3& place, double reach, std::vector<Range>& ranges) const {
    WorldBox box;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = place[a] - reach;
        box.max[a] = place[a] + reach;
    }
    find(box, ranges);
}

bool PointCells::any_within(const Vec3& place, double reach) const {
    std::vector<Range> ranges;
    find(place, reach, ranges);
    return std::any_of(ranges.begin(), ranges.end(), [&](const Range& range) {
        return std::any_of(sorted_.begin() + range.begin, sorted_.begin() + range.end, [&](const Vec3& p) {
            const Vec3 to = minus(p, place);
            return dot(to, to) < reach * reach;
        });
    });
}

}  // namespace covol::cloud
