#pragma once
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// A part of covol that is loaded, or started, when a file first needs it.
struct ReaderPart {
    std::string name;     ///< "itk"
    std::string formats;  ///< that need it: "NRRD and MetaImage"
    std::string path;     ///< of its file; empty where it is linked into the program
    std::string problem;  ///< why it cannot be used; empty where it can
};

/// Loads each of them, and looks for the program that reads files apart from this one. For `covol doctor`: readers load
/// what they need by themselves.
[[nodiscard]] COVOL_API std::vector<ReaderPart> check_reader_parts();

}  // namespace covol
