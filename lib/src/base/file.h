#pragma once
#include <string>

namespace covol::detail {

/// Exchanges the files or folders at two paths. If the file system does not support this atomically, one of the paths
/// may not exist for a moment.
/// @returns whether it succeeded; otherwise errno gives the reason.
bool swap_paths(const std::string& one, const std::string& other);

/// Removes slashes at the end of a path: "a.zarr" for "a.zarr/", the form to which a shell completes the name of a
/// folder.
std::string without_end_slash(const std::string& path);

/// The extension in lower case, with its dot. ".gz" is combined with the extension before it: extension("a.nii.gz") is
/// ".nii.gz".
std::string extension(const std::string& path);

}  // namespace covol::detail
