#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "covol/api.h"
#include "covol/cloud_cleanup.h"
#include "covol/contours.h"
#include "covol/image.h"
#include "covol/orientation.h"
#include "covol/painted.h"
#include "covol/pipeline.h"
#include "covol/points.h"
#include "covol/run.h"

// The input that locates structures: marks of every kind, by structure, and their conversion to the input of segment().
namespace covol {

/// A label image painted by a person.
struct PaintedImage {
    Image image;
    PaintedOptions options;
    std::vector<LabelName> labels;  ///< that belong to structures
    std::string name;       ///< name of the structure that its only label belongs to; empty: the label's own name
    bool is_shared = true;  ///< paint of one structure is outside of the others, and labels keep their values
};
/// Finds the labels. @throws Error as find_painted_labels().
[[nodiscard]] COVOL_API PaintedImage make_painted(const Image& image, const PaintedOptions& options = {});

/// A mask, mesh or level set of another program, from which the segmentation starts and which is corrected by marks.
struct GivenGuess {
    Start start;                ///< as SegmentOptions::guess
    std::optional<Image> mask;  ///< if it is a mask: the mask as in its file, placed on the image
    int label = 1;              ///< in that mask
};
/// A guess from a label of a mask. @param label  0: the only one
/// @param image  on which it has to lie; none: no restriction
/// @param force  as of placed_on()
/// @throws Error InvalidInput (no such label; several labels and none chosen: lists them; as placed_on()).
[[nodiscard]] COVOL_API GivenGuess make_guess(const Image& mask, int label, const std::optional<ImageGeometry>& image,
                                              bool force = false);

/// Files with marks of one structure, read by covol/read_marks.h.
struct MarkFiles {
    std::vector<std::string> points, contours, inside, outside;
    std::string guess;  ///< mask, mesh or level set of another tool; empty: none
};

/// The structure that marks belong to, and their origin.
struct MarksOrigin {
    std::string name;                    ///< empty: it is the only structure
    int label = 0;                       ///< in a mask of all structures; 0: see number_labels()
    MarkFiles files;                     ///< empty: from memory
    std::vector<std::string> rules;      ///< how the coordinates of each cloud of points were interpreted
    std::size_t count = 0;               ///< number of marks that were given
    std::optional<std::size_t> thinned;  ///< number of points after thinning
};

/// The marks of one structure, world units.
struct Marks : MarksOrigin {
    std::vector<Vec3> points;
    PointHints hints;                         ///< for the points
    std::vector<PointCloud> contours;         ///< lines on slices
    std::vector<PointCloud> inside, outside;  ///< seeds; lines are scribbles
    std::vector<Vec3> exterior_seeds;         ///< in addition to those of SegmentOptions
    struct Paint {
        std::shared_ptr<const PaintedImage> image;
        int label = 0;
    };
    std::vector<Paint> paint;
    std::function<GivenGuess(const RunContext&)>
        guess;                    ///< called when it is needed: it may be a whole image; none: empty
    std::optional<Start> start;   ///< instead of SegmentOptions::start
    std::optional<double> delta;  ///< if EvolveOptions has none, world units
};

/// Adds a cloud to the points. @param image  none: there is no image
/// @throws Error InvalidInput as to_world(), and as check_inside() with an image.
COVOL_API void add_points(Marks& marks, const PointCloud& cloud, const std::optional<ImageGeometry>& image,
                          const RunContext& run = {});
/// Adds a cloud to the contours. @param image, @throws  as of add_points()
COVOL_API void add_contours(Marks& marks, PointCloud cloud, const std::optional<ImageGeometry>& image,
                            const RunContext& run = {});
/// For points without an image: sorts them in space, and keeps `maximum` of them, evenly spread (order_spatially()); 0:
/// all.
COVOL_API void thin_points(Marks& marks, std::size_t maximum, const RunContext& run = {});
/// Points and contours as they were given, world units.
[[nodiscard]] COVOL_API std::vector<Vec3> positions_of(const Marks& marks, const std::optional<ImageGeometry>& image);

/// The structure with that name; null if there is none.
[[nodiscard]] COVOL_API Marks* find_structure(std::vector<Marks>& structures, const std::string& name);
/// The structure with that name; if there is none, a new one at the end.
COVOL_API Marks& find_or_add_structure(std::vector<Marks>& structures, const std::string& name);
/// Assigns each label to the structure of its name. A single label without a name belongs to marks without a name.
COVOL_API void add_paint(std::vector<Marks>& structures,
                         const std::vector<std::shared_ptr<const PaintedImage>>& images);
/// Painted labels keep their values in masks; structures without a label get free values.
COVOL_API void number_labels(std::vector<Marks>& structures);

/// How marks are converted to the input of segment().
struct MarksOptions {
    ContourOptions contours;      ///< `step` is the voxel size
    CloudCleanupOptions cleanup;  ///< of the points
    bool force_geometry = false;  ///< placed_on() is forced for painted images that have as many voxels as the image
};

/// What is known of one structure in addition to its result.
struct StructureFacts : MarksOrigin {
    std::string grid;                           ///< make_grid_names()
    std::vector<Vec3> marks;                    ///< cleaned points and the marks of contours as they were set
    std::vector<std::string> contour_rules;     ///< how each cloud of contours was interpreted
    std::optional<CloudCleanupReport> cleanup;  ///< if there was something to clean
    std::vector<std::pair<std::string, PaintedLabel>> paint;  ///< paths, and what was derived from the paint
    double contour_seconds = 0;                               ///< duration of densify()
};

/// The input of segment() and reconstruct() for one structure.
struct StructureInput : StructureFacts {
    std::vector<Vec3> points;
    SegmentOptions options;
    std::function<GivenGuess(const RunContext&)> guess;  ///< not yet part of the options
};

/// Cleans the points, joins contours and painted outlines, collects the seeds. Log lines begin with the structure's
/// name; for more than four structures only warnings are logged.
/// @param options  for all structures; voxel_size has a value
/// @throws Error InvalidInput (names that are empty or not unique among several; as clean_cloud(), densify(),
///     understand_painted() and check_inside()), InvalidOptions (a tag distance beyond the marks' box).
[[nodiscard]] COVOL_API std::vector<StructureInput> prepare_marks(std::vector<Marks> structures,
                                                                  const std::optional<ImageGeometry>& image,
                                                                  const SegmentOptions& options,
                                                                  const MarksOptions& marks_options = {},
                                                                  const RunContext& run = {});

/// The context for one of several structures: its log lines begin with the name, and for more than four structures only
/// warnings are logged.
[[nodiscard]] COVOL_API RunContext speaking_for(const std::string& name, std::size_t structures, const RunContext& run);

}  // namespace covol
