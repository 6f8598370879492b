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

// Marks of every kind for each structure, and their conversion to the input of segment().
namespace covol {

/// A label image painted by a person.
struct PaintedImage {
    Image image;
    PaintedOptions options;
    std::vector<LabelName> labels;  ///< the labels that belong to structures
    std::string name;  ///< name of the structure to which all labels belong; empty: each label has its own name
    /// Several structures share the image: paint of one structure is outside of the others, and the labels are also
    /// the structures' values in masks. false: the image belongs to one structure.
    bool is_shared = true;
};
/// Makes a painted image and finds its labels. @throws Error as find_painted_labels().
[[nodiscard]] COVOL_API PaintedImage make_painted(const Image& image, const PaintedOptions& options = {});

/// A mask, mesh or level set of another program, which is corrected by marks.
struct GivenGuess {
    Start start;                ///< as SegmentOptions::guess
    std::optional<Image> mask;  ///< if the guess is a mask: that mask with all its labels, placed on the image
    int label = 1;              ///< the structure's label in that mask
};
/// Makes a guess from a label of a mask. @param label  0: the mask's only label
/// @param image  on which the mask has to lie; none: no restriction
/// @param force  as for placed_on()
/// @throws Error InvalidInput (no such label; several labels and none chosen: the message lists them; as placed_on()).
[[nodiscard]] COVOL_API GivenGuess make_guess(const Image& mask, int label, const std::optional<ImageGeometry>& image,
                                              bool force = false);

/// Paths of files with marks of one structure, which read_marks() reads.
struct MarkFiles {
    std::vector<std::string> points, contours, inside, outside;
    std::string guess;  ///< mask, mesh or level set of another tool; empty: none
};

/// The structure to which marks belong, and the files from which the marks come.
struct MarksOrigin {
    std::string name;  ///< of the structure; empty: it is the only one
    int label = 0;     ///< value of the structure in a mask of all structures; 0: number_labels() chooses it
    MarkFiles files;   ///< empty: the marks were given in memory
    /// how the coordinates of each cloud of points were interpreted, one line each for the user
    std::vector<std::string> rules;
    /// number of points and marks of contours that were given, without seeds; prepare_marks() sets it to the number of
    /// marks on painted outlines if only those are given
    std::size_t count = 0;
    std::optional<std::size_t> thinned;  ///< number of points after thinning
};

/// The marks of one structure, in world units, except for PointCloud, whose coordinates are those of its member
/// `space`.
struct Marks : MarksOrigin {
    std::vector<Vec3> points;
    PointHints hints;                         ///< for the points
    std::vector<PointCloud> contours;         ///< lines on slices
    std::vector<PointCloud> inside, outside;  ///< seeds; the lines of these clouds are scribbles
    std::vector<Vec3> exterior_seeds;         ///< in addition to those of SegmentOptions
    struct Paint {
        std::shared_ptr<const PaintedImage> image;
        int label = 0;
    };
    std::vector<Paint> paint;
    std::function<GivenGuess(const RunContext&)> guess;  ///< returns the guess; called only when it is needed, because
                                                         ///< a guess may be a large image; empty: there is no guess
    std::optional<Start> start;                          ///< replaces SegmentOptions::start
    std::optional<double> delta;  ///< replaces EvolveOptions::delta if that has no value, world units
};

/// Adds a cloud to the points. @param image  none: there is no image
/// @throws Error InvalidInput as to_world(), and as check_inside() with an image.
COVOL_API void add_points(Marks& marks, const PointCloud& cloud, const std::optional<ImageGeometry>& image,
                          const RunContext& run = {});
/// Adds a cloud to the contours. @param image, @throws  as for add_points()
COVOL_API void add_contours(Marks& marks, PointCloud cloud, const std::optional<ImageGeometry>& image,
                            const RunContext& run = {});
/// For points without an image: sorts them spatially and keeps `maximum` evenly spread points (order_spatially());
/// maximum = 0 keeps all points.
COVOL_API void thin_points(Marks& marks, std::size_t maximum, const RunContext& run = {});
/// The positions of all points and of the marks of all contours, world units.
[[nodiscard]] COVOL_API std::vector<Vec3> positions_of(const Marks& marks, const std::optional<ImageGeometry>& image);

/// The structure with that name; null if there is none.
[[nodiscard]] COVOL_API Marks* find_structure(std::vector<Marks>& structures, const std::string& name);
/// The structure with that name; if there is none, a new one at the end.
COVOL_API Marks& find_or_add_structure(std::vector<Marks>& structures, const std::string& name);
/// Assigns each painted label to the structure with its name, which is added if it does not exist. If there is only one
/// label and its image has no name, it is assigned to the only structure if that has no name, or, if there is no
/// structure and the label has no name, to a new structure without a name.
COVOL_API void add_paint(std::vector<Marks>& structures,
                         const std::vector<std::shared_ptr<const PaintedImage>>& images);
/// Gives each structure whose `label` is 0 its value in masks: that of its painted label in a shared image if no other
/// structure has it, else a value that is not used.
COVOL_API void number_labels(std::vector<Marks>& structures);

/// How marks are converted to the input of segment().
struct MarksOptions {
    ContourOptions contours;      ///< `step` is set to the voxel size
    CloudCleanupOptions cleanup;  ///< of the points
    bool force_geometry = false;  ///< the argument `force` of placed_on() for painted images
};

/// Information about one structure in addition to its result.
struct StructureFacts : MarksOrigin {
    std::string grid;                        ///< name of its grid, from make_grid_names()
    std::vector<Vec3> marks;                 ///< cleaned points and the marks of contours as they were set
    std::vector<std::string> contour_rules;  ///< how each cloud of contours was interpreted, one line each for the user
    std::optional<CloudCleanupReport> cleanup;  ///< if points were cleaned
    /// paths of painted images, and the information derived from their paint
    std::vector<std::pair<std::string, PaintedLabel>> paint;
    double contour_seconds = 0;  ///< duration of densify()
};

/// The input of segment() and reconstruct() for one structure.
struct StructureInput : StructureFacts {
    std::vector<Vec3> points;
    SegmentOptions options;
    std::function<GivenGuess(const RunContext&)> guess;  ///< becomes SegmentOptions::guess when the structure is solved
};

/// Cleans the points, joins contours and painted outlines, and collects the seeds. Log lines begin with the structure's
/// name; for more than four structures only warnings are logged.
/// @param options  for all structures; voxel_size has a value
/// @throws Error InvalidInput (names that are empty or not unique if there are several structures; as clean_cloud(),
///     densify(), understand_painted() and check_inside()), InvalidOptions (a tag distance above the diagonal of the
///     marks' box).
[[nodiscard]] COVOL_API std::vector<StructureInput> prepare_marks(std::vector<Marks> structures,
                                                                  const std::optional<ImageGeometry>& image,
                                                                  const SegmentOptions& options,
                                                                  const MarksOptions& marks_options = {},
                                                                  const RunContext& run = {});

/// The context for one of several structures: its log lines begin with the name, and for more than four structures only
/// warnings are logged.
[[nodiscard]] COVOL_API RunContext speaking_for(const std::string& name, std::size_t structures, const RunContext& run);

}  // namespace covol
