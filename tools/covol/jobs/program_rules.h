#pragma once
#include <string>
#include <vector>

#include "covol/file_kind.h"

// What goes wrong with a file in one program, and the option that mends it: the rules of covol check --for.
namespace covol::tool {

enum class Program { Any, Blender, Houdini, Slicer, Fiji, Print };

/// What the rules ask about a file.
struct FileFacts {
    FileKind kind = FileKind::Image;
    std::string ending;  ///< of the name, lower case, with its dot; as long_ending() has it
    std::string unit;    ///< of length; empty: the file states none
    double extent = 0;   ///< longest side of its box, world units
    // .vdb
    bool has_level_set = false, has_density = false, has_blosc = false;
    double voxel_size = 0;
    // meshes
    bool is_closed = true;
    int crossings = 0;  ///< self-intersections
    double wall = -1;   ///< thinnest, in the file's unit; < 0: not measured
    // images
    std::string format;  ///< as covol info says it
    bool is_rotated = false, has_spacing = true, is_big_tiff = false, has_segments = false;
    bool has_display_range = true;  ///< false of ImageJ's TIFF of labels without min and max
};

struct Advice {
    bool is_problem = false;  ///< it does not open there, or is something else; else a remark
    std::string text, mend;
};

/// What the program's rules say of the file, in the table's order.
[[nodiscard]] std::vector<Advice> advice_for(Program program, const FileFacts& facts);

/// What stands behind `key` in the first 64 KiB of a file, a word; empty where that does not occur. Headers of meshes
/// and images are text at their beginning, and this is asked of files that have been read in full before.
[[nodiscard]] std::string word_in_header(const std::string& path, const std::string& key);
[[nodiscard]] bool header_holds(const std::string& path, const std::string& text);

}  // namespace covol::tool
