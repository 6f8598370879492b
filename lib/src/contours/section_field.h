#pragma once
#include <array>
#include <vector>

#include "contours/sections.h"
#include "covol/run.h"

namespace covol::detail {

/// Interpolates between sections in planes of any direction: -1 inside and 1 outside on each plane, by the even-odd
/// rule, and harmonic between the planes. The value at a position is the probability that a random walk from there
/// reaches the outside before the inside, scaled to [-1, 1] (Grady, Random walks for image segmentation, IEEE PAMI
/// 28(11), 2006, with planes as seeds). By the maximum principle each part of the body, and of its outside, is
/// connected to a section with that label.
///
/// The surface is not at level 0 but at the level that best separates inside from outside in cross-validation on the
/// planes: at level 0, thin parts would vanish between their sections, where a random walk soon reaches the outside.
///
/// The discretisation is of second order: at a node beside a plane, the differences of the Laplacian end on the plane
/// instead of at the next node (Shortley and Weller, J. Appl. Phys. 9, 1938).
class SectionField {
public:
    /// @param sections  at least one, each with a polygon
    /// @param h         world units. The distance between neighbouring nodes of the lattice is h, or a multiple of h if
    ///     the lattice would otherwise have too many nodes or cross the planes too often
    /// @param origin    the lattice begins at a distance from it that is a multiple of h along each axis
    /// @throws Error Cancelled.
    SectionField(const std::vector<Section>& sections, double h, const Vec3& origin, const RunContext& run);

    /// Trilinear values, negative inside, at from + n * step, n < count.
    void row(const Vec3& from, const Vec3& step, int count, double* values) const;

    /// The volume of the sections' bounding box over the area of the planes in it, which for parallel planes is their
    /// mean distance, world units.
    [[nodiscard]] double plane_distance() const { return plane_distance_; }

private:
    [[nodiscard]] double value(const Vec3& at) const;

    double plane_distance_ = 0, cell_ = 0;
    Vec3 low_{0, 0, 0};
    std::array<int, 3> size_{0, 0, 0};
    std::vector<float> values_;  // the last index fastest
};

}  // namespace covol::detail
