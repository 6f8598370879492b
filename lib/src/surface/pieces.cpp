#include "surface/pieces.h"

#include <openvdb/openvdb.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/heuristics.h"
#include "covol/domain.h"
#include "grid/leaf_columns.h"
#include "grid/sign_masks.h"

namespace covol::detail {
namespace {

using detail::DisjointSets;

using Leaf = FloatGrid::TreeType::LeafNodeType;

/// The 6-connected pieces of the active voxels of one sign. A part is a set of these voxels that is 6-connected within
/// one leaf.
class ActivePieces {
public:
    struct Piece {
        std::size_t first, last;  // its parts are [first, last) of parts_
        std::int64_t voxels;
    };

    ActivePieces(FloatGrid& level_set, bool inside) {
        std::vector<Leaf*> leaves;
        level_set.tree().getNodes(leaves);
        std::vector<std::vector<LeafMask>> masks(leaves.size());
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t n) {
            LeafMask mask = negative_mask(leaves[n]->buffer().data());
            for (int word = 0; word < 8; ++word) {
                if (!inside) mask[word] = ~mask[word];
                mask[word] &= leaves[n]->valueMask().getWord<std::uint64_t>(openvdb::Index(word));
            }
            for_each_part(mask, [&](const LeafMask& part) { masks[n].push_back(part); });
        });
        std::unordered_map<const Leaf*, std::size_t> numbers;
        std::vector<std::size_t> first;  // index of each leaf's first part
        for (std::size_t n = 0; n < leaves.size(); ++n) {
            numbers.emplace(leaves[n], n);
            first.push_back(parts_.size());
            for (const LeafMask& mask : masks[n]) parts_.push_back({mask, leaves[n], 0});
        }
        first.push_back(parts_.size());

        DisjointSets joined(parts_.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
            const auto tree = level_set.getConstAccessor();
            for (std::size_t n = range.begin(); n < range.end(); ++n)
                for (int axis = 0; axis < 3; ++axis) {
                    Coord beyond = leaves[n]->origin();
                    beyond[axis] += kLeafDim;
                    const Leaf* next = tree.probeConstLeaf(beyond);
                    if (next == nullptr) continue;
                    const std::size_t upper = numbers.at(next);
                    for (std::size_t p = first[n]; p < first[n + 1]; ++p)
                        for (std::size_t q = first[upper]; q < first[upper + 1]; ++q)
                            if (meet(parts_[p].mask, parts_[q].mask, axis))
                                joined.unite(std::uint32_t(p), std::uint32_t(q));
                }
        });
        for (std::size_t p = 0; p < parts_.size(); ++p) parts_[p].piece = joined.root(std::uint32_t(p));
        std::stable_sort(parts_.begin(), parts_.end(), [](const Part& x, const Part& y) { return x.piece < y.piece; });
        for (std::size_t p = 0; p < parts_.size(); ++p) {
            if (p == 0 || parts_[p].piece != parts_[p - 1].piece) pieces_.push_back({p, p, 0});
            ++pieces_.back().last;
            pieces_.back().voxels += count_on(parts_[p].mask);
        }
    }

    [[nodiscard]] const std::vector<Piece>& all() const { return pieces_; }
    /// Calls visit(leaf, offset) for each voxel of a piece.
    template <typename Visit>
    void for_voxels(const Piece& piece, Visit&& visit) const {
        for (std::size_t p = piece.first; p < piece.last; ++p)
            for (int at = 0; at < kLeafSize; ++at)
                if (is_on(parts_[p].mask, at)) visit(*parts_[p].leaf, openvdb::Index(at));
    }

private:
    struct Part {
        LeafMask mask;
        Leaf* leaf;
        std::uint32_t piece;
    };
    /// Whether a voxel of `lower` has a face in common with a voxel of `upper`, a mask of the next leaf along the axis.
    static bool meet(const LeafMask& lower, const LeafMask& upper, int axis) {
        constexpr LeafMask kNone{};
        LeafMask both = beside_marked(kNone, upper, axis, 1);
        for (int word = 0; word < 8; ++word) both[word] &= lower[word];
        return any_on(both);
    }

    std::vector<Part> parts_;  // sorted by piece
    std::vector<Piece> pieces_;
};

