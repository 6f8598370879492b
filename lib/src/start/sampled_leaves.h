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

/// A field's values on leaves, for which it is asked once, and in no more parts of a leaf than are needed: of most
/// leaves beside a surface that is a layer.
class SampledLeaves {
public:
    /// @param sample  kept by reference
    explicit SampledLeaves(const Sampler& sample) : sample_(sample) {}

    /// Those of the leaves whose voxel edges, those to the next leaf included, the zero level set passes.
    [[nodiscard]] std::vector<Coord> crossed_by(const std::vector<Coord>& leaves);
    /// As crossed_by(), found from leaf to leaf, from those with a seed on, or where the surface does not pass the
    /// seed's leaf, from the 26 around it. Sorted.
    [[nodiscard]] std::vector<Coord> crossed_from(const Domain& domain, const std::vector<Vec3>& seeds,
                                                  const RunContext& run);
    /// A leaf at a time: each value that a distance to the surface reads, and the sign everywhere.
    /// @param beside  the leaves that were found to be crossed, and those around them
    [[nodiscard]] Sampler sampler(const std::vector<Coord>& beside);

private:
    using Values = std::array<float, kLeafSize>;
    struct Entry {
        LeafParts known = 0, requested = 0;
        std::unique_ptr<Values> values;
        [[nodiscard]] bool has_one_sign() const;
    };
    struct Wish {
        Coord origin;
        LeafParts parts;
    };
    class WithNext;
    void request(const std::vector<Wish>& wishes);
    void sample(const Coord& origin, Entry& entry) const;
    void request_with_next(const std::vector<Coord>& leaves);

    const Sampler& sample_;
    std::map<Coord, Entry> leaves_;
};

}  // namespace covol::detail
