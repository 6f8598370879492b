#pragma once
#include <string>

namespace covol::detail {

/// Exchanges two paths. If the file system does not support this atomically, one of them may not exist for a moment.
/// @returns whether it succeeded; otherwise errno gives the reason.
bool swap_paths(const std::string& one, const std::string& other);

/// "a.zarr" for "a.zarr/", which is what a shell completes it to.
std::string without_end_slash(const std::string& path);

/// The extension in lower case; "gz" is combined with the one before it: extension("a.nii.gz") is ".nii.gz".
std::string extension(const std::string& path);

}  // namespace covol::detail
