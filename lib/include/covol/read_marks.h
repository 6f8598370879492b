#pragma once
#include <functional>
#include <optional>
#include <string>

#include "covol/api.h"
#include "covol/mark_kinds.h"
#include "covol/marks.h"

namespace covol {

/// How files of marks are read.
struct ReadMarksOptions {
    ReadPointsOptions points;
    int guess_label = 0;          ///< label of a guess that is a mask; 0: its only label
    bool force_geometry = false;  ///< argument `force` of placed_on() for such a mask
    /// returns the content of the file "-"; empty: "-" is the name of a file
    std::function<const std::string&()> standard_input;
};

/// Adds the points of a file: points on the surface as add_points() does, the others to the seeds inside or outside.
/// Logs how the points were interpreted. @throws Error as add_points()
COVOL_API void add_marks(Marks& marks, const std::string& path, const KindedPoints& points,
                         const std::optional<ImageGeometry>& image, const RunContext& run = {});

/// Reads the files in `marks.files` and adds their content; a guess is only read when Marks::guess is called. Logs how
/// the points of each file were interpreted.
/// @param image  none: there is no image
/// @throws Error as read_points(); InvalidInput (marks outside the image, as check_inside()), Cancelled.
COVOL_API void read_marks(Marks& marks, const std::optional<ImageGeometry>& image, const ReadMarksOptions& options = {},
                          const RunContext& run = {});

/// Reads the file of a MeshStart, MaskStart or LevelSetStart. @throws Error as the
/// readers.
[[nodiscard]] COVOL_API Start read_start(const Start& kind, const std::string& path, const RunContext& run = {});
/// Reads a guess: a mask (see make_guess()), a mesh or a level set.
/// @throws Error as make_guess() and read_image(); InvalidInput (points).
[[nodiscard]] COVOL_API GivenGuess read_guess(const std::string& path, const std::optional<ImageGeometry>& image,
                                              const ReadMarksOptions& options = {}, const RunContext& run = {});

}  // namespace covol
