#pragma once
#include <cstdint>
#include <istream>
#include <string>

// Checks data, mostly lengths, that OpenVDB reads from a file without checking. Each function begins at the stream's
// position, and throws a std::exception if the data is inconsistent. The stream has to throw if a read goes beyond the
// end of the file.
namespace covol::detail {

/// Skips a length and the text that follows it. @param what  name of the text, for the message
void skip_vdb_text(std::istream& stream, const char* what, std::int64_t file_bytes);

/// Skips and checks a list of metadata: names, types and values. OpenVDB reads as many bytes as the type of a value
/// has, even if the file states another length, so the two lengths must be equal.
void skip_vdb_metadata(std::istream& stream, std::int64_t file_bytes);

/// How a tree is stored in a .vdb file.
struct VdbTreeLayout {
    std::string type;               ///< type of the grid, for example "Tree_float_5_4_3"
    bool is_half = false;           ///< values are stored as 16-bit floats
    std::uint32_t compression = 0;  ///< flags of OpenVDB for the compression, such as COMPRESS_BLOSC
    std::int64_t file_bytes = 0;
};

/// Goes through a tree without reading its values, and checks the size of each block. This prevents buffer overflows in
/// OpenVDB, which reads as many bytes as the file states into a buffer of the correct size. Trees of types other than
/// 5_4_3 of float, double, int32, int64, vec3s and vec3d are not checked. Supports files since OpenVDB 3.0 (version
/// 222).
/// @param stream  at the beginning of the tree, after the grid's transform; its final position is undefined
/// @throws std::exception if a block does not have the expected size, or does not fit into the file.
void walk_vdb_tree(std::istream& stream, const VdbTreeLayout& layout);

}  // namespace covol::detail
