#pragma once
#include <vector>

#include "covol/fwd.h"
#include "guidance/heuristics.h"

namespace covol::guidance {

/// Number of steps of a profile within one voxel of the image along the normal.
inline constexpr int kStepsPerVoxel = 4;
/// Number of steps on either side of the border within which each depth has its own distribution of intensities.
/// Farther away, there is one distribution for inside and one for outside.
inline constexpr int kBorderSteps = 10;
inline constexpr int kDepths = 2 * kBorderSteps + 1;
inline constexpr int kLevels = 24;  ///< number of levels of intensity
/// [voxels] Distance on both sides of the surface that a profile at the maximum offset needs: that offset plus
/// kBorderSteps.
inline double profile_reach() { return kGuide.farthest + double(kBorderSteps) / kStepsPerVoxel; }

/// Intensity along the normals of one patch: each row belongs to a vertex, from `lo` to `hi` steps outward of it.
struct PatchProfile {
    int lo = 0, hi = -1;
    bool image_ends_below = false, image_ends_above = false;  ///< at `lo`, `hi`; the border may lie beyond
    int rows = 0;
    std::vector<float> values;  ///< row by row
    std::vector<float> seen;    ///< [step][level]: number of rows with that level at that step
    [[nodiscard]] int steps() const { return hi - lo + 1; }
    [[nodiscard]] bool empty() const { return rows == 0; }
};

/// A marked place: a profile and the position of the border in it.
struct MarkedPlace {
    PatchProfile profile;
    double offset = 0;  ///< of the border, steps outward of the patch
    Vec3 at{};
};

/// Logarithms of the frequency of each level of intensity at each depth (steps outward of the border), and farther
/// inside and outside than kBorderSteps.
struct BorderTable {
    std::vector<float> border;           ///< [depth + kBorderSteps][level]
    std::vector<float> inside, outside;  ///< [level]

    /// Adds to out[n] the log-likelihood, up to a constant, that the border lies first + n steps outward of the patch:
    /// the mean over the profile's rows of the sum over its steps, divided by kStepsPerVoxel. For an offset beyond the
    /// profile, all of the profile is on one side of the border.
    void likelihood(const PatchProfile& profile, int first, std::vector<double>& out) const;
};

/// The frequency of each level of intensity at each depth around the marked places, from which tables for some or all
/// of the places are computed.
class BorderProfile {
public:
    explicit BorderProfile(std::vector<MarkedPlace> places);
    void count_levels(PatchProfile& profile) const;
    /// The table of all places, weighted by `weights` (one for each place) and shrunk towards the table of the weights
    /// `base_weights`, if given.
    [[nodiscard]] BorderTable table(const std::vector<double>& weights,
                                    const std::vector<double>* base_weights = nullptr) const;
    [[nodiscard]] const std::vector<MarkedPlace>& places() const { return places_; }

private:
    struct Counts {
        std::vector<double> border, inside, outside;
        Counts() : border(kDepths * kLevels, 0.0), inside(kLevels, 0.0), outside(kLevels, 0.0) {}
        void add(const Counts& other, double weight);
    };
    [[nodiscard]] Counts count(const MarkedPlace& place) const;
    [[nodiscard]] Counts sum(const std::vector<double>& weights) const;
    static void normalise(Counts& counts, const Counts* base);

    std::vector<MarkedPlace> places_;
    std::vector<float> edges_;    // edges_[n] is the upper bound of level n; the last is infinite
    std::vector<Counts> counts_;  // by place
    Counts all_;                  // sum of counts_
};

}  // namespace covol::guidance
