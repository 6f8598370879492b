#pragma once
#include <cstdint>
#include <vector>

#include "covol/domain.h"
#include "grid/halo.h"
#include "grid/leaf_band.h"
#include "scheme/scheme.h"

namespace covol::detail {

/// The half width of the band of a moving surface, in voxels: 3 in which the distance is not clamped, and about 2 by
/// which the surface may move before the band is rebuilt.
inline constexpr double kTrackingWidth = 5.0;

/// Distances to the zero level set of a field on some leaves of a band, up to a width, in voxels: Godunov's scheme with
/// the surface's intersections with voxel edges as boundary values. First order, at a twentieth of the cost of a search
/// for nearest points.
class LocalDistance {
public:
    static constexpr std::size_t kCuts = 3 * kLeafSize;  ///< number of values in Scratch::cuts for each leaf
    struct Scratch {
        float* cuts;                           ///< kCuts values for each leaf of the zone
        float* distances;                      ///< kLeafSize values for each leaf of the band
        const std::uint32_t* place = nullptr;  ///< by leaf: number of its block in `cuts`; null: the leaf's own number
    };

    /// @param u        in voxels; its blocks beyond the band need not contain distances
    /// @param zone     by leaf: nonzero if its distances are computed; in all other leaves |u| is taken as the distance
    /// @param clamp    voxels: u was clamped to this magnitude, so that larger distances are not taken from it
    /// @param width    maximum distance, voxels
    /// @param scratch  memory for intermediate results and the distances; its initial content is not used
    LocalDistance(const LeafBand& band, const HaloField& u, const std::vector<unsigned char>& zone,
                  const Domain& domain, float clamp, float width, Scratch scratch);
    void compute();

    /// The distances of a leaf's voxels; `width` if the surface is farther away.
    [[nodiscard]] const float* distance(std::size_t leaf) const { return scratch_.distances + leaf * kLeafSize; }
    /// The same, but next to the surface |u| is only scaled, see SchemeKernels::settle.
    [[nodiscard]] const float* settled(std::size_t leaf) const { return cut(leaf); }

private:
    [[nodiscard]] float* cut(std::size_t leaf) const {
        return scratch_.cuts + (scratch_.place != nullptr ? scratch_.place[leaf] : leaf) * kCuts;
    }
    [[nodiscard]] float* distances(std::size_t leaf) { return scratch_.distances + leaf * kLeafSize; }
    void start(std::size_t leaf);
    void load_distance(std::size_t leaf, float* out) const;
    void spread();
    [[nodiscard]] RowMask beside(const std::vector<RowMask>& decreased, std::size_t leaf) const;
    void settle(std::size_t leaf);

    const LeafBand& band_;
    const HaloField& u_;
    const std::vector<unsigned char>& zone_;
    const Domain& domain_;
    float clamp_, width_;
    LeafArray<float> far_;
    // `cuts` contains the cuts of voxel edges by the surface. At its end, compute() overwrites them with settled().
    Scratch scratch_;
};

}  // namespace covol::detail
