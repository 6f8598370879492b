#pragma once
#include <cstdint>
#include <istream>
#include <string>

// What OpenVDB takes from a file without a look, lengths above all, is looked at here before. Each function begins
// where the stream stands, and throws a std::exception where something does not fit; the stream throws at the file's
// end.
namespace covol::detail {

/// A text behind its length. @param what  for the message
void skip_vdb_text(std::istream& stream, const char* what, std::int64_t file_bytes);

/// A list of metadata: names, types and values. OpenVDB reads as many bytes as a value's type has, whatever length the
/// file gives it.
void skip_vdb_metadata(std::istream& stream, std::int64_t file_bytes);

/// How a tree lies in a .vdb file.
struct VdbTreeLayout {
    std::string type;               ///< of the grid, "Tree_float_5_4_3"
    bool is_half = false;           ///< values are 16-bit floats
    std::uint32_t compression = 0;  ///< OpenVDB's flags
    std::int64_t file_bytes = 0;
};

/// Goes over a tree without reading its values: OpenVDB reads as many bytes as a block claims into a buffer of the size
/// that it should have. Trees of other types than 5_4_3 of float, double, int32, int64, vec3s and vec3d are not looked
/// at. Files since OpenVDB 3.0 (version 222).
/// @param stream  at the tree's beginning, behind the grid's transform; left anywhere
/// @throws std::exception where a block does not have the size that it should have, or does not fit into the file.
void walk_vdb_tree(std::istream& stream, const VdbTreeLayout& layout);

}  // namespace covol::detail
