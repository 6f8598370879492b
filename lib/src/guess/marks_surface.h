#pragma once
#include <array>
#include <memory>
#include <vector>

#include "covol/run.h"
#include "guess/variational.h"

namespace covol::guess {

/// Positions of marks, and the standard deviation of a position along three directions as vectors in world units.
struct ImpreciseMarks {
    std::vector<Vec3> marks;
    std::array<Vec3, 3> deviation{};
    /// Maximum factor by which the squared deviation is increased if the marks fit each other worse than it implies.
    double max_factor = 1;
    std::vector<Vec3> seeds;  ///< positions that are inside (seed_value < 0) or outside
    std::vector<double> seed_value;

    Clip world;  ///< the region in which the surface is known; beyond it the body may continue

    std::vector<Vec3> normals;  ///< approximate, outward: one for each mark, or none

    [[nodiscard]] double variance_along(const Vec3& unit) const;
};

/// Indices of `count` of the points, each as far as possible from the previous ones; fewer if the others are
/// duplicates.
/// @pre `points` is not empty
[[nodiscard]] std::vector<std::size_t> spread_out(const std::vector<Vec3>& points, std::size_t count,
                                                  std::size_t first = 0);

/// The surface of minimum energy through any number of marks. If the marks are few, it is one VariationalSurface
/// through all of them. Otherwise a VariationalSurface through a spread-out subset, the whole, is corrected by patches:
/// surfaces through neighbouring marks, blended by weights that sum to one (partition of unity). The whole determines
/// which side of each patch is inside, and is used alone far from all marks.
class MarksSurface {
public:
    /// @throws Error as VariationalSurface.
    MarksSurface(const ImpreciseMarks& marks, const RunContext& run);

    /// Values at from + n * step for n < count: close to the marks approximately the signed distance, negative inside.
    void row(const Vec3& from, const Vec3& step, int count, double* values) const;
    [[nodiscard]] double value(const Vec3& at) const;
    [[nodiscard]] std::size_t patches() const { return patches_.size(); }

private:
    struct Patch {
        Vec3 center;
        double radius;             ///< of the ball in which the patch's weight is above 0
        VariationalSurface added;  ///< surface through the patch's marks minus the whole
    };
    void make_patches(const ImpreciseMarks& marks, const RunContext& run);
    void sort_patches();
    [[nodiscard]] Constraints with_factor(Constraints part) const;

    std::unique_ptr<VariationalSurface> whole_;
    double offset_ = 0;
    double variance_factor_ = 1;  // estimated variance of the marks divided by the stated one
    std::vector<Patch> patches_;
    // A lattice of cells, each with the numbers of the patches that overlap it, for finding the patches at a position.
    Vec3 low_{0, 0, 0};
    double cell_ = 0;
    std::array<int, 3> cells_{0, 0, 0};
    std::vector<std::vector<std::uint32_t>> in_cell_;
};

}  // namespace covol::guess