/// The 6-connected regions of equal sign, including the space between the leaves.
class Regions {
public:
    using Label = std::uint32_t;

    explicit Regions(FloatGrid& level_set) : level_set_(level_set) {
        for (auto leaf = level_set.tree().beginLeaf(); leaf; ++leaf) leaves_.push_back(&*leaf);
        std::sort(leaves_.begin(), leaves_.end(),
                  [](const Leaf* x, const Leaf* y) { return x->origin() < y->origin(); });
        label_leaves();
        find_gaps();
        join();
        for (Label n = 0; n < parents_.size(); ++n) parents_[n] = root(n);
        surface_.assign(parents_.size(), 0);
        for (std::size_t n = 0; n < leaves_.size(); ++n)
            for (auto value = leaves_[n]->cbeginValueOn(); value; ++value)
                ++surface_[parents_[labels_[n][value.pos()]]];
    }

    /// Changes the sign of those regions of one sign that have fewer than `minimum` points within a voxel, except the
    /// region with the largest number of active voxels and the surrounding space. @return the number of changed regions
    std::size_t drop(bool inside, const std::vector<Vec3>& points, std::size_t minimum) {
        std::vector<Label> roots;
        for (Label n = 0; n < parents_.size(); ++n)
            if (parents_[n] == n && is_inside_[n] == inside && surface_[n] > 0) roots.push_back(n);
        if (roots.size() < 2) return 0;
        const Label main =
            *std::max_element(roots.begin(), roots.end(), [&](Label x, Label y) { return surface_[x] < surface_[y]; });
        const std::vector<std::size_t> point_counts = count_points(points);
        std::vector<char> is_removed(parents_.size(), 0);
        std::size_t count = 0;
        for (const Label n : roots) {
            if (n == main || parents_[kAround] == n || point_counts[n] >= minimum) continue;
            is_removed[n] = 1;
            ++count;
        }
        if (count > 0) change_sign(is_removed, inside);
        return count;
    }

private:
    static constexpr int kDim = 8, kVoxels = 512;
    static constexpr Label kAround = 0, kNone = std::numeric_limits<Label>::max();
    /// Consecutive blocks of 8^3 voxels along k without leaves: begin..end-1, in units of blocks.
    struct Gap {
        int begin, end;
        Label label;
    };
    struct Row {
        int i, j;                 // position of its blocks, in units of blocks
        std::size_t first, last;  // its leaves are [first, last) of leaves_
        std::vector<Gap> gaps;
    };

    Label new_label(bool inside) {
        parents_.push_back(Label(parents_.size()));
        is_inside_.push_back(inside);
        return parents_.back();
    }
    Label root(Label n) {
        while (parents_[n] != n) n = parents_[n] = parents_[parents_[n]];
        return n;
    }
    void unite(Label x, Label y) {
        x = root(x), y = root(y);
        parents_[std::max(x, y)] = std::min(x, y);
    }

    /// Finds the regions within each leaf and labels them in the order of their first voxels.
    void label_leaves() {
        new_label(false);  // kAround
        labels_.resize(leaves_.size());
        std::vector<std::vector<bool>> inside(leaves_.size());  // the sign of each region of each leaf
        tbb::parallel_for(std::size_t(0), leaves_.size(), [&](std::size_t n) {
            const LeafMask negative = negative_mask(leaves_[n]->buffer().data());
            labels_[n].fill(kNone);
            for (int v = 0; v < kVoxels; ++v) {
                if (labels_[n][std::size_t(v)] != kNone) continue;
                const bool is_inside = is_on(negative, v);
                LeafMask same = negative, region{};
                if (!is_inside)
                    for (std::uint64_t& word : same) word = ~word;
                set_on(region, v);
                spread(region, same);
                for (int other = v; other < kVoxels; ++other)
                    if (is_on(region, other)) labels_[n][std::size_t(other)] = Label(inside[n].size());
                inside[n].push_back(is_inside);
            }
        });
        std::vector<Label> first(leaves_.size());
        for (std::size_t n = 0; n < leaves_.size(); ++n) {
            first[n] = Label(parents_.size());
            for (const bool is_inside : inside[n]) new_label(is_inside);
        }
        tbb::parallel_for(std::size_t(0), leaves_.size(), [&](std::size_t n) {
            for (Label& label : labels_[n]) label += first[n];
        });
    }

