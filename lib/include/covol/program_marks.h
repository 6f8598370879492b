#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"

namespace covol {

/// A mark for the user to look at.
struct NamedMark {
    Vec3 index{0, 0, 0};  ///< voxels of the image, from 0
    std::string name;
};

/// Writes marks in the format of the program in which people mark, by the file extension; completely or not at all.
/// - .csv: points of napari, z, y, x in voxels, with a column `name`
/// - .mrk.json: fiducials of 3D Slicer, in LPS
/// - .roi: a multi-point of Fiji, each on the nearest slice, for stacks of one channel; it cannot store names
/// @throws Error InvalidOptions (another extension), InvalidInput (for .roi: voxels before the image's first), Io.
COVOL_API void write_program_marks(const std::string& path, const std::vector<NamedMark>& marks,
                                   const ImageGeometry& geometry);
/// @throws Error InvalidOptions (an extension that write_program_marks() does not know)
COVOL_API void check_program_marks(const std::string& path);
/// The file extensions, for messages.
inline constexpr const char* kProgramMarks = ".csv (napari), .mrk.json (3D Slicer) or .roi (Fiji)";

}  // namespace covol
