#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/run.h"

namespace covol {

/// The files that read_image() reads for `path` beside that file, or in that folder: detached pixels, the other files
/// of a series or of a set, separate description files. None for a Zarr store, which is read as a whole. Files named in
/// a header need not exist.
/// @throws Error as read_image().
[[nodiscard]] COVOL_API std::vector<std::string> list_image_files(const std::string& path, const RunContext& run = {});

}  // namespace covol
