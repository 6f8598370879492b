#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/output/json.h"
#include "covol/digest.h"

namespace covol::tool {

/// The range [begin, end) of a file's path in the value of an option: it may be preceded by the name of a structure or
/// the kind of a start (NAME=FILE, mesh:FILE), and followed by the path of a dataset (FILE.h5:/a/b).
[[nodiscard]] std::pair<std::size_t, std::size_t> path_within(const std::string& text);

/// The parts of a name before and after {frame}; nullopt if it contains none.
[[nodiscard]] std::optional<std::pair<std::string, std::string>> around_frame(const std::string& text);
/// Whether the name consists of `parts`, the result of around_frame(), with a number between them.
[[nodiscard]] bool is_frame(const std::string& name, const std::pair<std::string, std::string>& parts);
/// The files that match a text such as NAME=FILE_{frame}.csv with any number for {frame}, sorted.
[[nodiscard]] std::vector<std::string> files_of_frames(const std::string& text);

/// Replaces paths by file names, so that output files do not reveal the folders of this machine.
[[nodiscard]] std::string without_folder(const std::string& text);
[[nodiscard]] Json without_folders(const Json& options);

/// A list of {"name", "digest"} in the order of the paths.
[[nodiscard]] Json describe_inputs(const std::vector<std::string>& paths);

}  // namespace covol::tool
