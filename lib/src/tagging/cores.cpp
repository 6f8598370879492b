#include "tagging/cores.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <numeric>
#include <tuple>

#include "base/disjoint_sets.h"
#include "grid/halo.h"
#include "grid/leaf_columns.h"

namespace covol::detail {
namespace {

using detail::DisjointSets;

constexpr float kBeyond = std::numeric_limits<float>::infinity();  ///< d of the region beyond the tube
constexpr float kOutsideDomain = -kBeyond;                         ///< d outside the domain
constexpr double kBucketsPerVoxel = 16;                            ///< of the histogram of d
constexpr std::int32_t kExterior = 0;                              ///< number of the exterior component

/// Two components of {d > D} that merge once the threshold D falls below `d`.
struct Saddle {
    float d;
    std::int32_t first, second;  ///< components; second may be kSeed
};
constexpr std::int32_t kSeed = -1;  ///< component `first` contains a seed, and is exterior below `d`

/// The components of {d > D}, where d is the distance to the nearest point: each begins at its maximum of d, its peak,
/// and components merge as the threshold D decreases.
class Merging {
public:
    static constexpr std::int32_t kNone = -1;

    std::vector<std::int32_t> core_of;  ///< by component: the core that contains it, or kNone
    std::vector<float> saddles, peaks;  ///< by core

    explicit Merging(const std::vector<float>& d) : core_of(d.size(), kNone), parts_(d.size()) {
        for (std::size_t n = 0; n < d.size(); ++n) parts_[n] = {std::int32_t(n), kNone, std::int32_t(n), d[n]};
        mark_exterior(kExterior);
    }
    void mark_exterior(std::int32_t c) { parts_[root(c)].exterior = true; }
    void merge(std::int32_t a, std::int32_t b, float d) {
        a = root(a), b = root(b);
        if (a == b) return;
        Part &first = parts_[a], &second = parts_[b];
        if (first.exterior != second.exterior) record(first.exterior ? b : a, d);
        Part& kept = first.peak >= second.peak ? first : second;
        Part& gone = &kept == &first ? second : first;
        parts_[kept.last].next = gone.parent;
        kept.last = gone.last;
        kept.exterior = kept.exterior || gone.exterior;
        gone.parent = kept.parent;
    }

private:
    struct Part {
        std::int32_t parent;
        std::int32_t next, last;  // linked list of the parts of a component, beginning at its root
        float peak;
        bool exterior = false;
    };
    std::int32_t root(std::int32_t c) {
        while (parts_[c].parent != c) c = parts_[c].parent = parts_[parts_[c].parent].parent;
        return c;
    }
    void record(std::int32_t c, float d) {
        for (std::int32_t part = c; part != kNone; part = parts_[part].next)
            core_of[part] = std::int32_t(saddles.size());
        saddles.push_back(d);
        peaks.push_back(parts_[c].peak);
    }
    std::vector<Part> parts_;
};

class CoreFinder {
public:
    CoreFinder(const FloatGrid& distance, double radius, const std::vector<Vec3>& seeds)
        : domain_(domain_of(distance)),
          box_(box_of(domain_)),
          inner_(box_.min().offsetBy(1), box_.max().offsetBy(-1)),
          band_(distance),
          columns_(band_, box_),
          d_(band_.size(), kBeyond, 2),
          label_(band_.size(), kOutside),
          inside_(band_.size()),
          tube_(band_.size()),
          beyond_(band_.size()),
          radius_(radius) {
        d_.fill_block(band_.size() + 1, kOutsideDomain);
        import_values(distance, band_, d_);
        for (const Vec3& seed : seeds) {
            const Vec3 at = domain_.world_to_index(seed);
            seeds_.push_back(Coord::round(openvdb::Vec3d(at[0], at[1], at[2])));
        }
    }

    Cores run() {
        link();
        Cores result;
        count_voxels(result);
        join_beyond();
        climb();
        Merging merging(number_peaks());
        for (const Saddle& saddle : saddles())
            saddle.second == kSeed ? merging.mark_exterior(saddle.first)
                                   : merging.merge(saddle.first, saddle.second, saddle.d);
        measure(merging, result);
        return result;
    }

private:
    // The label of a voxel is the neighbour with the largest d, ~component at a peak (where no neighbour has a larger
    // d), or kOutside for voxels outside the domain.
    static constexpr std::int32_t kOutside = std::numeric_limits<std::int32_t>::max();
    static constexpr std::int32_t kNothing = std::numeric_limits<std::int32_t>::max();  // in beyond_
    static constexpr int kShift[3] = {6, 3, 0};

