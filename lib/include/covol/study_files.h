#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/painted.h"
#include "covol/run.h"
#include "covol/study.h"

// Results of other programs that a study's structures start from.
namespace covol {

/// Makes a reference to a file, to be stored in the study in `folder`: the path relative to the folder, and the digest
/// of the file. @throws Error Io.
[[nodiscard]] COVOL_API StudyGuess guess_of_file(const std::string& folder, const std::string& file, int label = 0);

/// A site whose read_guess reads guesses as read_guess() does. The most recent guesses are kept in memory, so that they
/// are not read again when the marks of a structure change.
/// @throws Error (by read_guess) InvalidInput: the file has changed since the study was created; as read_guess().
[[nodiscard]] COVOL_API StudySite open_study_site(const std::string& folder, const ImageGeometry& image);

/// The labels of a label image, with names that are unique among themselves and different from those in `taken`.
/// @throws Error as read_image(), placed_on() and find_painted_labels(); InvalidInput (not a label image).
[[nodiscard]] COVOL_API std::vector<StudyActions::AddLabels::Label> labels_of_file(const std::string& file,
                                                                                   const ImageGeometry& image,
                                                                                   const StudyState& taken,
                                                                                   const RunContext& run = {});

}  // namespace covol
