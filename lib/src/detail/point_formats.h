#pragma once
#include <string>

#include "detail/point_files.h"

/// One reader for each family of point files. Each takes the whole file; `path` is for messages.
/// @throws Error InvalidInput, Unsupported.
namespace covol::detail {

/// XYZ, CSV, TSV: one point a line, columns by name where there is a header. Lists of marks as Fiji, napari and
/// people write them are told by their columns.
/// @param blanks_only  columns are cut at runs of blanks and tabs, unless there are commas or semicolons
PointTable parse_columns(const std::string& path, const std::string& text, bool blanks_only);

PointTable parse_obj(const std::string& path, const std::string& text);
PointTable parse_off(const std::string& path, const std::string& text);
PointTable parse_ply(const std::string& path, const std::string& bytes);

}  // namespace covol::detail
