#pragma once
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"

namespace covol {

/// A mark with a name, to be shown in another program.
struct NamedMark {
    Vec3 index{0, 0, 0};  ///< voxels of the image, from 0
    std::string name;
};

/// Writes marks in the format of a marking program, by the file extension; the file is written completely or not at
/// all.
/// - .csv: points of napari: z, y, x in voxels, and a column `name`
/// - .mrk.json: fiducials of 3D Slicer, in LPS
/// - .roi: a multi-point of Fiji, with each mark on the nearest slice, for stacks of one channel; names are not stored
/// @throws Error InvalidOptions (another extension), InvalidInput (for .roi: marks before the image's first voxel),
/// Unsupported (for .roi: more than 65535 marks, or a coordinate above 32766 pixels), Io.
COVOL_API void write_program_marks(const std::string& path, const std::vector<NamedMark>& marks,
                                   const ImageGeometry& geometry);
/// @throws Error InvalidOptions (an extension that write_program_marks() does not know)
COVOL_API void check_program_marks(const std::string& path);
/// The file extensions, for messages.
inline constexpr const char* kProgramMarks = ".csv (napari), .mrk.json (3D Slicer) or .roi (Fiji)";

}  // namespace covol
