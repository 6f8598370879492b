#pragma once
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// A part of covol that is loaded, or started, when a file first requires it.
struct ReaderPart {
    std::string name;     ///< "itk"
    std::string formats;  ///< that require it: "NRRD and MetaImage"
    std::string path;     ///< of its file; empty if it is linked into the program
    std::string problem;  ///< why it cannot be used; empty if it can
};

/// Loads each of them, and looks for the separate program that reads files. For `covol doctor`: readers load their
/// parts by themselves.
[[nodiscard]] COVOL_API std::vector<ReaderPart> check_reader_parts();

}  // namespace covol
