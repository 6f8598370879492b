#pragma once
#include <string>

namespace covol::detail {

/// What lies at one path lies at the other after; for a moment neither may be there where a file system cannot do it at
/// once. @returns whether it did, errno says why not.
bool swap_paths(const std::string& one, const std::string& other);

/// "a.zarr" of "a.zarr/", as a shell completes it.
std::string without_end_slash(const std::string& path);

/// "gz" is looked through: extension("a.nii.gz") is ".nii.gz"; always lower case.
std::string extension(const std::string& path);

}  // namespace covol::detail
