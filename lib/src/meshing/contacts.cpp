#include "meshing/contacts.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <array>
#include <cmath>
#include <limits>

namespace covol::meshing {
namespace {

/// Margin for rounding errors of triple products of sides or corners of triangles, as a fraction of the cube of the
/// triangles' size. The errors are far smaller, because the products are computed in double precision from
/// single-precision coordinates.
constexpr double kRounding = 1e-13;
constexpr double kFacing = 0.05;  // minimum cosine between a normal and the direction of a single sheet

/// Whether the projections of the triangles s and t onto an axis are disjoint, by more than `margin`.
bool separates(const Vec3& axis, const Vec3* s, const Vec3* t, double margin) {
    double s_low = std::numeric_limits<double>::max(), s_high = -s_low, t_low = s_low, t_high = -s_low;
    for (int k = 0; k < 3; ++k) {
        const double a = dot(axis, s[k]), b = dot(axis, t[k]);
        s_low = std::min(s_low, a);
        s_high = std::max(s_high, a);
        t_low = std::min(t_low, b);
        t_high = std::max(t_high, b);
    }
    return s_high + margin < t_low || t_high + margin < s_low;
}

/// Whether the projections of two triangles that share no corner are disjoint on one of the axes of the separating axis
/// theorem: the normals, and the cross products of two sides.
bool apart_distinct(const Vec3* s, const Vec3* t, double size) {
    const Vec3 ns = area_normal(s[0], s[1], s[2]), nt = area_normal(t[0], t[1], t[2]);
    const double margin = kRounding * size * size * size;
    if (separates(ns, s, t, margin) || separates(nt, s, t, margin)) return true;
    for (int i = 0; i < 3; ++i) {
        const Vec3 side = minus(s[(i + 1) % 3], s[i]);
        for (int j = 0; j < 3; ++j)
            if (separates(cross(side, minus(t[(j + 1) % 3], t[j])), s, t, margin)) return true;
    }
    for (int i = 0; i < 3; ++i) {  // for triangles in one plane: axes in this plane, perpendicular to a side
        if (separates(cross(ns, minus(s[(i + 1) % 3], s[i])), s, t, margin * size)) return true;
        if (separates(cross(nt, minus(t[(i + 1) % 3], t[i])), s, t, margin * size)) return true;
    }
    return false;
}

/// For triangles that share corner 0, which is the origin: whether a plane through the origin separates the other
/// corners of s from those of t. Corners may lie in the plane, but not one of s and one of t in the same direction from
/// the origin.
bool apart_at_corner(const Vec3* s, const Vec3* t, double size) {
    const double margin = kRounding * size * size * size;
    const auto side = [&](const Vec3& axis, const Vec3& p) { return dot(axis, p); };
    const Vec3 ns = cross(s[1], s[2]), nt = cross(t[1], t[2]);
    const double t1 = side(ns, t[1]), t2 = side(ns, t[2]);
    if ((t1 > margin && t2 > margin) || (t1 < -margin && t2 < -margin)) return true;
    const double s1 = side(nt, s[1]), s2 = side(nt, s[2]);
    if ((s1 > margin && s2 > margin) || (s1 < -margin && s2 < -margin)) return true;
    for (int i = 1; i < 3; ++i)
        for (int j = 1; j < 3; ++j) {
            const Vec3 axis = cross(s[i], t[j]);  // normal of a plane through a corner of each
            if (!(length(axis) > kRounding * size * size)) continue;
            const double a = side(axis, s[3 - i]), b = side(axis, t[3 - j]);
            if ((a > margin && b < -margin) || (a < -margin && b > margin)) return true;
        }
    for (int i = 1; i < 3; ++i) {  // planes perpendicular to one triangle through one of its sides
        const Vec3 across_s = cross(ns, s[i]), across_t = cross(nt, t[i]);
        const double a = side(across_s, s[3 - i]), b1 = side(across_s, t[1]), b2 = side(across_s, t[2]);
        if ((a > 0 && b1 < -margin * size && b2 < -margin * size) ||
            (a < 0 && b1 > margin * size && b2 > margin * size))
            return true;
        const double b = side(across_t, t[3 - i]), a1 = side(across_t, s[1]), a2 = side(across_t, s[2]);
        if ((b > 0 && a1 < -margin * size && a2 < -margin * size) ||
            (b < 0 && a1 > margin * size && a2 > margin * size))
            return true;
    }
    return false;
}

/// For triangles that share the side 0-1: they are apart unless they lie in one plane, on the same side of the edge.
bool apart_at_side(const Vec3* s, const Vec3* t, double size) {
    const Vec3 ns = area_normal(s[0], s[1], s[2]), nt = area_normal(t[0], t[1], t[2]);
    if (std::abs(dot(ns, minus(t[2], t[0]))) > kRounding * size * size * size) return true;
    return dot(ns, nt) < 0;  // opposite normals: the corners 2 lie on different sides of the edge
}

template <typename PerThread>
auto gathered(const PerThread& found) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
    for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
    tbb::parallel_sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

}  // namespace

bool are_apart(const Positions& positions, const Triangle& s, const Triangle& t) {
    // Moves the shared corners to the front, in the same order in both triangles.
    Triangle first = s, second = t;
    int shared = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = shared; j < 3; ++j)
            if (first[i] == second[j]) {
                std::swap(first[i], first[shared]);
                std::swap(second[j], second[shared]);
                ++shared;
                break;
            }
    if (shared == 3) return false;
    const Vec3 origin = to_vec3(positions[first[0]]);
    Vec3 p[3], q[3];
    double size = 0;
    for (int k = 0; k < 3; ++k) {
        p[k] = minus(to_vec3(positions[first[k]]), origin);
        q[k] = minus(to_vec3(positions[second[k]]), origin);
        for (int a = 0; a < 3; ++a) size = std::max({size, std::abs(p[k][a]), std::abs(q[k][a])});
    }
    return shared == 0   ? apart_distinct(p, q, size)
           : shared == 1 ? apart_at_corner(p, q, size)
                         : apart_at_side(p, q, size);
}

