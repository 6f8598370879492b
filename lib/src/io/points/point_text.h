#pragma once
#include <string>
#include <string_view>

#include "base/text.h"

/// What the readers of text files of points share.
namespace covol::detail {

/// @throws Error InvalidInput, "read_points: path:line: what".
[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& what);
[[noreturn]] void fail(const std::string& path, const std::string& what);

/// A coordinate: a finite number. @throws Error with path:line.
[[nodiscard]] double to_coordinate(const std::string& path, std::size_t line, std::string_view field);

}  // namespace covol::detail
