#pragma once
#include <cstdint>
#include <vector>

#include "grid/leaf_band.h"

namespace covol::detail {

class StateFile;

/// The level set u on a band, and the part of each leaf that is in the domain. Beyond the domain u is not part of the
/// solution, and may have other signs.
class BandValues {
public:
    BandValues(const LeafArray<float>& u, const LeafBand& band, const Domain& domain)
        : u_(u), band_(band), box_(box_of(domain)) {}
    [[nodiscard]] std::size_t size() const noexcept { return band_.size(); }
    [[nodiscard]] const float* leaf(std::size_t i) const { return u_.leaf(i); }
    [[nodiscard]] LeafMask in_domain(std::size_t i) const { return mask_in_box(band_.origin(i), box_); }

private:
    const LeafArray<float>& u_;
    const LeafBand& band_;
    CoordBBox box_;
};

/// The effect of one step on the level set in a leaf. Edges are those between voxels of the leaf in the domain.
struct LeafMotion {
    double displacement = 0.0;  ///< sum over edges of the motion of the zero crossing along the edge, voxels
    int edges = 0;              ///< number of edges that are crossed before or after the step
    float largest = 0.0F;       ///< max |u^n - u^{n-1}|, voxels
    bool negative = false, positive = false;  ///< signs of u in the leaf, as far as it is in the domain
    bool finite = true;

    /// The motion in a later step in which the leaf's values do not change.
    [[nodiscard]] LeafMotion without_motion() const {
        LeafMotion still = *this;
        still.displacement = 0.0;
        still.largest = 0.0F;
        return still;
    }
};

/// Compares the zero crossings of u on the edges of a leaf before and after a step. An edge that is crossed before and
/// after contributes the distance between the two crossings, and one that is crossed only before or only after
/// contributes half an edge. Unlike the change of u, the sum is 0 for a profile that becomes steeper without moving.
/// @param in_domain  BandValues::in_domain()
[[nodiscard]] LeafMotion motion_of(const float* now, const float* before, const LeafMask& in_domain);
/// For a leaf whose values have not changed and do not have to be compared.
[[nodiscard]] LeafMotion without_comparison(const float* values, const LeafMask& in_domain);

/// The whole band's motion in a step.
struct Motion {
    double mean = 0.0;  ///< mean displacement of the zero crossings, voxels
    bool crosses = false;
    bool finite = true;
};
[[nodiscard]] Motion total(const std::vector<LeafMotion>& leaves);

/// Number of voxel edges that a surface of the area of one voxel face crosses, averaged over its directions.
inline constexpr double kCrossingsPerVoxel = 1.5;

/// Net motion of the front, from the number of voxels that changed sign over a window of steps. Next to an edge of the
/// image, crossings oscillate by a few hundredths of a voxel around their position; the motion per step then stays
/// above the tolerance, but the net motion falls below it.
class NetMotion {
public:
    static constexpr int kWindow = 10;  ///< number of steps in a window
    /// To be called once in each step. @return mean motion per step over the window of steps that this step completes,
    /// voxels; infinity if it completes none
    double per_step(const BandValues& u);
    void exchange(StateFile& file);

private:
    std::vector<LeafMask> signs_;  // signs of u at the beginning of the window
    int age_ = 0;
};

/// Zero crossings on the edges of voxels, stored leaf by leaf to measure how far the front moves.
class CrossingMarks {
public:
    struct Displacement {
        double mean = 0.0, largest = 0.0;  ///< displacement of the crossings of one leaf, voxels
        double slope = 1.0;                ///< |grad u| on the front, mean over the leaf; 1 if there are few crossings
    };
    /// Stores the current crossings. @return their displacement since those stored before; infinity the first time
    Displacement renew(std::size_t leaf, const float* u, const LeafMask& in_domain);
    void resize(std::size_t leaves) { leaves_.resize(leaves); }
    /// To be called when the band was rebuilt. @param old_leaf  for each new leaf the old one at the same position, or
    /// -1
    void remake(const std::vector<std::int32_t>& old_leaf);
    [[nodiscard]] std::size_t count(std::size_t leaf) const { return leaves_[leaf].crossings.size(); }
    void exchange(StateFile& file);

private:
    struct Crossing {
        std::uint16_t edge;  ///< 512 * axis + voxel
        float at;            ///< position along the edge, 0 to 1
    };
    struct Leaf {
        std::vector<Crossing> crossings;
        bool is_marked = false;
    };
    std::vector<Leaf> leaves_;
};

/// The rebuild criterion of a tracked band: the front's displacement in a leaf since the band was built there. A leaf
/// is due once its mean displacement, estimated from voxels that changed sign, exceeds three quarters of a voxel, or
/// once the front has passed a voxel that was 2 voxels deep.
class FrontDisplacement {
public:
    void set_references(const BandValues& u);
    /// To be called when the band was rebuilt. @param old_leaf  for each new leaf the old one with the same values, or
    /// -1
    void remake(const std::vector<std::int32_t>& old_leaf, const BandValues& u);
    /// The leaves to rebuild: those that are due, and those in which the front has moved at least half as far. Empty as
    /// long as less than kCommon.minority of the leaves with a front are due and the front has passed no deep voxel.
    [[nodiscard]] std::vector<std::size_t> due_leaves(const BandValues& u) const;
    void exchange(StateFile& file);

private:
    struct Reference {
        LeafMask negative{}, near{};
        int crossed = 0;
        Reference(const float* values, const LeafMask& in_domain);
        Reference() = default;
    };
    std::vector<Reference> references_;
};

}  // namespace covol::detail
