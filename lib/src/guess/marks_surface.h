#pragma once
#include <array>
#include <memory>
#include <vector>

#include "covol/run.h"
#include "guess/variational.h"

namespace covol::guess {

/// Where marks lie, and how well: their standard deviation along three directions, as world vectors.
struct ImpreciseMarks {
    std::vector<Vec3> marks;
    std::array<Vec3, 3> deviation{};
    /// Of the deviation squared: how much less precise the marks may be than is said, where they fit each other so
    /// badly.
    double max_factor = 1;
    std::vector<Vec3> seeds;  ///< places that are inside (value < 0) or outside
    std::vector<double> seed_value;

    Clip world;  ///< beyond its end nothing is known

    std::vector<Vec3> normals;  ///< about, outwards: one for each mark, or none

    [[nodiscard]] double variance_along(const Vec3& unit) const;
};

/// Numbers of `count` of the points, each as far from those before it as can be; fewer where the rest are copies.
/// @pre there are points
[[nodiscard]] std::vector<std::size_t> spread_out(const std::vector<Vec3>& points, std::size_t count,
                                                  std::size_t first = 0);

/// The surface of least energy through any number of marks: one VariationalSurface through all of them where they are
/// few; else one through a spread-out part of them, and around each place another one through its neighbours, blended
/// by weights that add up to one (partition of unity). What the whole knows, the side, is passed on to the parts; where
/// there are no marks near the whole goes on alone.
class MarksSurface {
public:
    /// @throws Error as VariationalSurface.
    MarksSurface(const ImpreciseMarks& marks, const RunContext& run);

    /// Values at from + n * step, n < count; about a distance beside the marks, negative inside.
    void row(const Vec3& from, const Vec3& step, int count, double* values) const;
    [[nodiscard]] double value(const Vec3& at) const;
    [[nodiscard]] std::size_t patches() const { return patches_.size(); }

private:
    struct Patch {
        Vec3 center;
        double radius;             ///< the weight's support
        VariationalSurface added;  ///< to the whole
    };
    void make_patches(const ImpreciseMarks& marks, const RunContext& run);
    void sort_patches();
    [[nodiscard]] Constraints with_factor(Constraints part) const;

    std::unique_ptr<VariationalSurface> whole_;
    double offset_ = 0;
    double variance_factor_ = 1;  // of the marks over what was said: less than 1 where they fit each other much better
    std::vector<Patch> patches_;
    // A lattice of cells, each with the patches that reach into it.
    Vec3 low_{0, 0, 0};
    double cell_ = 0;
    std::array<int, 3> cells_{0, 0, 0};
    std::vector<std::vector<std::uint32_t>> in_cell_;
};

}  // namespace covol::guess
