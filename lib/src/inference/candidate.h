#pragma once
// A body by the image and by a guess of its normals:
// 1. The surface through the marks that bends least, its normals drawn to given axes (guess/variational.h).
// 2. What lies on both sides of the marks along these normals, and what the guess says there where it was made without
//    them, teaches log odds of inside against outside (appearance.h).
// 3. The body of least surface with these odds (minimal_surface.h). Surface costs little on the image's edges and at
//    marks, and much far from any mark; above the marks' convex hull a body is improbable: people mark all around what
//    they mean.
#include <memory>
#include <vector>

#include "guess/variational.h"
#include "inference/appearance.h"
#include "inference/lattice.h"
#include "inference/marks.h"

namespace covol::inference {

/// [cells] From a mark to a surface, at most: a miss is a miss.
constexpr double kFarthestMiss = 4;

/// What is known of a lattice's nodes before there is a candidate.
struct Scene {
    const Marks& marks;
    Lattice lattice;
    std::shared_ptr<const ImageFeatures> image;
    Field to_mark;                                         ///< distance to the nearest mark
    Field edge;                                            ///< in (0,1]: what surface costs by the image's slope alone
    Field above_hull;                                      ///< height above the marks' convex hull
    std::vector<std::size_t> known_inside, known_outside;  ///< nodes beside places that are known to be so

    Scene(const Image& image, const Lattice& lattice, const Marks& marks, const RunContext& run);
    /// The same image with other marks.
    Scene(const Scene& other, const Marks& marks);

private:
    void measure();
};

/// A body on a lattice.
struct Solid {
    Lattice lattice;
    std::vector<char> inside;  ///< by node; empty: there is none

    [[nodiscard]] bool empty() const { return inside.empty(); }
    /// About the signed distance to its surface, smoothed by less than a cell.
    [[nodiscard]] Field level() const;
};

/// The body whose surface and cost are least: minimize_surface(). @param u  the first guess
[[nodiscard]] Solid solve_body(const Lattice& lattice, const Field& weight, const Field& cost, Field u,
                               const RunContext& run);

/// Log odds of what is known, in the most that the image may say.
inline constexpr double kKnown = 4;

/// Where a candidate's normals come from.
struct Proposal {
    std::vector<Vec3> axes;  ///< of each mark; empty: the marks alone
    double strength = 0;     ///< of them, in mean eigenvalues of the bending energy
    guess::Search search = guess::Search::Wide;
    double amplitude = 0;           ///< of VariationalSurface; 0: from the marks, which takes thrice as long
    const Solid* refine = nullptr;  ///< only beside the surface of this one
    bool is_compared = true;        ///< false: bits and score are not needed
};

struct Candidate {
    Solid solid;
    double bits = 0;   ///< of appearance.h's held_out_bits()
    double score = 0;  ///< log likelihood of a mark, but for a constant: higher is better
    double amplitude = 0;
    bool was_continued = false;
};

[[nodiscard]] Candidate propose(const Scene& scene, const Proposal& proposal, const RunContext& run);

/// A place that is known to be inside or outside tells as far as halfway to the nearest mark, and a cell at least.
struct KnownBall {
    Vec3 middle;
    double radius;
    bool inside;
};
[[nodiscard]] std::vector<KnownBall> known_balls(const Marks& marks, double cell);

/// Unit gradients of the image at all marks. @param fading  shorter where they are no larger than usual
[[nodiscard]] std::vector<Vec3> image_axes(const Scene& scene, double sigma_cells, bool fading);

/// Outward unit normals of a solid at places.
[[nodiscard]] std::vector<Vec3> normals_of(const Solid& solid, const std::vector<Vec3>& places);

/// The surface of least energy through the spread marks, near these normals (of all marks).
[[nodiscard]] guess::VariationalSurface surface_near(const Marks& marks, const std::vector<Vec3>& normals,
                                                     double amplitude);

}  // namespace covol::inference
