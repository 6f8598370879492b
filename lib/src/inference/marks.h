#pragma once
#include <utility>
#include <vector>

#include "covol/image.h"
#include "inference/lattice.h"

namespace covol::inference {

/// Number of folds of the marks; each is held out once.
inline constexpr int kFolds = 5;

/// Marks in the image's frame. Their order, and thus their folds, is by the distance from their centroid: it depends
/// neither on the order in which the marks were given nor on a reflection of the image.
struct Marks {
    std::vector<Vec3> places;
    std::vector<std::size_t> spread;  ///< indices of marks far apart, ascending: guesses are computed from these
    double spacing = 0;               ///< median distance of a mark to the nearest other one
    double variance = 0;              ///< of the position of a mark along an axis
    /// Half-spaces n.x <= offset that contain all marks. If marks lie within a spacing of an end of the image, there
    /// are no half-spaces towards this end, so that the hull extends up to it.
    std::vector<std::pair<Vec3, double>> hull;
    std::vector<Vec3> inside, outside;  ///< positions whose side is known

    Marks(const ImageGeometry& geometry, const std::vector<Vec3>& world);
    /// The marks without one fold. @param rest, left_out  indices of the marks that remain, and of those in the fold
    [[nodiscard]] Marks without(int fold, const ImageGeometry& geometry, std::vector<std::size_t>& rest,
                                std::vector<std::size_t>& left_out) const;
    /// The marks without those at the given positions.
    [[nodiscard]] Marks without(const std::vector<Vec3>& left_out, const ImageGeometry& geometry) const;
    /// Height above the hull, negative inside of it.
    [[nodiscard]] double above_hull(const Vec3& place) const;

private:
    Marks() = default;
    Marks(std::vector<Vec3> marks, std::vector<Vec3> known_inside, std::vector<Vec3> known_outside,
          const ImageGeometry& geometry);
    /// Sorts the marks, and computes their spacing, subset and hull.
    void arrange(const ImageGeometry& geometry);
    void choose_spread();
    void make_hull(const ImageGeometry& geometry);
};

}  // namespace covol::inference