    /// The positions along i and j, in units of blocks, of the rows that are examined, in this order: those with
    /// leaves, and the four beside each of them. A row without leaves lies in the surrounding space, because surfaces
    /// are closed; rows between such rows need not be examined.
    [[nodiscard]] std::vector<std::pair<int, int>> row_positions() const {
        std::vector<std::pair<int, int>> all;
        for (std::size_t n = 0; n < leaves_.size(); ++n) {
            const Coord& at = leaves_[n]->origin();
            if (n > 0 && leaves_[n - 1]->origin().x() == at.x() && leaves_[n - 1]->origin().y() == at.y()) continue;
            const int i = at.x() / kDim, j = at.y() / kDim;
            all.insert(all.end(), {{i - 1, j}, {i, j - 1}, {i, j}, {i, j + 1}, {i + 1, j}});
        }
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
        return all;
    }

    /// Finds the gaps before, between and after the leaves of each row of blocks; each gap has one sign.
    void find_gaps() {
        if (leaves_.empty()) return;
        const auto [lowest, highest] =
            std::minmax_element(leaves_.begin(), leaves_.end(),
                                [](const Leaf* x, const Leaf* y) { return x->origin().z() < y->origin().z(); });
        const int low = (*lowest)->origin().z() / kDim - 1, end = (*highest)->origin().z() / kDim + 2;
        const auto values = level_set_.getConstAccessor();
        std::size_t next = 0;
        for (const auto& at : row_positions()) {
            Row row{at.first, at.second, next, next, {}};
            int from = low;
            const auto add_gap = [&](int to) {
                if (from < to)
                    row.gaps.push_back(
                        {from, to, new_label(values.getValue({kDim * row.i, kDim * row.j, kDim * from}) < 0)});
            };
            for (; next < leaves_.size() && leaves_[next]->origin().x() == kDim * row.i &&
                   leaves_[next]->origin().y() == kDim * row.j;
                 ++next) {
                const int k = leaves_[next]->origin().z() / kDim;
                add_gap(k);
                from = k + 1;
            }
            row.last = next;
            add_gap(end);
            for (const Gap& gap : row.gaps)
                if (!is_inside_[gap.label] && (gap.begin == low || gap.end == end)) unite(kAround, gap.label);
            rows_.push_back(std::move(row));
        }
    }

    void join() {
        const auto is_at = [&](std::size_t n, int i, int j) {
            return n < rows_.size() && rows_[n].i == i && rows_[n].j == j;
        };
        std::size_t beyond = 0;  // the first row that is not before the position next to rows_[n] along i
        for (std::size_t n = 0; n < rows_.size(); ++n) {
            const int i = rows_[n].i, j = rows_[n].j;
            while (beyond < rows_.size() && std::pair{rows_[beyond].i, rows_[beyond].j} < std::pair{i + 1, j}) ++beyond;
            if (is_at(beyond, i + 1, j)) join_rows(rows_[n], rows_[beyond], 0);
            if (is_at(n + 1, i, j + 1)) join_rows(rows_[n], rows_[n + 1], 1);
        }
        for (const Row& row : rows_) {
            for (std::size_t n = row.first; n + 1 < row.last; ++n)
                if (leaves_[n + 1]->origin().z() == leaves_[n]->origin().z() + kDim) join_face(n, n + 1, 2);
            for (std::size_t n = row.first; n < row.last; ++n)
                for (const Gap& gap : row.gaps) {
                    const int k = leaves_[n]->origin().z() / kDim;
                    if (gap.begin == k + 1) join_to_gap(n, 2, true, gap);
                    if (gap.end == k) join_to_gap(n, 2, false, gap);
                }
        }
    }

