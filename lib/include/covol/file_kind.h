#pragma once
#include <string>

#include "covol/api.h"

namespace covol {

enum class FileKind { Vdb, Image, Mesh, Points };

/// By the name's end ("FILE.vdb:name" is Vdb); PLY, OBJ and OFF are meshes when they hold a face, else points.
/// @throws Error Io, InvalidInput when such a file cannot be read.
[[nodiscard]] COVOL_API FileKind kind_of_file(const std::string& path);

/// By the name alone; PLY, OBJ and OFF are what `like` is when that is points, else meshes.
[[nodiscard]] COVOL_API FileKind kind_of_output(const std::string& path, FileKind like);

/// What write_image() writes.
[[nodiscard]] COVOL_API bool is_image_name(const std::string& path);

/// .nvdb: written for viewers, never read.
[[nodiscard]] COVOL_API bool is_nanovdb_name(const std::string& path);

/// Of the name of a file or a folder, in lower case and with its dot; those of two parts are whole: ".nii.gz",
/// ".seg.nrrd", ".ome.tif", ".ome.tiff", ".ome.zarr".
[[nodiscard]] COVOL_API std::string long_ending(const std::string& path);

/// Segmentations of 3D Slicer and of DICOM, whose label values have names.
[[nodiscard]] COVOL_API bool is_segmentation_name(const std::string& path);

/// "vdb", "image", "mesh", "points"
[[nodiscard]] COVOL_API const char* to_string(FileKind kind);

}  // namespace covol
