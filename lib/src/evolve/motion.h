#pragma once
#include <cstdint>
#include <vector>

#include "grid/leaf_band.h"

namespace covol::detail {

/// What one step did to the level set in a leaf. Edges are those between voxels of the leaf.
struct LeafMotion {
    double way = 0.0;      ///< of the zero crossings along voxel edges, voxels, summed over the edges
    int edges = 0;         ///< crossed before or after
    float largest = 0.0F;  ///< max |u^n - u^{n-1}|, voxels
    bool negative = false, positive = false;  ///< signs that occur
    bool finite = true;

    /// The same surface at rest.
    [[nodiscard]] LeafMotion at_rest() const {
        LeafMotion rest = *this;
        rest.way = 0.0;
        rest.largest = 0.0F;
        return rest;
    }
};

/// Where an edge is crossed before and after, the crossing's way; where only once, half an edge. Unlike the change of u
/// this does not see a profile that grows steeper in its place.
[[nodiscard]] LeafMotion motion_of(const float* now, const float* before, bool is_active);

/// The whole band's motion in a step.
struct Motion {
    double mean = 0.0;  ///< way of the zero crossings, voxels
    bool crosses = false;
    bool finite = true;
};
[[nodiscard]] Motion total(const std::vector<LeafMotion>& leaves);

/// Edges that a surface of one voxel's area crosses, on the average over its directions.
inline constexpr double kCrossingsPerVoxel = 1.5;

/// Motion for good, by the voxels that changed sign over some steps. Next to an edge of the image the crossings tremble
/// by a few hundredths of a voxel; that ends no run, and moves nothing.
class NetMotion {
public:
    static constexpr int kWindow = 10;  ///< steps
    /// To be called once a step. @return mean motion per step over the last window, voxels; infinity within one
    double per_step(const LeafArray<float>& u, std::size_t leaves);

private:
    std::vector<LeafMask> signs_;  // at the window's begin
    int age_ = 0;
};

/// Where the surface crosses the edges of voxels, leaf by leaf, to tell how far it has come since.
class CrossingMarks {
public:
    struct Way {
        double mean = 0.0, largest = 0.0;  ///< of the crossings of one leaf, voxels
    };
    /// Marks what is there now. @return how far the crossings have come since the leaf's last mark; infinity at the first
    Way renew(std::size_t leaf, const float* u);
    void resize(std::size_t leaves) { leaves_.resize(leaves); }
    /// The band was made again. @param old_leaf  for each new leaf the old one at the same place, or -1
    void remake(const std::vector<std::int32_t>& old_leaf);
    [[nodiscard]] std::size_t count(std::size_t leaf) const { return leaves_[leaf].crossings.size(); }

private:
    struct Crossing {
        std::uint16_t edge;  ///< 512 * axis + voxel
        float at;            ///< along it
    };
    struct Leaf {
        std::vector<Crossing> crossings;
        bool is_marked = false;
    };
    std::vector<Leaf> leaves_;
};

/// Tells where the surface has left what its band was made for: by three quarters of a voxel, counted by the leaf's voxels
/// that changed sign, or past voxels that were 2 voxels deep.
class Departure {
public:
    void remember(const LeafArray<float>& u, std::size_t leaves);
    /// The band was made again. @param old_leaf  for each new leaf the old one with the same values, or -1
    void remake(const std::vector<std::int32_t>& old_leaf, const LeafArray<float>& u);
    /// The leaves that the surface has left or is leaving; empty while there is no need to make the band again.
    [[nodiscard]] std::vector<std::size_t> left(const LeafArray<float>& u) const;

private:
    struct MadeFor {
        LeafMask negative{}, near{};
        int crossed = 0;
        explicit MadeFor(const float* values);
        MadeFor() = default;
    };
    std::vector<MadeFor> made_for_;
};

}  // namespace covol::detail