    /// Unites the regions of equal sign on both sides of the faces between two rows. @param upper  the next row along
    /// the axis
    void join_rows(const Row& lower, const Row& upper, int axis) {
        for (std::size_t x = 0, y = 0; x < lower.gaps.size() && y < upper.gaps.size();) {
            const Gap &one = lower.gaps[x], &two = upper.gaps[y];
            if (std::max(one.begin, two.begin) < std::min(one.end, two.end)) unite_equal(one.label, two.label);
            if (one.end < two.end)
                ++x;
            else
                ++y;
        }
        join_faces(lower, upper, axis);
        join_to_gaps(lower, upper.gaps, axis, true);
        join_to_gaps(upper, lower.gaps, axis, false);
    }

    void unite_equal(Label x, Label y) {
        if (is_inside_[x] == is_inside_[y]) unite(x, y);
    }
    /// Calls visit(voxel, adjacent voxel of the next leaf) for each voxel on a leaf's lower or upper face.
    template <typename Visit>
    static void for_face(int axis, bool upper, Visit visit) {
        const int stride = axis == 0 ? 64 : axis == 1 ? 8 : 1, u = axis == 0 ? 8 : 64, v = axis == 2 ? 8 : 1;
        for (int a = 0; a < kDim; ++a)
            for (int b = 0; b < kDim; ++b)
                visit(std::size_t(a * u + b * v + (upper ? (kDim - 1) * stride : 0)),
                      std::size_t(a * u + b * v + (upper ? 0 : (kDim - 1) * stride)));
    }
    void join_face(std::size_t lower, std::size_t upper, int axis) {
        for_face(axis, true, [&](std::size_t here, std::size_t there) {
            unite_equal(labels_[lower][here], labels_[upper][there]);
        });
    }
    void join_to_gap(std::size_t leaf, int axis, bool upper, const Gap& gap) {
        for_face(axis, upper, [&](std::size_t here, std::size_t) { unite_equal(labels_[leaf][here], gap.label); });
    }
    void join_faces(const Row& lower, const Row& upper, int axis) {
        for (std::size_t x = lower.first, y = upper.first; x < lower.last && y < upper.last;) {
            const int one = leaves_[x]->origin().z(), two = leaves_[y]->origin().z();
            if (one == two) join_face(x, y, axis);
            if (one <= two) ++x;
            if (two <= one) ++y;
        }
    }
    void join_to_gaps(const Row& row, const std::vector<Gap>& gaps, int axis, bool upper) {
        std::size_t at = 0;
        for (std::size_t n = row.first; n < row.last; ++n) {
            const int k = leaves_[n]->origin().z() / kDim;
            while (at < gaps.size() && gaps[at].end <= k) ++at;
            if (at < gaps.size() && gaps[at].begin <= k) join_to_gap(n, axis, upper, gaps[at]);
        }
    }

