#pragma once
#include <string>
#include <vector>

#include "covol/file_kind.h"

// Problems of a file in one program, and the options that solve them: the rules of covol check --for.
namespace covol::tool {

enum class Program { Any, Blender, Houdini, Slicer, Fiji, Print };

/// [m] Clip end and clip start of Blender's default view. Wider or smaller objects get a remark, also without --for.
inline constexpr double kFarClip = 1000, kNearClip = 0.01;

/// Properties of a file that the rules depend on.
struct FileFacts {
    FileKind kind = FileKind::Image;
    std::string ending;  ///< long_ending() of the name: in lower case, with its dot
    std::string unit;    ///< unit of length; empty: the file does not state one
    double extent = 0;   ///< longest side of its box, world units
    // .vdb
    bool has_level_set = false, has_density = false, has_blosc = false;
    double voxel_size = 0;
    // meshes
    bool is_closed = true;
    int crossings = 0;  ///< self-intersections
    double wall = -1;   ///< minimum wall thickness, in the file's unit; < 0: not measured
    // images
    std::string format;  ///< as printed by covol info
    bool is_rotated = false, has_spacing = true, is_big_tiff = false, has_segments = false;
    bool has_display_range = true;  ///< false for labels in an ImageJ TIFF that states no min and max
};

struct Advice {
    bool is_problem = false;  ///< the program cannot open the file, or reads it wrongly; false: a remark
    std::string text, remedy;
};

/// Advice from those rules of program_rules.cpp for this program that apply to the file, in the order of their table.
[[nodiscard]] std::vector<Advice> advice_for(Program program, const FileFacts& facts);

/// The first word of letters and digits after `key` in the first 64 KiB of a file; empty if `key` does not occur. For
/// text headers of meshes and images whose files have been read, and so validated, before.
[[nodiscard]] std::string word_in_header(const std::string& path, const std::string& key);
[[nodiscard]] bool header_holds(const std::string& path, const std::string& text);

}  // namespace covol::tool
