#pragma once
// The body that follows from the image and a proposal for the normals:
// 1. The surface of minimum bending energy through the marks, its normals attracted to given axes
//    (guess/variational.h).
// 2. Samples on both sides of the marks along these normals, each with the value of a guess that was computed without
//    the mark, train the log odds of inside against outside (appearance.h).
// 3. The body that minimises its weighted surface area and the log odds against it (minimal_surface.h). Surface costs
//    little on the image's edges and at marks, and much far from any mark. Above the marks' convex hull a body is
//    improbable, because people mark a structure on all sides.
#include <memory>
#include <vector>

#include "guess/variational.h"
#include "inference/appearance.h"
#include "inference/lattice.h"
#include "inference/marks.h"

namespace covol::inference {

/// [cells] Maximum that is used for the distance of a mark from a surface when surfaces are compared.
constexpr double kFarthestMiss = 4;

/// Data of a lattice's nodes that do not depend on a candidate, and are computed before the candidates.
struct Scene {
    const Marks& marks;
    Lattice lattice;
    std::shared_ptr<const ImageFeatures> image;
    Field to_mark;                                         ///< distance to the nearest mark, world units
    Field edge;                                            ///< cost by the image alone: ImageFeatures::edge()
    Field above_hull;                                      ///< height above the marks' convex hull, world units
    std::vector<std::size_t> known_inside, known_outside;  ///< nodes around positions whose side is known

    Scene(const Image& image, const Lattice& lattice, const Marks& marks, const RunContext& run);
    /// The same image with other marks.
    Scene(const Scene& other, const Marks& marks);

private:
    void measure();
};

/// A body on a lattice.
struct Solid {
    Lattice lattice;
    std::vector<char> inside;  ///< for each node, whether it is inside; empty if there is no body

    [[nodiscard]] bool empty() const { return inside.empty(); }
    /// Approximate signed distance to the body's surface, negative inside, smoothed by less than a cell.
    [[nodiscard]] Field level() const;
};

/// The body that minimize_surface() finds: the nodes at which u > 1/2. @param u  the initial value
[[nodiscard]] Solid solve_body(const Lattice& lattice, const Field& weight, const Field& cost, Field u,
                               const RunContext& run);

/// Log odds at known positions, as a multiple of the maximum for the image, kInference.max_odds.
inline constexpr double kKnown = 4;

/// The source of a candidate's normals.
struct Proposal {
    /// by mark: the line along which the normal probably lies, with the weight of guess::Constraints::axes; empty:
    /// unknown
    std::vector<Vec3> axes;
    guess::Search search = guess::Search::Wide;
    double amplitude = 0;           ///< of VariationalSurface; 0: it is estimated, which takes three times as long
    const Solid* refine = nullptr;  ///< if given, the new body may differ only in a band around this body's surface
    bool is_compared = true;        ///< false: bits and score are not computed
};

struct Candidate {
    Solid solid;
    double bits = 0;   ///< result of held_out_bits() of appearance.h
    double score = 0;  ///< log likelihood of a mark up to a constant: higher is better
    double amplitude = 0;
    bool was_continued = false;
};

[[nodiscard]] Candidate propose(const Scene& scene, const Proposal& proposal, const RunContext& run);

/// The ball around a position that is known to be inside or outside; all of the ball is assumed to be on that side. Its
/// radius is half the distance to the nearest mark, and at least one cell.
struct KnownBall {
    Vec3 middle;
    double radius;
    bool inside;
};
[[nodiscard]] std::vector<KnownBall> known_balls(const Marks& marks, double cell);

/// Unit gradients of the smoothed image at all marks. @param sigma_cells  standard deviation of the Gaussian, cells
[[nodiscard]] std::vector<Vec3> image_axes(const Scene& scene, double sigma_cells);

/// Outward unit normals of a solid at given positions.
[[nodiscard]] std::vector<Vec3> normals_of(const Solid& solid, const std::vector<Vec3>& places);

/// The surface of minimum bending energy through the marks in marks.spread, with normals near the given ones.
/// @param normals  of all marks
[[nodiscard]] guess::VariationalSurface surface_near(const Marks& marks, const std::vector<Vec3>& normals,
                                                     double amplitude);

}  // namespace covol::inference
