#pragma once
#include <filesystem>
#include <string>

#include "covol/file_set.h"

namespace covol::detail {

/// place_of_output() for an output that must be a file or folder. @throws Error Io.
std::filesystem::path path_of_output(const std::string& path);

/// Gives `made` the permissions, owner, group and access list of `replaced`, which is of the same kind, as far as this
/// process may. If the group cannot be kept, the new group gets no more permissions than all users. Does nothing if
/// `replaced` does not exist.
void keep_attributes(const std::filesystem::path& replaced, const std::filesystem::path& made);

}  // namespace covol::detail