ContactFinder::ContactFinder(const Positions& positions, const std::vector<Triangle>& triangles)
    : positions_(&positions), triangles_(&triangles) {
    rebuild();
}

void ContactFinder::rebuild() {
    const Positions& positions = *positions_;
    const std::vector<Triangle>& triangles = *triangles_;
    constexpr int kBits = 10;
    Position low{}, high{};
    low.fill(std::numeric_limits<float>::max());
    high.fill(std::numeric_limits<float>::lowest());
    for (const Position& p : positions)
        for (int a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], p[a]);
            high[a] = std::max(high[a], p[a]);
        }
    float longest = 0;
    for (int a = 0; a < 3 && !positions.empty(); ++a) longest = std::max(longest, high[a] - low[a]);
    const float scale = longest > 0 ? float((1 << kBits) - 1) / longest : 0.0F;
    std::vector<std::uint64_t> keyed;  // high 32 bits: position of a triangle along a Z-order curve; low: its number
    keyed.reserve(triangles.size());
    for (std::size_t n = 0; n < triangles.size(); ++n)
        if (triangles[n][0] < positions.size()) keyed.push_back(n);
    tbb::parallel_for(std::size_t(0), keyed.size(), [&](std::size_t n) {
        std::uint64_t key = 0;
        for (int a = 0; a < 3; ++a) {
            const auto cell = std::uint32_t((positions[triangles[keyed[n]][0]][a] - low[a]) * scale);
            for (int bit = 0; bit < kBits; ++bit) key |= std::uint64_t(cell >> bit & 1U) << (3 * bit + a);
        }
        keyed[n] |= key << 32;
    });
    tbb::parallel_sort(keyed.begin(), keyed.end());
    order_.resize(keyed.size());
    place_.resize(triangles.size());
    for (std::size_t n = 0; n < order_.size(); ++n) {
        order_[n] = std::uint32_t(keyed[n]);
        place_[order_[n]] = std::uint32_t(n);
    }
    for (runs_ = 1; runs_ * kRun < order_.size();) runs_ *= 2;
    boxes_.resize(2 * runs_ - 1);
    triangle_boxes_.resize(order_.size());
    update();
}

void ContactFinder::add_contact(std::uint32_t s, std::uint32_t t, std::vector<Pair>& pairs) const {
    if (!are_apart(*positions_, (*triangles_)[s], (*triangles_)[t])) pairs.emplace_back(std::min(s, t), std::max(s, t));
}

ContactFinder::Box ContactFinder::box_of(const Triangle& t) const {
    constexpr float kFar = std::numeric_limits<float>::max();
    Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
    if (t[0] >= positions_->size()) return box;
    for (const std::uint32_t v : t)
        for (int a = 0; a < 3; ++a) {
            box.low[a] = std::min(box.low[a], (*positions_)[v][a]);
            box.high[a] = std::max(box.high[a], (*positions_)[v][a]);
        }
    return box;
}

