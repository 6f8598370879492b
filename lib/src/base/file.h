#pragma once
#include <functional>
#include <string>

namespace covol::detail {

/// Lets `write` fill a temporary file beside `path` (same ending, so that writers that go by the name work), then
/// renames it onto `path`. When `write` throws, the temporary is removed and an old `path` stays as it was.
/// @throws Error Io; whatever `write` throws.
void write_atomically(const std::string& path, const std::function<void(const std::string& temporary)>& write);

/// "gz" is looked through: extension("a.nii.gz") is ".nii.gz"; always lower case.
std::string extension(const std::string& path);

}  // namespace covol::detail
