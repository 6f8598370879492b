#pragma once
#include <functional>
#include <string>

namespace covol::detail {

/// Lets `write` fill a temporary file beside `path` (same ending, so that writers that go by the name work), then
/// renames it onto `path`, or onto what `path` is a symbolic link to, with the permissions and the owner of what was
/// there. When `write` throws, the temporary is removed and an old `path` stays as it was.
/// @throws Error Io; whatever `write` throws.
void write_atomically(const std::string& path, const std::function<void(const std::string& temporary)>& write);

/// The same for a folder: `write` fills an empty one beside `path`. An old folder is replaced, at once.
/// @param may_replace  whether what is there may go @throws Error Io; whatever `write` throws.
void write_folder_atomically(const std::string& path, bool may_replace,
                             const std::function<void(const std::string& temporary)>& write);

}  // namespace covol::detail
