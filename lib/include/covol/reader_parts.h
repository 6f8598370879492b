#pragma once
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// A component of the readers that is loaded or started when a file first requires it.
struct ReaderPart {
    std::string name;     ///< "itk"
    std::string formats;  ///< the formats that require it, for example "NRRD and MetaImage"
    std::string path;     ///< path of its file; empty if it is linked into the program
    std::string problem;  ///< why it cannot be used; empty if it can
};

/// Loads each part, and searches for the separate program that reads files. Only `covol doctor` needs this; readers
/// load their parts automatically.
[[nodiscard]] COVOL_API std::vector<ReaderPart> check_reader_parts();

}  // namespace covol