    /// A voxel's neighbour: in a leaf, in the run ~leaf, or kNothing.
    struct Neighbour {
        std::int32_t leaf;
        int at;
    };
    [[nodiscard]] Neighbour neighbour(std::size_t leaf, int at, int face) const {
        const int shift = kShift[face / 2], c = at >> shift & 7;
        if (face & 1) {
            if (c < 7) return {std::int32_t(leaf), at + (1 << shift)};
            return {beyond_[leaf][face], at - (7 << shift)};
        }
        if (c > 0) return {std::int32_t(leaf), at - (1 << shift)};
        return {beyond_[leaf][face], at + (7 << shift)};
    }
    [[nodiscard]] static std::int32_t node(std::size_t leaf, int at) { return std::int32_t(leaf * kLeafSize) + at; }
    [[nodiscard]] Coord voxel(std::size_t leaf, int at) const {
        return band_.origin(leaf).offsetBy(at >> 6, at >> 3 & 7, at & 7);
    }
    [[nodiscard]] bool is_in_tube(std::size_t leaf, int at) const { return is_on(tube_[leaf], at); }
    /// d of a leaf and of the voxels across its faces: a padded buffer.
    struct Heights {
        static constexpr int kStep[6] = {padded(-1, 0, 0) - padded(0, 0, 0),
                                         padded(1, 0, 0) - padded(0, 0, 0),
                                         padded(0, -1, 0) - padded(0, 0, 0),
                                         padded(0, 1, 0) - padded(0, 0, 0),
                                         -1,
                                         1};  // by face
        std::array<float, kPaddedSize> d;
        [[nodiscard]] const float* at(int voxel) const {
            return d.data() + padded(voxel >> 6, voxel >> 3 & 7, voxel & 7);
        }
    };
    void load(std::size_t leaf, Heights& heights) const;
    [[nodiscard]] std::int32_t run_component(std::int32_t piece) { return std::int32_t(joined_.root(1 + piece)); }
    [[nodiscard]] std::int32_t component(const Neighbour& n) {
        return n.leaf < 0 ? run_component(~n.leaf) : ~label_.leaf(n.leaf)[n.at];
    }
    template <typename Visit>
    void for_leaves(Visit&& visit) const {
        tbb::parallel_for(std::size_t(0), band_.size(), visit);
    }

    void link();
    void count_voxels(Cores& result) const;
    void join_beyond();
    void climb();
    std::vector<float> number_peaks();
    std::vector<Saddle> saddles();
    void measure(const Merging& merging, Cores& result);