void ContactFinder::update() {
    constexpr float kFar = std::numeric_limits<float>::max();
    tbb::parallel_for(std::size_t(0), runs_, [&](std::size_t run) {
        Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
        for (std::size_t n = run * kRun; n < std::min((run + 1) * kRun, order_.size()); ++n) {
            triangle_boxes_[n] = box_of((*triangles_)[order_[n]]);
            join(box, triangle_boxes_[n]);
        }
        boxes_[runs_ - 1 + run] = box;
    });
    for (std::size_t n = runs_ - 1; n-- > 0;) {
        boxes_[n] = boxes_[2 * n + 1];
        join(boxes_[n], boxes_[2 * n + 2]);
    }
}

void ContactFinder::grow(std::uint32_t triangle) {
    const std::size_t place = place_[triangle];
    const Box box = box_of((*triangles_)[triangle]);
    triangle_boxes_[place] = box;
    for (std::size_t node = runs_ - 1 + place / kRun;; node = (node - 1) / 2) {
        join(boxes_[node], box);
        if (node == 0) break;
    }
}

std::uint64_t ContactFinder::key_of(const Position& p, int dx, int dy, int dz) const {
    const auto cell = [&](int a, int shift) {
        return std::uint64_t(std::int64_t(std::floor((p[a] - cell_origin_[a]) / cell_size_)) + shift + (1 << 20));
    };
    return cell(0, dx) << 42 | cell(1, dy) << 21 | cell(2, dz);
}

const ContactFinder::Cell* ContactFinder::cell_at(std::uint64_t key) const {
    const auto at = std::lower_bound(cells_.begin(), cells_.end(), key,
                                     [](const Cell& cell, std::uint64_t k) { return cell.key < k; });
    return at != cells_.end() && at->key == key ? &*at : nullptr;
}

void ContactFinder::find_single_sheets() {
    const auto middle = [&](std::size_t place) {
        const Box& box = triangle_boxes_[place];
        return Position{0.5F * (box.low[0] + box.high[0]), 0.5F * (box.low[1] + box.high[1]),
                        0.5F * (box.low[2] + box.high[2])};
    };
    cells_.clear();
    if (order_.empty()) return;
    cell_size_ = 0;
    for (const Box& box : triangle_boxes_)
        for (int a = 0; a < 3; ++a) cell_size_ = std::max(cell_size_, box.high[a] - box.low[a]);
    cell_origin_ = boxes_[0].low;
    const float whole = std::max({boxes_[0].high[0] - boxes_[0].low[0], boxes_[0].high[1] - boxes_[0].low[1],
                                  boxes_[0].high[2] - boxes_[0].low[2]});
    // With relatively smaller cells, no sheets are found: a cell's indices might not fit into 21 bits each (key_of()).
    if (!(cell_size_ > 1e-5F * whole)) return;
    // Margin for rounding, so that the centres of triangles that touch lie in neighbouring cells.
    cell_size_ *= 1.001F;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed;
    keyed.reserve(order_.size());
    for (std::size_t n = 0; n < order_.size(); ++n)
        if ((*triangles_)[order_[n]][0] < positions_->size()) keyed.emplace_back(0, std::uint32_t(n));
    tbb::parallel_for(std::size_t(0), keyed.size(),
                      [&](std::size_t n) { keyed[n].first = key_of(middle(keyed[n].second)); });
    tbb::parallel_sort(keyed.begin(), keyed.end());
    std::vector<std::size_t> starts;
    for (std::size_t n = 0; n < keyed.size(); ++n)
        if (n == 0 || keyed[n].first != keyed[n - 1].first) {
            starts.push_back(n);
            cells_.push_back({keyed[n].first, {}});
        }
    starts.push_back(keyed.size());
    std::vector<Vec3> normals(keyed.size()), sums(cells_.size());
    tbb::parallel_for(std::size_t(0), cells_.size(), [&](std::size_t c) {
        for (std::size_t n = starts[c]; n < starts[c + 1]; ++n) {
            normals[n] = area_normal(*positions_, (*triangles_)[order_[keyed[n].second]]);
            sums[c] = plus(sums[c], 1, normals[n]);
        }
    });
    tbb::parallel_for(std::size_t(0), cells_.size(), [&](std::size_t c) {
        std::array<const Cell*, 27> around{};
        Vec3 direction{};
        const Position p = middle(keyed[starts[c]].second);
        for (int n = 0; n < 27; ++n) {
            around[n] = cell_at(key_of(p, n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
            if (around[n] != nullptr) direction = plus(direction, 1, sums[std::size_t(around[n] - cells_.data())]);
        }
        const double size = length(direction);
        bool single = size > 0;
        for (const Cell* cell : around) {
            if (cell == nullptr || !single) continue;
            const auto number = std::size_t(cell - cells_.data());
            for (std::size_t n = starts[number]; n < starts[number + 1]; ++n)
                single = single && dot(normals[n], direction) > kFacing * size * length(normals[n]);
        }
        if (single) cells_[c].direction = {direction[0] / size, direction[1] / size, direction[2] / size};
    });
}

Vec3 ContactFinder::single_sheet(const Position& p) const {
    const Cell* cell = cells_.empty() ? nullptr : cell_at(key_of(p));
    return cell != nullptr ? cell->direction : Vec3{};
}

std::vector<ContactFinder::Pair> ContactFinder::contacts(bool was_free) {
    cells_.clear();
    if (was_free) find_single_sheets();
    std::vector<std::uint8_t> single(order_.size(), 0);
    tbb::parallel_for(std::size_t(0), single.size(), [&](std::size_t n) {
        const Box& box = triangle_boxes_[n];
        const Vec3 direction = single_sheet(
            {0.5F * (box.low[0] + box.high[0]), 0.5F * (box.low[1] + box.high[1]), 0.5F * (box.low[2] + box.high[2])});
        single[n] = dot(direction, direction) > 0;
    });
    tbb::enumerable_thread_specific<std::vector<Pair>> found;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, runs_, 64), [&](const auto& range) {
        auto& mine = found.local();
        std::vector<std::size_t> close;
        for (std::size_t run = range.begin(); run < range.end(); ++run) {
            const std::size_t begin = run * kRun, end = std::min((run + 1) * kRun, order_.size());
            if (begin >= end || std::all_of(single.begin() + std::ptrdiff_t(begin),
                                            single.begin() + std::ptrdiff_t(end), [](auto s) { return s != 0; }))
                continue;
            close.clear();
            descend(boxes_[runs_ - 1 + run], run, [&](std::size_t place) {
                if (single[place] == 0) close.push_back(place);
            });
            for (std::size_t n = begin; n < end; ++n)
                for (const std::size_t other : close)
                    if (single[n] == 0 && other > n && meet(triangle_boxes_[n], triangle_boxes_[other]))
                        add_contact(order_[n], order_[other], mine);
        }
    });
    return gathered(found);
}

