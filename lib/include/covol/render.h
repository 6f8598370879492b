#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/options_table.h"
#include "covol/picture.h"
#include "covol/run.h"

namespace covol {

/// One of the surfaces in a picture.
struct RenderStructure {
    std::string name;                                  ///< for the legend; UTF-8
    const FloatGrid* surface = nullptr;                ///< level set, world units; not null
    std::array<std::uint8_t, 3> color{237, 179, 107};  ///< red, green, blue
    std::vector<Vec3> marks;                           ///< world units
    /// opacity of the surface in the view of the surfaces, 0 to 1; automatic: 1; 0.35 if another structure lies in its
    /// box; 0.16 in a volume view
    std::optional<double> opacity;
};

/// The content of pictures. The objects pointed to only have to outlive the call.
struct RenderScene {
    std::vector<RenderStructure> structures;
    std::vector<Vec3> marks;       ///< marks that belong to no structure, world units
    const Image* image = nullptr;  ///< null: no slices
    std::string unit;              ///< of lengths, "um" or "mm"; empty: unknown
    /// World axes are anatomical (LPS): slices are labelled with letters at their edges, and oriented as in radiology.
    bool is_anatomical = false;
};

/// The parts of a picture.
enum class FigureKind {
    Composed,  ///< a large view of the surfaces, and slices of the image; without an image, further views instead of
               ///< slices
    Surface,   ///< only the view of the surfaces
    Slices     ///< only the slices
};
template <>
inline constexpr auto kWords<FigureKind> = std::array{"composed", "surface", "slices"};

/// The direction of a parallel view, in degrees. Azimuth 0 looks along +y and 90 along -x; elevation 90 looks along -z.
struct ViewDirection {
    double azimuth = 0, elevation = 0;
};

/// "front", "back", "left", "right", "top", "bottom" and "iso", or "AZIMUTH,ELEVATION". If the axes are anatomical,
/// left is the patient's left. @throws Error InvalidOptions.
[[nodiscard]] COVOL_API ViewDirection parse_view(const std::string& text, bool is_anatomical);

struct RenderOptions {
    int width = 1200, height = 800;  ///< pixels, 64 to 16384; their product at most 50 million
    FigureKind figure = FigureKind::Composed;
    ViewDirection view{-32, 28};
    double zoom = 1;  ///< of the view of the surfaces, 0.05 to 100
    /// the view is large enough for the surfaces at any angle about the vertical axis, so that the frames of a turn
    /// have the same scale
    bool whole_turn = false;
    /// number of slices along `slice_axis`, 0 to 64, with preference for slices with marks; none: three intersecting
    /// planes.
    std::optional<int> slices;
    /// image axis perpendicular to the slices, 0 to 2; automatic: the axis perpendicular to marked slices, else 2
    std::optional<int> slice_axis;
    std::optional<Vec3> at;  ///< world position at which the three planes intersect; automatic: the structures' centre
    bool volume = false;     ///< shows the image, volume rendered, behind the surfaces
    bool white_background = true;  ///< false: black background
};

template <>
inline constexpr auto kOptions<RenderOptions> = std::tuple{
    Option{"width", &RenderOptions::width, between(64, 16384)},
    Option{"height", &RenderOptions::height, between(64, 16384)},
    Option{"zoom", &RenderOptions::zoom, between(0.05, 100), Group::Picture,
           "magnification of the view of the surfaces"},
    Option{"volume", &RenderOptions::volume, Group::Picture, "show the image, volume rendered, behind the surfaces"},
    Option{"slices", &RenderOptions::slices, between(0, 64), Group::Picture,
           "number of slices along one axis, marked slices first; 0 for none", "three planes through the middle"},
    Option{"slice_axis", &RenderOptions::slice_axis, between(0, 2)},
    Option{"at", &RenderOptions::at, Group::Picture, "world position at which the three planes intersect",
           "the centre of the structures"},
    Rule<RenderOptions>{"size", "width * height <= 50 million",
                        [](const RenderOptions& o) { return double(o.width) * o.height <= 5e7; }},
    Rule<RenderOptions>{"view", "a finite azimuth, and an elevation of -90 to 90", [](const RenderOptions& o) {
                            return Range{}.holds(o.view.azimuth) && between(-90, 90).holds(o.view.elevation);
                        }}};

/// Draws a figure with three parts: the surfaces, shaded by the gradient of smoothed level sets, with marks, axes and a
/// scale bar; slices of the image in true proportions, with the structures' outlines, the marks within half a voxel of
/// the slice and a scale bar; and a legend. The same input gives the same picture for any number of threads.
/// @throws Error InvalidOptions; InvalidInput (no structure, a grid without voxels at a surface or with voxels that are
///     not cubes, slices without an image); Cancelled; whatever reading the image throws.
[[nodiscard]] COVOL_API Picture render(const RenderScene& scene, const RenderOptions& options = {},
                                       const RunContext& run = {});

}  // namespace covol
