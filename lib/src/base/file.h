#pragma once
#include <functional>
#include <string>

namespace covol::detail {

/// Lets `write` fill a temporary file beside `path` (same ending, so that writers that go by the name work), then
/// renames it onto `path`. When `write` throws, the temporary is removed and an old `path` stays as it was.
/// @throws Error Io; whatever `write` throws.
void write_atomically(const std::string& path, const std::function<void(const std::string& temporary)>& write);

/// The same for a folder: `write` fills an empty one beside `path`. An old folder is replaced, at once.
/// @param may_replace  whether what is there may go @throws Error Io; whatever `write` throws.
void write_folder_atomically(const std::string& path, bool may_replace,
                             const std::function<void(const std::string& temporary)>& write);

/// What lies at one path lies at the other after; for a moment neither may be there where a file system cannot do it at
/// once. @returns whether it did, errno says why not.
bool swap_paths(const std::string& one, const std::string& other);

/// "a.zarr" of "a.zarr/", as a shell completes it.
std::string without_end_slash(const std::string& path);

/// "gz" is looked through: extension("a.nii.gz") is ".nii.gz"; always lower case.
std::string extension(const std::string& path);

}  // namespace covol::detail
