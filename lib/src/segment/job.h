#pragma once
// What the steps of segment() share: what came in, what was chosen, what is made so far.
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "base/number.h"
#include "covol/clip.h"
#include "covol/pipeline.h"

namespace covol::pipeline {

using detail::number;

/// What the level set of now was made from: how far it may be from its end.
enum class StartOrigin {
    Given,       ///< a sphere, a box, a file
    Grown,       ///< one of these that has grown to the image's edges
    Guess,       ///< the surface through few marks
    Corrected,   ///< another tool's result, corrected by marks
    Cloud,       ///< the surface behind a cloud: quadrics, and an indicator between them
    Tagged,      ///< the points, tagged (closed or as a solid, too)
    Contours,    ///< the body between contours
    CoarseLevel  ///< the end of the flow on a coarser lattice
};

struct Job {
    Job(const Image* image, const std::vector<Vec3>& points, SegmentOptions options, const RunContext& run);

    const Image* image;
    std::vector<Vec3> points;      ///< all that attract
    std::vector<Vec3> trusted;     ///< those of them that are no guess between slices
    std::vector<Vec3> given;       ///< as the caller has them
    std::vector<Vec3> marks;       ///< without contours: the same without duplicates, for the fit
    std::vector<Vec3> on_surface;  ///< of a guess: those points that do not lie in the cut at the image's end
    std::vector<Vec3> hole_seeds;  ///< in the holes of contours that are tagged after all
    SegmentOptions options;        ///< automatic values are replaced as they are chosen
    bool has_automatic_range = false;
    const RunContext& run;
    SegmentResult result;
    StartOrigin origin = StartOrigin::Given;
    std::optional<CloudOrientation> cloud;  ///< of points alone, many or asked for
    FloatGridPtr obstacle, floor;           ///< of the flow, as in EvolveFields, or null
    FloatGridPtr trusted_distance;          ///< to the trusted marks, or null
    std::vector<char> border_in_start;      ///< of places_on_border(): in the start that the caller named; else empty

    SegmentReport& report() { return result.report; }
    [[nodiscard]] const Domain& domain() const { return result.report.domain; }
    [[nodiscard]] double h() const { return options.voxel_size.value_or(0); }
    /// 0: unlimited, or not chosen yet.
    [[nodiscard]] double attraction_range() const { return options.evolve.attraction_range.value_or(0); }
    [[nodiscard]] bool uses_points() const { return options.evolve.theta > 0; }
    [[nodiscard]] bool uses_image() const { return options.evolve.rho > 0; }
    /// Neither marks nor a start are given: the seeds inside are all there is.
    [[nodiscard]] bool has_seeds_alone() const {
        return options.start.kind <= Start::Kind::Tag && !options.guess && points.empty() && !options.inside.empty();
    }
    [[nodiscard]] bool starts_from_marks() const {
        return options.start.kind <= Start::Kind::Tag && !options.guess && !has_seeds_alone();
    }
    [[nodiscard]] bool tags() const { return options.start.kind == Start::Kind::Tag && starts_from_marks(); }
    [[nodiscard]] bool guesses() const { return options.start.kind == Start::Kind::Guess && starts_from_marks(); }
    [[nodiscard]] bool is_cloud() const { return options.start.kind == Start::Kind::Cloud && starts_from_marks(); }
    [[nodiscard]] bool guided() const { return options.model == Model::Guided; }
    /// Stained sheets run on beside and across the border that contours mark, and guidance by the profile alone cannot
    /// tell them apart; the edge detector of lines, with the body as a guess, can.
    [[nodiscard]] bool follows_lines() const {
        return origin == StartOrigin::Contours && uses_image() && options.edge.feature > EdgeFeature::Slope;
    }
    /// The start, or where the image moved it, is the surface: nothing pulls it off the marks, and no curvature shrinks
    /// it.
    [[nodiscard]] bool rests() const {
        if (origin == StartOrigin::Corrected) return true;
        const bool from_marks =
            origin == StartOrigin::Guess || origin == StartOrigin::Contours || origin == StartOrigin::Cloud;
        return from_marks && guided() && uses_points() && !follows_lines();
    }
    /// Until the surface is made, result.u is the cloud's field, no distance: cloud::settled_field().
    [[nodiscard]] bool rests_on_field() const { return origin == StartOrigin::Cloud && rests(); }
    /// Between closed contours, or null.
    [[nodiscard]] const ContourSolid* body() const {
        return options.contours ? options.contours->solid.get() : nullptr;
    }

    /// Reports an automatic choice, and logs it.
    void choose(const std::string& what, const std::string& value, const std::string& reason);
    /// Logs a warning, and keeps it for the report.
    void warn(const std::string& line);
    /// The region of interest, else the image's box, else that of the points with `margin` around it, in voxels of one
    /// lattice: where voxels lie depends on h and on the image or the stated origin alone, so that runs on parts of an
    /// image or a cloud give grids with one transform.
    [[nodiscard]] Domain domain_with_margin(double margin) const;
    /// The same with the margin of the options where they have one.
    [[nodiscard]] Domain domain_with_chosen_margin(double automatic) const;
    /// Where a solid ends whatever the marks say: the image's box, turned as the image is, and the region of interest.
    [[nodiscard]] Clip where_it_ends() const;
    /// Whether the image's axes are none of the world's: its domain holds places outside of it.
    [[nodiscard]] bool is_turned() const;
    /// `fine`, on the lattice of this job's larger voxels; it, too, is the same for all parts.
    [[nodiscard]] Domain coarsened(const Domain& fine) const;
};

/// Adds the wall-clock time of its life to `seconds`.
class Timed {
public:
    explicit Timed(double& seconds) : seconds_(seconds), begin_(std::chrono::steady_clock::now()) {}
    ~Timed() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

private:
    double& seconds_;
    std::chrono::steady_clock::time_point begin_;
};

}  // namespace covol::pipeline
