#pragma once
#include <filesystem>
#include <string>

#include "covol/file_set.h"

namespace covol::detail {

/// place_of_output() of what must be a file or folder. @throws Error Io.
std::filesystem::path path_of_output(const std::string& path);

/// Gives `made` the permissions, owner, group and access list of `replaced`, of the same kind, as far as this process
/// may. Where the group cannot be kept, another one gets no more than all have. Does nothing where `replaced` is not
/// there.
void keep_attributes(const std::filesystem::path& replaced, const std::filesystem::path& made);

}  // namespace covol::detail