    const Domain domain_;
    const CoordBBox box_, inner_;
    const LeafBand band_;
    const LeafColumns columns_;
    LeafArray<float> d_;  // followed by a block for runs, and one for the outside of the domain
    LeafArray<std::int32_t> label_;
    std::vector<LeafMask> inside_, tube_;              // voxels in the domain; those in the tube
    std::vector<std::array<std::int32_t, 6>> beyond_;  // by leaf and face: a leaf, ~piece of a run, or kNothing
    DisjointSets joined_{0};                           // components of the region beyond the tube: exterior, runs,
                                                       // parts of leaves
    std::vector<Coord> seeds_;
    double radius_;
};

void CoreFinder::link() {
    for_leaves([&](std::size_t leaf) {
        inside_[leaf] = mask_in_box(band_.origin(leaf), box_);
        for (int word = 0; word < 8; ++word) tube_[leaf][word] = inside_[leaf][word] & band_.active(leaf)[word];
        for (int at = 0; at < kLeafSize; ++at)
            if (!is_in_tube(leaf, at)) d_.leaf(leaf)[at] = is_on(inside_[leaf], at) ? kBeyond : kOutsideDomain;
        beyond_[leaf].fill(kNothing);
        columns_.for_each_neighbour(columns_.piece_of_leaf(leaf), [&](std::int32_t other, int di, int dj, int dk) {
            const std::int32_t there = columns_.pieces()[other].leaf;
            const int face = di != 0 ? (di > 0) : dj != 0 ? 2 + (dj > 0) : 4 + (dk > 0);
            beyond_[leaf][face] = there >= 0 ? there : ~other;
        });
    });
}

void CoreFinder::load(std::size_t leaf, Heights& heights) const {
    const float* across[6];
    for (int face = 0; face < 6; ++face) {
        const std::int32_t other = beyond_[leaf][face];
        across[face] = d_.leaf(other == kNothing ? band_.size() + 1 : other < 0 ? band_.size() : std::size_t(other));
    }
    load_star_from(d_.leaf(leaf), across, heights.d.data());
}

void CoreFinder::count_voxels(Cores& result) const {
    const double per_length = kBucketsPerVoxel / domain_.voxel_size;
    const auto buckets = std::size_t(radius_ * per_length) + 1;
    tbb::enumerable_thread_specific<std::vector<std::int64_t>> counts(buckets, 0);
    for_leaves([&](std::size_t leaf) {
        std::vector<std::int64_t>& count = counts.local();
        for (int at = 0; at < kLeafSize; ++at)
            if (is_in_tube(leaf, at))
                ++count[std::min(std::size_t(double(d_.leaf(leaf)[at]) * per_length), buckets - 1)];
    });
    result.histogram.assign(buckets, 0);
    for (const std::vector<std::int64_t>& count : counts)
        for (std::size_t b = 0; b < buckets; ++b) result.histogram[b] += count[b];
    result.tube_voxels = std::accumulate(result.histogram.begin(), result.histogram.end(), std::int64_t(0));
}

/// Numbers the connected components, by faces, of the region beyond the tube.
void CoreFinder::join_beyond() {
    const auto& pieces = columns_.pieces();
    std::vector<std::int32_t> first(band_.size() + 1, 0);  // component of a leaf's first part
    for_leaves([&](std::size_t leaf) {
        LeafMask beyond;
        for (int word = 0; word < 8; ++word) beyond[word] = inside_[leaf][word] & ~tube_[leaf][word];
        for_each_part(beyond, [&](const LeafMask& part) {
            for (int word = 0; word < 8; ++word)
                for (std::uint64_t bits = part[word]; bits != 0; bits &= bits - 1)
                    label_.leaf(leaf)[word << 6 | __builtin_ctzll(bits)] = first[leaf + 1];
            ++first[leaf + 1];
        });
    });
    first[0] = 1 + std::int32_t(pieces.size());
    std::partial_sum(first.begin(), first.end(), first.begin());
    joined_ = DisjointSets(std::size_t(first.back()));

    const auto is_beyond = [&](std::size_t leaf, int at) { return d_.leaf(leaf)[at] == kBeyond; };
    tbb::parallel_for(std::int32_t(0), std::int32_t(pieces.size()), [&](std::int32_t n) {
        if (pieces[n].leaf >= 0) return;
        if (columns_.at_border(pieces[n])) joined_.unite(1 + n, kExterior);
        columns_.for_each_neighbour(n, [&](std::int32_t other, int, int, int) {
            if (pieces[other].leaf < 0) joined_.unite(1 + n, 1 + other);
        });
    });
    for_leaves([&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            if (is_beyond(leaf, at)) label_.leaf(leaf)[at] = ~(first[leaf] + label_.leaf(leaf)[at]);
    });
    for_leaves([&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at) {
            if (!is_beyond(leaf, at)) continue;
            const auto own = std::uint32_t(~label_.leaf(leaf)[at]);
            if (!inner_.isInside(voxel(leaf, at))) joined_.unite(own, kExterior);
            for (int face = 0; face < 6; ++face) {
                const Neighbour n = neighbour(leaf, at, face);
                if (n.leaf == std::int32_t(leaf) || n.leaf == kNothing) continue;
                if (n.leaf < 0)
                    joined_.unite(own, std::uint32_t(1 + ~n.leaf));
                else if (is_beyond(n.leaf, n.at))
                    joined_.unite(own, std::uint32_t(~label_.leaf(n.leaf)[n.at]));
            }
        }
    });
    for_leaves([&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at)
            if (is_beyond(leaf, at))
                label_.leaf(leaf)[at] = ~std::int32_t(joined_.root(std::uint32_t(~label_.leaf(leaf)[at])));
    });
}

