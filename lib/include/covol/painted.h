#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/contours.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// How painted voxels are interpreted.
enum class PaintedAs {
    Automatic,  ///< chosen for each label from its paint, see understand_painted()
    Slices,     ///< slices that contain paint show the whole cross-section
    Scribbles   ///< painted voxels are inside, and nothing is known about the others
};
template <>
inline constexpr auto kWords<PaintedAs> = std::array{"auto", "slices", "scribbles"};

struct PaintedOptions {
    PaintedAs as = PaintedAs::Automatic;
    int outside_label = 0;  ///< the label of paint outside of all structures; 0: none (0 itself means unpainted)
};

template <>
inline constexpr auto kOptions<PaintedOptions> =
    std::tuple{Option{"painted_as", &PaintedOptions::as, Group::ReadingMarks,
                      "slices: each painted slice shows the whole cross-section; scribbles: painted voxels are inside, "
                      "the others are unknown",
                      "from the painted voxels"},
               Option{"painted_outside", &PaintedOptions::outside_label, kNotNegative, Group::ReadingMarks,
                      "label painted on places that belong to no structure", "none"}};

/// A label of a painted image.
struct LabelName {
    int label = 0;       ///< > 0
    std::string name;    ///< the name in the file (3D Slicer's segments), else for example "label3"
    bool named = false;  ///< the file contains a name for the label
};

/// The labels in the image, ascending, with the names that a .seg.nrrd gives them.
/// @throws Error InvalidInput (nothing is painted; values that are not whole numbers >= 0: the message contains the
///     position).
[[nodiscard]] COVOL_API std::vector<LabelName> find_painted_labels(const Image& labels);

/// Slices perpendicular to an axis of the label image that show the whole cross-section of a structure.
struct PaintedView {
    int axis = 2;
    std::vector<int> slices;  ///< ascending
    PointCloud outlines;      ///< closed lines in voxels of the label image
};

/// What was derived from the paint of one label.
struct PaintedLabel {
    int label = 0;
    std::string name;
    std::size_t voxels = 0;
    std::vector<PaintedView> views;  ///< empty if all paint is scribbles
    std::vector<Vec3> inside;        ///< seeds: world positions of the outer voxels of scribbles
    std::string summary;             ///< one line for the user
};

struct Painted {
    ImageGeometry geometry;  ///< of the label image
    std::vector<PaintedLabel> labels;
    std::vector<Vec3> outside;  ///< seeds: world positions of the outer voxels of PaintedOptions::outside_label
};

/// Distinguishes, for each label, slices painted as a whole from scribbles.
///
/// A slice counts as painted as a whole if it contains an area: a patch at least 2 voxels wide that is not a stroke (a
/// stroke is at most 4 voxels wide, and at least 6 times as long). Slices perpendicular to an axis are accepted if they
/// are separate, or form runs of adjacent slices that are thin compared with the widest patch (at most half of its
/// width, in voxels and in length); a ball of paint satisfies neither condition. Several axes may have such slices. If
/// no axis has, thick runs along one axis are accepted if the paint ends abruptly there: its sections, extrapolated
/// like those of an ellipsoid, would continue into the next slice. All other paint is a scribble.
///
/// The outline of a patch runs between the painted voxels and their neighbours. It is smoothed without shrinking (a
/// local quadratic over 8 voxels to each side, fewer on small patches), which moves it by at most half a voxel. At the
/// image's end it is cut, half a voxel beyond the last voxel centres.
/// @param names  from find_painted_labels()
/// @throws Error InvalidInput (an outside label that does not exist: the message lists the existing ones).
[[nodiscard]] COVOL_API Painted understand_painted(const Image& labels, const std::vector<LabelName>& names,
                                                   const PaintedOptions& options = {}, const RunContext& run = {});

/// Joins the outlines to a body, as densify() does. Parts of outlines at the image's end are places where the body is
/// cut, and not marks on its surface.
/// @param lattice  of the label image. @pre label.views is not empty
[[nodiscard]] COVOL_API Contours connect_outlines(const PaintedLabel& label, const ImageGeometry& lattice, double step,
                                                  const RunContext& run = {});

/// The label image with the geometry that fits `image`: its own, or, if its file states no spacing or `force` is set,
/// that of `image`, provided that both have the same number of voxels.
/// @throws Error InvalidInput if neither geometry fits, or painted voxels lie outside the image: the message contains
/// their number and positions.
[[nodiscard]] COVOL_API Image placed_on(const Image& labels, const ImageGeometry& image, bool force = false);

}  // namespace covol
