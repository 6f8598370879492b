#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/run.h"

namespace covol {

/// The files that read_image() reads in addition to the file `path`, or in the folder `path`: files with the pixels of
/// a header, the other files of a series or of a set, separate description files. Empty for a Zarr store, which is read
/// as a whole. Files that are named in a header are listed even if they do not exist.
/// @throws Error as read_image().
[[nodiscard]] COVOL_API std::vector<std::string> list_image_files(const std::string& path, const RunContext& run = {});

}  // namespace covol