/// Assigns to each voxel of the tube the one of itself and its six neighbours that has the largest d, and of several
/// with equal d the one with the smallest number; next to the region beyond the tube, the component of that region.
void CoreFinder::climb() {
    for_leaves([&](std::size_t leaf) {
        Heights heights;
        load(leaf, heights);
        for (int at = 0; at < kLeafSize; ++at) {
            if (!is_in_tube(leaf, at)) continue;
            const float* here = heights.at(at);
            float highest = *here;
            std::int32_t label = node(leaf, at);
            for (int face = 0; face < 6; ++face) {
                const float d = here[Heights::kStep[face]];
                if (d < highest) continue;
                const Neighbour n = neighbour(leaf, at, face);
                if (d == kBeyond) {
                    label = ~component(n);
                    break;
                }
                if (d == highest && node(n.leaf, n.at) > label) continue;
                highest = d;
                label = node(n.leaf, n.at);
            }
            label_.leaf(leaf)[at] = label;
        }
    });
}

/// Makes each peak a component, and labels all voxels with their component. @return d at the peak of each component
std::vector<float> CoreFinder::number_peaks() {
    std::vector<std::int32_t> first(band_.size() + 1, 0);
    for_leaves([&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at) first[leaf + 1] += label_.leaf(leaf)[at] == node(leaf, at);
    });
    first[0] = std::int32_t(joined_.size());
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<float> peaks(std::size_t(first.back()), kBeyond);
    for_leaves([&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at) {
            std::int32_t& label = label_.leaf(leaf)[at];
            if (label != node(leaf, at)) continue;
            peaks[first[leaf]] = d_.leaf(leaf)[at];
            label = ~first[leaf]++;
        }
    });
    const auto label_of = [&](std::int32_t n) { return std::atomic_ref(label_.leaf(0)[n]); };
    for_leaves([&](std::size_t leaf) {
        for (int at = 0; at < kLeafSize; ++at) {
            std::int32_t label = label_of(node(leaf, at)).load(std::memory_order_relaxed);
            if (label < 0 || label == kOutside) continue;
            while (label >= 0) label = label_of(label).load(std::memory_order_relaxed);
            label_of(node(leaf, at)).store(label, std::memory_order_relaxed);
        }
    });
    return peaks;
}

/// The saddles between components, sorted by decreasing d.
std::vector<Saddle> CoreFinder::saddles() {
    tbb::enumerable_thread_specific<std::vector<Saddle>> found;
    for_leaves([&](std::size_t leaf) {
        std::vector<Saddle>& here = found.local();
        // The same two components may be adjacent at many voxels, of which the highest is used.
        std::array<Saddle, 64> last;
        last.fill({0.0F, kSeed, kSeed});
        const auto offer = [&](float d, std::int32_t a, std::int32_t b) {
            if (a == b) return;
            const auto [first, second] = std::minmax(a, b);
            Saddle& kept = last[std::size_t(first * 7 + second) % last.size()];
            if (kept.first == first && kept.second == second) {
                kept.d = std::max(kept.d, d);
                return;
            }
            if (kept.first != kSeed) here.push_back(kept);
            kept = {d, first, second};
        };
        for (int at = 0; at < kLeafSize; ++at) {
            if (!is_on(inside_[leaf], at)) continue;
            const std::int32_t own = ~label_.leaf(leaf)[at];
            const float d = d_.leaf(leaf)[at];
            // The region beyond the domain is exterior, so that a voxel at the domain's end acts as a gap.
            if (!inner_.isInside(voxel(leaf, at))) offer(d, own, kExterior);
            for (int face = 0; face < 6; ++face) {
                const Neighbour n = neighbour(leaf, at, face);
                if (n.leaf == kNothing) continue;
                if (n.leaf < 0)
                    offer(d, own, component(n));
                else if ((face & 1) && is_on(inside_[n.leaf], n.at))
                    offer(std::min(d, d_.leaf(n.leaf)[n.at]), own, component(n));
            }
        }
        for (const Saddle& kept : last)
            if (kept.first != kSeed) here.push_back(kept);
    });
    std::vector<Saddle> all;
    for (const std::vector<Saddle>& some : found) all.insert(all.end(), some.begin(), some.end());
    for (const Coord& seed : seeds_) {
        if (!box_.isInside(seed)) continue;
        const std::int32_t leaf = band_.find(Coord(seed.x() & ~7, seed.y() & ~7, seed.z() & ~7));
        if (leaf == band_.none()) {
            all.push_back({kBeyond, run_component(columns_.find(seed)), kSeed});
            continue;
        }
        const int at = leaf_offset(seed.x() & 7, seed.y() & 7, seed.z() & 7);
        all.push_back({d_.leaf(leaf)[at], ~label_.leaf(leaf)[at], kSeed});
    }
    tbb::parallel_sort(all.begin(), all.end(), [](const Saddle& x, const Saddle& y) {
        return std::tuple(-x.d, x.first, x.second) < std::tuple(-y.d, y.first, y.second);
    });
    return all;
}

