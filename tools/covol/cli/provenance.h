#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/json.h"
#include "covol/digest.h"

namespace covol::tool {

/// Where the path of a file lies in the value of an option, [begin, end): what stands before it is a structure's name
/// or a kind of start (NAME=FILE, mesh:FILE), what stands behind it the place of a dataset (FILE.h5:/a/b).
[[nodiscard]] std::pair<std::size_t, std::size_t> path_within(const std::string& text);

/// Of a name with {frame} in it the parts before and behind that; nothing where there is none.
[[nodiscard]] std::optional<std::pair<std::string, std::string>> around_frame(const std::string& text);
/// Whether the name has a number between these.
[[nodiscard]] bool is_frame(const std::string& name, const std::pair<std::string, std::string>& parts);
/// The files that NAME=FILE_{frame}.csv stands for, whatever their numbers, sorted.
[[nodiscard]] std::vector<std::string> files_of_frames(const std::string& text);

/// File names in place of paths: files that are passed on need not tell whose folders they come from.
[[nodiscard]] std::string without_folder(const std::string& text);
[[nodiscard]] Json without_folders(const Json& options);

/// A list of {"name", "digest"} in the order of the paths.
[[nodiscard]] Json describe_inputs(const std::vector<std::string>& paths);

}  // namespace covol::tool
