#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/painted.h"
#include "covol/run.h"
#include "covol/study.h"

// Other programs' results that a study's structures begin from.
namespace covol {

/// How a study in that folder names a file: by its path from there, and its digest. @throws Error Io.
[[nodiscard]] COVOL_API StudyGuess guess_of_file(const std::string& folder, const std::string& file, int label = 0);

/// Reads guesses as read_guess() does. The last ones are kept in memory, so that a structure whose marks change need
/// not read its guess again.
/// @throws Error (of read_guess) InvalidInput: the file is another one than the study was begun with; as read_guess().
[[nodiscard]] COVOL_API StudySite open_study_site(const std::string& folder, const ImageGeometry& image);

/// The labels of a label image, by names that are unique among themselves and beside `taken`.
/// @throws Error as read_image(), placed_on() and find_painted_labels(); InvalidInput (no label image).
[[nodiscard]] COVOL_API std::vector<StudyActions::AddLabels::Label> labels_of_file(const std::string& file,
                                                                                   const ImageGeometry& image,
                                                                                   const StudyState& taken,
                                                                                   const RunContext& run = {});

}  // namespace covol
