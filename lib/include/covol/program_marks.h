#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"

namespace covol {

/// A mark for a person to look at.
struct NamedMark {
    Vec3 index{0, 0, 0};  ///< voxels of the image, from 0
    std::string name;
};

/// Writes marks for the program that people mark in, by the name's end; whole or not at all.
/// - .csv: points of napari, z, y, x in voxels, with a column `name`
/// - .mrk.json: fiducials of 3D Slicer, in LPS
/// - .roi: a multi-point of Fiji, of the nearest slice each, for stacks of one channel; it has no place for names
/// @throws Error InvalidOptions (another ending), InvalidInput (for .roi: voxels before the image's first), Io.
COVOL_API void write_program_marks(const std::string& path, const std::vector<NamedMark>& marks,
                                   const ImageGeometry& geometry);
/// @throws Error InvalidOptions (an ending that write_program_marks() does not know)
COVOL_API void check_program_marks(const std::string& path);
/// The endings, for messages.
inline constexpr const char* kProgramMarks = ".csv (napari), .mrk.json (3D Slicer) or .roi (Fiji)";

}  // namespace covol
