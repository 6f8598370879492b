#pragma once
#include <string>

#include "covol/api.h"

namespace covol {

enum class FileKind { Vdb, Image, Mesh, Points };

/// The kind of a file by its extension ("FILE.vdb:name" is Vdb); PLY, OBJ and OFF are meshes if they contain a face,
/// else points.
/// @throws Error Io, InvalidInput if a PLY, OBJ or OFF file cannot be read.
[[nodiscard]] COVOL_API FileKind kind_of_file(const std::string& path);

/// The kind of a file to be written, by its name alone; PLY, OBJ and OFF are points if `like` is Points, else meshes.
[[nodiscard]] COVOL_API FileKind kind_of_output(const std::string& path, FileKind like);

/// Whether write_image() can write a file with this name.
[[nodiscard]] COVOL_API bool is_image_name(const std::string& path);

/// Whether the extension is .nvdb. covol writes such files for viewers, but does not read them.
[[nodiscard]] COVOL_API bool is_nanovdb_name(const std::string& path);

/// The extension of a file or a folder, in lower case and with its dot; compound ones are returned whole: ".nii.gz",
/// ".seg.nrrd", ".ome.tif", ".ome.tiff", ".ome.zarr".
[[nodiscard]] COVOL_API std::string long_ending(const std::string& path);

/// Whether a file with this name is a segmentation of 3D Slicer or DICOM, in which label values have names.
[[nodiscard]] COVOL_API bool is_segmentation_name(const std::string& path);

/// "vdb", "image", "mesh", "points"
[[nodiscard]] COVOL_API const char* to_string(FileKind kind);

}  // namespace covol
