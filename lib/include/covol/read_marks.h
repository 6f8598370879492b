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
    int guess_label = 0;                                 ///< of a guess that is a mask; 0: its only label
    bool force_geometry = false;                         ///< of such a mask, as of placed_on()
    std::function<const std::string&()> standard_input;  ///< content of the file "-"; none: it is a file of that name
};

/// Adds a file's points: those on the surface as add_points(), the others to the seeds of their side. Logs how they
/// were interpreted. @throws Error as add_points()
COVOL_API void add_marks(Marks& marks, const std::string& path, const KindedPoints& points,
                         const std::optional<ImageGeometry>& image, const RunContext& run = {});

/// Reads the files that `marks` names, and adds their content; a guess is only read when it is requested. Logs how the
/// points of each file were interpreted.
/// @param image  none: there is no image
/// @throws Error as read_points(); InvalidInput (marks outside the image, as check_inside()), Cancelled.
COVOL_API void read_marks(Marks& marks, const std::optional<ImageGeometry>& image, const ReadMarksOptions& options = {},
                          const RunContext& run = {});

/// Reads the file of a start that has no content yet: MeshStart, MaskStart or LevelSetStart. @throws Error as the
/// readers.
[[nodiscard]] COVOL_API Start read_start(const Start& kind, const std::string& path, const RunContext& run = {});
/// By the kind of file: make_guess() for a mask.
/// @throws Error as make_guess() and read_image(); InvalidInput (points).
[[nodiscard]] COVOL_API GivenGuess read_guess(const std::string& path, const std::optional<ImageGeometry>& image,
                                              const ReadMarksOptions& options = {}, const RunContext& run = {});

}  // namespace covol
