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

// What says where structures are: marks of every kind, by structure, and what segment() takes of them.
namespace covol {

/// A label image that somebody painted.
struct PaintedImage {
    Image image;
    PaintedOptions options;
    std::vector<LabelName> labels;  ///< that belong to structures
    std::string name;               ///< of the structure that its only label belongs to; empty: the label's own
    bool is_shared = true;          ///< paint of one structure is outside of the others, and labels keep their values
};
/// Finds the labels. @throws Error as find_painted_labels().
[[nodiscard]] COVOL_API PaintedImage make_painted(const Image& image, const PaintedOptions& options = {});

/// Another tool's result that marks correct.
struct GivenGuess {
    Start start;                ///< as SegmentOptions::guess
    std::optional<Image> mask;  ///< as its file holds it, where it is one, placed on the image
    int label = 1;              ///< in that mask
};
/// A label of a mask. @param label  0: the only one
/// @param image  that it has to lie on; none: wherever it lies
/// @param force  as of placed_on()
/// @throws Error InvalidInput (no such label; several labels and none chosen: lists them; as placed_on()).
[[nodiscard]] COVOL_API GivenGuess make_guess(const Image& mask, int label, const std::optional<ImageGeometry>& image,
                                              bool force = false);

/// Files with marks of one structure; covol/read_marks.h reads them.
struct MarkFiles {
    std::vector<std::string> points, contours, inside, outside;
    std::string guess;  ///< another tool's mask, mesh or level set; empty: none
};

/// Which structure marks belong to, and where they come from.
struct MarksOrigin {
    std::string name;                    ///< empty: it is the only structure
    int label = 0;                       ///< in a mask of all structures; 0: see number_labels()
    MarkFiles files;                     ///< empty: from memory
    std::vector<std::string> rules;      ///< how the coordinates of each cloud of points were understood
    std::size_t count = 0;               ///< marks that were given
    std::optional<std::size_t> thinned;  ///< the points, to so many
};

/// The marks of one structure, world units.
struct Marks : MarksOrigin {
    std::vector<Vec3> points;
    PointHints hints;                         ///< of the points
    std::vector<PointCloud> contours;         ///< lines on slices
    std::vector<PointCloud> inside, outside;  ///< seeds; lines are scribbles
    std::vector<Vec3> exterior_seeds;         ///< beside those of SegmentOptions
    struct Paint {
        std::shared_ptr<const PaintedImage> image;
        int label = 0;
    };
    std::vector<Paint> paint;
    std::function<GivenGuess(const RunContext&)>
        guess;                    ///< called when it is needed: it may be a whole image; none: empty
    std::optional<Start> start;   ///< instead of SegmentOptions::start
    std::optional<double> delta;  ///< where EvolveOptions has none, world units
};

/// Adds a cloud to the points. @param image  none: there is no image
/// @throws Error InvalidInput as to_world(), and as check_inside() with an image.
COVOL_API void add_points(Marks& marks, const PointCloud& cloud, const std::optional<ImageGeometry>& image,
                          const RunContext& run = {});
/// Adds a cloud to the contours. @param image, @throws  as of add_points()
COVOL_API void add_contours(Marks& marks, PointCloud cloud, const std::optional<ImageGeometry>& image,
                            const RunContext& run = {});
/// Of points without an image: sorts them in space, and keeps `most` of them, evenly spread (order_spatially()); 0:
/// all.
COVOL_API void thin_points(Marks& marks, std::size_t maximum, const RunContext& run = {});
/// Points and contours as they were given, world units.
[[nodiscard]] COVOL_API std::vector<Vec3> positions_of(const Marks& marks, const std::optional<ImageGeometry>& image);

/// The structure of that name; null where there is none.
[[nodiscard]] COVOL_API Marks* find_structure(std::vector<Marks>& structures, const std::string& name);
/// The structure of that name, a new one at the end where there is none.
COVOL_API Marks& find_or_add_structure(std::vector<Marks>& structures, const std::string& name);
/// Gives each label to the structure of its name. A single label that nobody named belongs to marks without a name.
COVOL_API void add_paint(std::vector<Marks>& structures,
                         const std::vector<std::shared_ptr<const PaintedImage>>& images);
/// Painted labels keep their values in masks; structures without a label get what is free.
COVOL_API void number_labels(std::vector<Marks>& structures);

/// How marks become what segment() takes.
struct MarksOptions {
    ContourOptions contours;      ///< `step` is the voxel size
    CloudCleanupOptions cleanup;  ///< of the points
    bool force_geometry = false;  ///< painted images of as many voxels take the image's geometry over, as placed_on()
};

/// What is known of one structure beside its result.
struct StructureFacts : MarksOrigin {
    std::string grid;                           ///< make_grid_names()
    std::vector<Vec3> marks;                    ///< points, cleaned, and those of contours, as they were clicked
    std::vector<std::string> contour_rules;     ///< how each cloud of contours was understood
    std::optional<CloudCleanupReport> cleanup;  ///< where something was to be done
    std::vector<std::pair<std::string, PaintedLabel>> paint;  ///< paths, and what the paint says
    double contour_seconds = 0;                               ///< that densify() took
};

/// What segment() and reconstruct() take of one structure.
struct StructureInput : StructureFacts {
    std::vector<Vec3> points;
    SegmentOptions options;
    std::function<GivenGuess(const RunContext&)> guess;  ///< not in the options yet
};

/// Cleans the points, joins contours and painted outlines, collects the seeds. Lines of the log begin with the
/// structure's name; of more than four structures only warnings are logged.
/// @param options  of all structures; voxel_size has a value
/// @throws Error InvalidInput (names that are empty or not unique among several; as clean_cloud(), densify(),
///         understand_painted() and check_inside()), InvalidOptions (a tag distance beyond the marks' box).
[[nodiscard]] COVOL_API std::vector<StructureInput> prepare_marks(std::vector<Marks> structures,
                                                                  const std::optional<ImageGeometry>& image,
                                                                  const SegmentOptions& options,
                                                                  const MarksOptions& marks_options = {},
                                                                  const RunContext& run = {});

/// The context of one of several structures: its lines begin with the name, and of more than four structures only
/// warnings are logged.
[[nodiscard]] COVOL_API RunContext speaking_for(const std::string& name, std::size_t structures, const RunContext& run);

}  // namespace covol