    /// For each region, the number of points that have a voxel of it among the 27 around their nearest voxel.
    [[nodiscard]] std::vector<std::size_t> count_points(const std::vector<Vec3>& points) const {
        std::vector<std::size_t> all(parents_.size(), 0);
        std::unordered_map<const Leaf*, std::size_t> numbers;
        for (std::size_t n = 0; n < leaves_.size(); ++n) numbers.emplace(leaves_[n], n);
        tbb::enumerable_thread_specific<std::vector<std::size_t>> counts(all);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1024), [&](const auto& range) {
            std::vector<std::size_t>& mine = counts.local();
            const auto tree = level_set_.getConstAccessor();
            std::array<Label, 27> beside;
            for (std::size_t p = range.begin(); p < range.end(); ++p) {
                const openvdb::Coord c = openvdb::Coord::round(
                    level_set_.worldToIndex(openvdb::Vec3d(points[p][0], points[p][1], points[p][2])));
                std::size_t count = 0;
                const Leaf* last = nullptr;
                std::size_t number = 0;
                for (int n = 0; n < 27; ++n) {
                    const openvdb::Coord at = c.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
                    const Leaf* leaf = tree.probeConstLeaf(at);
                    if (leaf == nullptr) continue;
                    if (leaf != last) number = numbers.at(last = leaf);
                    const Label label = parents_[labels_[number][Leaf::coordToOffset(at)]];
                    if (std::find(beside.begin(), beside.begin() + std::ptrdiff_t(count), label) ==
                        beside.begin() + std::ptrdiff_t(count))
                        beside[count++] = label;
                }
                for (std::size_t n = 0; n < count; ++n) ++mine[beside[n]];
            }
        });
        for (const std::vector<std::size_t>& some : counts)
            for (std::size_t n = 0; n < all.size(); ++n) all[n] += some[n];
        return all;
    }

    void change_sign(const std::vector<char>& is_removed, bool inside) {
        const auto limit = float(0.5 * level_set_.voxelSize()[0]), now = inside ? limit : -limit;
        for (std::size_t n = 0; n < leaves_.size(); ++n)
            for (int v = 0; v < kVoxels; ++v)
                if (is_removed[parents_[labels_[n][std::size_t(v)]]]) leaves_[n]->setValueOnly(openvdb::Index(v), now);
        for (const Row& row : rows_)
            for (const Gap& gap : row.gaps)
                if (is_removed[parents_[gap.label]])
                    for (int k = gap.begin; k < gap.end; ++k)
                        level_set_.tree().addTile(1, {kDim * row.i, kDim * row.j, kDim * k},
                                                  inside ? level_set_.background() : -level_set_.background(), false);
    }

    FloatGrid& level_set_;
    std::vector<Leaf*> leaves_;  // sorted by origin
    std::vector<std::array<Label, kVoxels>> labels_;
    std::vector<Row> rows_;  // in the order of row_positions()
    std::vector<Label> parents_;
    std::vector<char> is_inside_;
    std::vector<std::size_t> surface_;  // number of active voxels of each region
};

}  // namespace

void drop_unmarked_pieces(FloatGrid& level_set, const std::vector<Vec3>& marks) {
    const auto limit = float(0.5 * level_set.voxelSize()[0]);
    const auto has_mark = [&](CoordBBox box) {
        box.expand(int(kHalfWidthVoxels));  // a piece is kept if a mark lies in the band around it
        return std::any_of(marks.begin(), marks.end(), [&](const Vec3& m) {
            return box.isInside(Coord::round(level_set.worldToIndex(openvdb::Vec3d(m[0], m[1], m[2]))));
        });
    };
    for (const bool inside : {true, false}) {
        const ActivePieces pieces(level_set, inside);
        std::int64_t maximum = 0;
        for (const ActivePieces::Piece& piece : pieces.all()) maximum = std::max(maximum, piece.voxels);
        for (const ActivePieces::Piece& piece : pieces.all()) {
            if (double(piece.voxels) > kCommon.negligible * double(maximum)) continue;
            CoordBBox box;
            pieces.for_voxels(piece,
                              [&](const Leaf& leaf, openvdb::Index at) { box.expand(leaf.offsetToGlobalCoord(at)); });
            if (has_mark(box)) continue;
            pieces.for_voxels(piece,
                              [&](Leaf& leaf, openvdb::Index at) { leaf.setValueOnly(at, inside ? limit : -limit); });
        }
    }
}

std::size_t drop_bare_pieces(FloatGrid& level_set, const std::vector<Vec3>& points, std::size_t minimum) {
    Regions regions(level_set);
    const std::size_t pieces = regions.drop(true, points, minimum);
    // The cavities of removed pieces no longer exist, so the regions are computed again.
    return pieces == 0 ? regions.drop(false, points, minimum)
                       : pieces + Regions(level_set).drop(false, points, minimum);
}

}  // namespace covol::detail
