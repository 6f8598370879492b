#pragma once
#include <functional>
#include <string>

namespace covol::detail {

/// Lets `write` fill a temporary file next to `path` (with the same extension, because writers may depend on it), then
/// renames it to `path`, or to the target of a symbolic link at `path`. Permissions and owner of the old file are kept.
/// If `write` throws, the temporary file is removed and the old file at `path` is unchanged. @throws Error Io; whatever
/// `write` throws.
void write_atomically(const std::string& path, const std::function<void(const std::string& temporary)>& write);

/// The same for a folder: `write` fills an empty folder next to `path`. An old folder is replaced atomically.
/// @param may_replace  whether an existing folder may be replaced
/// @throws Error Io; whatever `write` throws.
void write_folder_atomically(const std::string& path, bool may_replace,
                             const std::function<void(const std::string& temporary)>& write);

}  // namespace covol::detail
