#pragma once
// The input of segment().
#include <vector>

#include "covol/clip.h"
#include "covol/pipeline.h"

namespace covol::pipeline {

/// Marks by what they are used for; world units.
struct MarkSets {
    /// All marks that attract, including points interpolated between slices of contours, and points that continue a cut
    /// body beyond the image.
    std::vector<Vec3> attracting;
    std::vector<Vec3> trusted;  ///< the attracting marks that were given: without such points
};

/// The input of one structure, as given. The objects that it refers to must outlive it.
struct Problem {
    /// @param image  null if there is none
    /// @throws Error InvalidOptions, InvalidInput: input that no step can process.
    Problem(const Image* image, const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run);

    const Image* image;
    const SegmentOptions& options;
    const RunContext& run;
    std::vector<Vec3> given;  ///< the caller's points, and the marks of contours

    /// The caller's points, and those that are interpolated between contours.
    [[nodiscard]] MarkSets marks() const;
    [[nodiscard]] bool is_guided() const { return options.model == Model::Guided; }
    /// Whether positions inside or outside are given.
    [[nodiscard]] bool has_seeds() const {
        return !options.exterior_seeds.empty() || !options.inside.empty() || !options.outside.empty();
    }
    /// The body between closed contours, or null.
    [[nodiscard]] const ContourSolid* body() const {
        return options.contours ? options.contours->solid.get() : nullptr;
    }
    /// The region of interest, or else the image's box, or else the box of the points with `margin` (or the margin of
    /// the options) around it, as voxels of one lattice. The positions of voxels depend only on h and on the image or
    /// the given origin, so that runs on parts of an image or a cloud give grids with the same transform.
    [[nodiscard]] Domain domain(double h, const std::vector<Vec3>& points, double margin) const;
    /// domain() with this margin, regardless of the options.
    [[nodiscard]] Domain domain_with_margin(double h, const std::vector<Vec3>& points, double margin) const;
    /// The domain that covers `fine` with voxels of size h. Its lattice, too, is the same for all parts of an image.
    [[nodiscard]] Domain coarsened(const Domain& fine, double h) const;
    /// The limits of a solid regardless of the marks: the image's box, rotated like the image, and the region of
    /// interest.
    [[nodiscard]] Clip clip() const;
    /// Whether the image is rotated or sheared against the axes of the world. Its domain, a box along these axes, then
    /// contains positions outside the image.
    [[nodiscard]] bool is_turned() const;

private:
    const std::vector<Vec3>& points_;
};

}  // namespace covol::pipeline