std::vector<ContactFinder::Pair> ContactFinder::contacts_of(const std::vector<std::uint32_t>& some) const {
    tbb::enumerable_thread_specific<std::vector<Pair>> found;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, some.size(), 64), [&](const auto& range) {
        auto& mine = found.local();
        for (std::size_t n = range.begin(); n < range.end(); ++n)
            near((*triangles_)[some[n]], [&](std::uint32_t other) {
                if (other != some[n]) add_contact(some[n], other, mine);
            });
    });
    return gathered(found);
}

bool ContactFinder::would_touch(const std::vector<Change>& changed, const std::array<std::uint32_t, 2>& gone) const {
    const auto apart = [&](const Triangle& s, const Triangle& t) { return are_apart(*positions_, s, t); };
    for (std::size_t n = 0; n < changed.size(); ++n)
        for (std::size_t m = n + 1; m < changed.size(); ++m)
            if (!apart(changed[n].corners, changed[m].corners)) return true;
    const auto stays = [&](std::uint32_t t) {
        return (*triangles_)[t][0] < positions_->size() && t != gone[0] && t != gone[1] &&
               std::none_of(changed.begin(), changed.end(), [&](const Change& change) { return change.number == t; });
    };
    for (const Change& change : changed) {
        bool touching = false;
        near(change.corners,
             [&](std::uint32_t t) { touching = touching || (stays(t) && !apart(change.corners, (*triangles_)[t])); });
        if (touching) return true;
    }
    return false;
}

bool ContactFinder::face_along_sheet(const std::vector<Change>& changed, const Position& around) const {
    constexpr double kAlong = 0.3;  // minimum cosine between a normal and the direction of the sheet
    const Vec3 direction = single_sheet(around);
    return dot(direction, direction) > 0 && std::all_of(changed.begin(), changed.end(), [&](const Change& change) {
               const Vec3 n = area_normal(*positions_, change.corners);
               return dot(n, direction) > kAlong * length(n);
           });
}

}  // namespace covol::meshing
