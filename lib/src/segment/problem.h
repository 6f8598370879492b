#pragma once
// What segment() is asked.
#include <vector>

#include "covol/clip.h"
#include "covol/pipeline.h"

namespace covol::pipeline {

/// Marks by what they are used for; world units.
struct MarkSets {
    std::vector<Vec3> attracting;  ///< all that pull the surface, those between the slices of contours, too
    std::vector<Vec3> trusted;     ///< those of them that are no guess between slices
};

/// The input of one structure, as it is given. What it refers to has to outlive it.
struct Problem {
    /// @param image  null: there is none
    /// @throws Error InvalidOptions, InvalidInput: what no step can work with.
    Problem(const Image* image, const std::vector<Vec3>& points, const SegmentOptions& options, const RunContext& run);

    const Image* image;
    const SegmentOptions& options;
    const RunContext& run;
    std::vector<Vec3> given;  ///< the caller's points, and the marks of contours

    /// The caller's points, and those that contours are densified by.
    [[nodiscard]] MarkSets marks() const;
    [[nodiscard]] bool is_guided() const { return options.model == Model::Guided; }
    /// Whether places are named that are inside, or outside.
    [[nodiscard]] bool has_seeds() const {
        return !options.exterior_seeds.empty() || !options.inside.empty() || !options.outside.empty();
    }
    /// Between closed contours, or null.
    [[nodiscard]] const ContourSolid* body() const {
        return options.contours ? options.contours->solid.get() : nullptr;
    }
    /// The region of interest, else the image's box, else that of the points with `margin` around it, or with that of
    /// the options, in voxels of one lattice: where voxels lie depends on h and on the image or the stated origin
    /// alone, so that runs on parts of an image or a cloud give grids with one transform.
    [[nodiscard]] Domain domain(double h, const std::vector<Vec3>& points, double margin) const;
    /// The same with this margin, whatever the options say.
    [[nodiscard]] Domain domain_with_margin(double h, const std::vector<Vec3>& points, double margin) const;
    /// `fine`, on the lattice of larger voxels; it, too, is the same for all parts.
    [[nodiscard]] Domain coarsened(const Domain& fine, double h) const;
    /// Where a solid ends whatever the marks say: the image's box, turned as the image is, and the region of interest.
    [[nodiscard]] Clip clip() const;
    /// Whether the image's axes are none of the world's: its domain holds places outside of it.
    [[nodiscard]] bool is_turned() const;

private:
    const std::vector<Vec3>& points_;
};

}  // namespace covol::pipeline
