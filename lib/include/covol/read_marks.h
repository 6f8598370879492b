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
    int guess_label = 0;                                 ///< of a guess that is a mask; 0: its only one
    bool force_geometry = false;                         ///< of such a mask, as of placed_on()
    std::function<const std::string&()> standard_input;  ///< what the file "-" holds; none: it is a file of that name
};

/// Adds a file's points: those on the surface as add_points(), the others to the seeds of their side. Says how they
/// were understood. @throws Error as add_points()
COVOL_API void add_marks(Marks& marks, const std::string& path, const KindedPoints& points,
                         const std::optional<ImageGeometry>& image, const RunContext& run = {});

/// Reads the files that `marks` names, and adds what they hold; a guess is read when it is asked for. Says how the
/// points of each file were understood.
/// @param image  none: there is no image
/// @throws Error as read_points(); InvalidInput (marks outside the image, as check_inside()), Cancelled.
COVOL_API void read_marks(Marks& marks, const std::optional<ImageGeometry>& image, const ReadMarksOptions& options = {},
                          const RunContext& run = {});

/// Reads the file of a start that has none yet: MeshStart, MaskStart or LevelSetStart. @throws Error as the readers.
[[nodiscard]] COVOL_API Start read_start(const Start& kind, const std::string& path, const RunContext& run = {});
/// By the file's kind: make_guess() of a mask.
/// @throws Error as make_guess() and read_image(); InvalidInput (points).
[[nodiscard]] COVOL_API GivenGuess read_guess(const std::string& path, const std::optional<ImageGeometry>& image,
                                              const ReadMarksOptions& options = {}, const RunContext& run = {});

}  // namespace covol
