#pragma once
#include <array>
#include <map>
#include <memory>
#include <vector>

#include "covol/domain.h"
#include "covol/run.h"
#include "grid/leaf_band.h"
#include "start/other_lattice.h"

namespace covol::detail {

/// Parts of a leaf, as bits: its first layer of voxels across each axis, and all of it.
using LeafParts = unsigned;
inline constexpr LeafParts kOneLayer = 0b0001, kFirstLayers = 0b0111, kWholeLeaf = 0b1000;

/// A field's values on leaves. Each value is sampled once, and only the required parts of a leaf: for most leaves
/// beside a surface a single layer.
class SampledLeaves {
public:
    /// @param sample  kept by reference
    explicit SampledLeaves(const Sampler& sample) : sample_(sample) {}

    /// Those of `leaves` that have an edge between voxels, including edges to the next leaf, that the zero level set
    /// crosses.
    [[nodiscard]] std::vector<Coord> crossed_by(const std::vector<Coord>& leaves);
    /// All crossed leaves that are reached from the seeds through crossed faces. The search begins at the leaves that
    /// contain a seed, or at the 26 leaves around such a leaf if the surface does not cross it. Sorted.
    [[nodiscard]] std::vector<Coord> crossed_from(const Domain& domain, const std::vector<Vec3>& seeds,
                                                  const RunContext& run);
    /// Samples one leaf at a time: all values that the computation of a distance reads, and the correct sign elsewhere.
    /// @param beside  the crossed leaves, and those around them
    [[nodiscard]] Sampler sampler(const std::vector<Coord>& beside);

private:
    using Values = std::array<float, kLeafSize>;
    struct Entry {
        LeafParts known = 0, requested = 0;
        std::unique_ptr<Values> values;
        [[nodiscard]] bool has_one_sign() const;
    };
    struct Request {
        Coord origin;
        LeafParts parts;
    };
    class WithNext;
    void request(const std::vector<Request>& requests);
    void sample(const Coord& origin, Entry& entry) const;
    void request_with_next(const std::vector<Coord>& leaves);

    const Sampler& sample_;
    std::map<Coord, Entry> leaves_;
};

}  // namespace covol::detail
