#pragma once
#include <string>

#include "covol/api.h"

namespace covol {

enum class FileKind { Vdb, Image, Mesh, Points };

/// By the file extension ("FILE.vdb:name" is Vdb); PLY, OBJ and OFF are meshes if they contain a face, else points.
/// @throws Error Io, InvalidInput if such a file cannot be read.
[[nodiscard]] COVOL_API FileKind kind_of_file(const std::string& path);

/// By the name alone; PLY, OBJ and OFF are points if `like` is Points, else meshes.
[[nodiscard]] COVOL_API FileKind kind_of_output(const std::string& path, FileKind like);

/// Whether write_image() writes files of this name.
[[nodiscard]] COVOL_API bool is_image_name(const std::string& path);

/// .nvdb: written for viewers, never read.
[[nodiscard]] COVOL_API bool is_nanovdb_name(const std::string& path);

/// The extension of a file or a folder, in lower case and with its dot; compound ones are returned whole: ".nii.gz",
/// ".seg.nrrd", ".ome.tif", ".ome.tiff", ".ome.zarr".
[[nodiscard]] COVOL_API std::string long_ending(const std::string& path);

/// Whether it is the name of a segmentation of 3D Slicer or of DICOM, whose label values have names.
[[nodiscard]] COVOL_API bool is_segmentation_name(const std::string& path);

/// "vdb", "image", "mesh", "points"
[[nodiscard]] COVOL_API const char* to_string(FileKind kind);

}  // namespace covol
