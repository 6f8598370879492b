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

/// How paint is to be understood.
enum class PaintedAs {
    Automatic,  ///< each label by its own paint, see understand_painted()
    Slices,     ///< slices that hold paint show the whole cross-section
    Scribbles   ///< paint only says what is inside
};
template <>
inline constexpr auto kWords<PaintedAs> = std::array{"auto", "slices", "scribbles"};

struct PaintedOptions {
    PaintedAs as = PaintedAs::Automatic;
    int outside_label = 0;  ///< a label painted on what belongs to no structure; 0: none (0 itself is unpainted)
};

template <>
inline constexpr auto kOptions<PaintedOptions> = std::tuple{
    Option{"painted_as", &PaintedOptions::as, Group::ReadingMarks,
           "slices: those that hold paint show the whole cross-section; scribbles: paint says what is inside",
           "by the paint itself"},
    Option{"painted_outside", &PaintedOptions::outside_label, kNotNegative, Group::ReadingMarks,
           "a label that was painted on what belongs to no structure", "none"}};

/// A label of a painted image.
struct LabelName {
    int label = 0;       ///< > 0
    std::string name;    ///< the file's own (3D Slicer's segments), else "label3"
    bool named = false;  ///< by the file
};

/// The labels that the image holds, ascending, with the names that a .seg.nrrd gives them.
/// @throws Error InvalidInput (nothing is painted; values that are no whole numbers >= 0: says where).
[[nodiscard]] COVOL_API std::vector<LabelName> find_painted_labels(const Image& labels);

/// Slices across an axis of the label image that show the whole cross-section of a structure.
struct PaintedView {
    int axis = 2;
    std::vector<int> slices;  ///< ascending
    PointCloud outlines;      ///< closed lines in voxels of the label image
};

/// What the paint of one label says.
struct PaintedLabel {
    int label = 0;
    std::string name;
    std::size_t voxels = 0;
    std::vector<PaintedView> views;  ///< empty where it is painted in places only
    std::vector<Vec3> inside;        ///< world positions of the paint that is no part of such a slice: its outer voxels
    std::string summary;             ///< one line for people
};

struct Painted {
    ImageGeometry geometry;  ///< of the label image
    std::vector<PaintedLabel> labels;
    std::vector<Vec3> outside;  ///< world positions of the outside label's outer voxels
};

/// Tells painted slices from paint in places, label by label.
///
/// A slice counts as painted as a whole when it holds an area: a patch wider than 2 voxels that is no stroke (one is at
/// most 4 voxels wide, and 6 times as long). Slices across an axis are taken as such where they lie apart, or in runs
/// that are thin against the widest patch (a third of its width, in voxels and in length): a ball of paint has
/// neither. Several axes may hold such slices. Where none does, thick runs across one axis are taken as such if the
/// paint ends bluntly across it: if its sections, carried on as an ellipsoid's, would go on in the next slice. All
/// other paint is a scribble.
///
/// Each patch's outline runs between the painted voxels and their neighbours, smoothed along itself without shrinking
/// (a local quadratic over 8 voxels to either side, less on small patches), by at most half a voxel anywhere. At the
/// image's end it is cut, half a voxel beyond the last centres.
/// @param names  from find_painted_labels()
/// @throws Error InvalidInput (an outside label that is not there: lists those that are).
[[nodiscard]] COVOL_API Painted understand_painted(const Image& labels, const std::vector<LabelName>& names,
                                                   const PaintedOptions& options = {}, const RunContext& run = {});

/// The outlines joined to a body, as densify() does; what lies on the image's end is cut, not marked.
/// @param lattice  of the label image. @pre the label has a view
[[nodiscard]] COVOL_API Contours connect_outlines(const PaintedLabel& label, const ImageGeometry& lattice, double step,
                                                  const RunContext& run = {});

/// The geometry that a label image of these voxels has beside `image`: its own, or the image's where its file states no
/// spacing, or `force` is set, and both have equally many voxels.
/// @throws Error InvalidInput where neither will do, or painted voxels lie outside the image: says how many and where.
[[nodiscard]] COVOL_API Image placed_on(const Image& labels, const ImageGeometry& image, bool force = false);

}  // namespace covol
