#pragma once
#include <functional>
#include <string>
#include <string_view>

namespace covol::detail {

/// Calls `use` with the name and the bytes of each file in a ZIP archive, in the directory's order. Entries may be
/// stored or deflated. Entries whose names `wanted` rejects are skipped without being read.
/// @throws Error InvalidInput (not an archive, truncated, a wrong checksum), Unsupported (encrypted, ZIP64, other
/// methods; a claimed unpacked size of more than 16 MiB plus 16 times the size of the archive, which is detected before
/// the entry that exceeds it is unpacked).
void for_each_in_zip(const std::string& path, std::string_view archive,
                     const std::function<bool(const std::string& name)>& wanted,
                     const std::function<void(const std::string& name, const std::string& bytes)>& use);

}  // namespace covol::detail