void CoreFinder::measure(const Merging& merging, Cores& result) {
    const std::vector<float>& saddle = merging.saddles;
    std::vector<std::int64_t> voxels(saddle.size(), 0), faces(saddle.size(), 0);
    const auto add = [](std::int64_t& sum, std::int64_t n) {
        std::atomic_ref(sum).fetch_add(n, std::memory_order_relaxed);
    };
    for_leaves([&](std::size_t leaf) {
        Heights heights;
        load(leaf, heights);
        std::int32_t last = Merging::kNone;
        std::int64_t sum_voxels = 0, sum_faces = 0;
        const auto flush = [&](std::int32_t next) {
            if (last != Merging::kNone) {
                add(voxels[last], sum_voxels);
                add(faces[last], sum_faces);
            }
            sum_voxels = sum_faces = 0;
            last = next;
        };
        for (int at = 0; at < kLeafSize; ++at) {
            const float* here = heights.at(at);
            if (*here == kOutsideDomain) continue;
            const std::int32_t core = merging.core_of[~label_.leaf(leaf)[at]];
            if (core == Merging::kNone || !(*here > saddle[core])) continue;
            if (core != last) flush(core);
            ++sum_voxels;
            for (const int step : Heights::kStep) sum_faces += !(here[step] > saddle[core]);
        }
        flush(Merging::kNone);
        // The faces between a run and a leaf belong to the core's surface where the leaf's voxels are not in the core.
        for (int face = 0; face < 6; ++face) {
            const std::int32_t other = beyond_[leaf][face];
            const std::int32_t core = other < 0 ? merging.core_of[run_component(~other)] : Merging::kNone;
            if (core == Merging::kNone) continue;
            const int axis = face / 2, stride = axis == 0 ? 64 : axis == 1 ? 8 : 1;
            int open = 0;
            for (int at = 0; at < kLeafSize; ++at)
                if (at / stride % kLeafDim == (face & 1 ? kLeafDim - 1 : 0))
                    open += !(d_.leaf(leaf)[at] > saddle[core]);
            add(faces[core], open);
        }
    });
    const auto& pieces = columns_.pieces();
    for (std::int32_t n = 0; n < std::int32_t(pieces.size()); ++n) {
        const std::int32_t core = pieces[n].leaf < 0 ? merging.core_of[run_component(n)] : Merging::kNone;
        if (core != Merging::kNone) voxels[core] += std::int64_t(pieces[n].end - pieces[n].begin) * kLeafSize;
    }
    const double h = domain_.voxel_size;
    for (std::size_t n = 0; n < saddle.size(); ++n)
        // The area of voxel faces is 3/2 of that of a smooth surface, on average over directions.
        if (voxels[n] > 0)
            result.cores.push_back({saddle[n] / h, std::min(double(merging.peaks[n]), radius_) / h, double(voxels[n]),
                                    double(faces[n]) * 2.0 / 3.0});
}

}  // namespace

double Cores::cloud_volume(double distance) const {
    double n = 0;
    for (std::size_t bucket = 0; bucket < histogram.size() && double(bucket) < distance * kBucketsPerVoxel; ++bucket)
        n += double(histogram[bucket]);
    return n;
}

Cores find_cores(const FloatGrid& distance, double radius, const std::vector<Vec3>& seeds) {
    return CoreFinder(distance, radius, seeds).run();
}

}  // namespace covol::detail
