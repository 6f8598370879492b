#pragma once
#include <vector>

#include "covol/fwd.h"
#include "guidance/heuristics.h"

namespace covol::guidance {

/// Steps of a profile for each voxel of the image along the normal.
inline constexpr int kStepsPerVoxel = 4;
/// The border's own profile extends this many steps to either side; beyond it depth does not matter.
inline constexpr int kBorderSteps = 10;
inline constexpr int kDepths = 2 * kBorderSteps + 1;
inline constexpr int kLevels = 24;  ///< of intensity
/// [voxels] On both sides of the surface, within which profiles are read: the farthest border with its own profile.
inline double profile_reach() { return kGuide.farthest + double(kBorderSteps) / kStepsPerVoxel; }

/// Intensity along the normals of one patch: rows from `lo` to `hi` steps outward of its vertices.
struct PatchProfile {
    int lo = 0, hi = -1;
    bool image_ends_below = false, image_ends_above = false;  ///< limited by the image; the border may lie beyond
    int rows = 0;
    std::vector<float> values;  ///< row by row
    std::vector<float> seen;    ///< [step][level]: number of rows with that level of intensity there
    [[nodiscard]] int steps() const { return hi - lo + 1; }
    [[nodiscard]] bool empty() const { return rows == 0; }
};

/// A marked place: a profile and the position of the border in it.
struct MarkedPlace {
    PatchProfile profile;
    double offset = 0;  ///< steps, from the patch outward
    Vec3 at{};
};

/// Logarithms of the frequency of each level at each depth (steps outward of the border), and far inside and outside.
struct BorderTable {
    std::vector<float> border;           ///< [depth + kBorderSteps][level]
    std::vector<float> inside, outside;  ///< [level]

    /// Log-likelihood of each offset first .. first + out.size() - 1 (steps), for each voxel of the image, up to a
    /// constant; mean over rows. An offset beyond the profile means that all of the profile lies on one side of the
    /// border.
    void likelihood(const PatchProfile& profile, int first, std::vector<double>& out) const;
};

/// Frequency of each level at each depth around marked places; tables are computed from some or all of these.
class BorderProfile {
public:
    explicit BorderProfile(std::vector<MarkedPlace> places);
    void count_levels(PatchProfile& profile) const;
    /// From all places, weighted by `weights`, shrunk towards the counts of `base` (may be null).
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
    std::vector<float> edges_;    // between levels, kLevels of them: the last ones may be infinite
    std::vector<Counts> counts_;  // by place
    Counts all_;                  // their sum
};

}  // namespace covol::guidance
