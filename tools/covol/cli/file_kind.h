#pragma once
#include <string>

namespace covol::tool {

enum class FileKind { Vdb, Image, Mesh, Points };

/// By the name's end ("FILE.vdb:name" is Vdb); PLY, OBJ and OFF are meshes when they hold a face, else points.
/// @throws Error Io, InvalidInput when such a file cannot be read.
[[nodiscard]] FileKind kind_of_file(const std::string& path);

/// By the name alone; PLY, OBJ and OFF are what `like` is when that is points, else meshes.
[[nodiscard]] FileKind kind_of_output(const std::string& path, FileKind like);

/// What write_image() writes.
[[nodiscard]] bool is_image_name(const std::string& path);

/// .nvdb: written for viewers, never read.
[[nodiscard]] bool is_nanovdb_name(const std::string& path);

/// Of the name of a file or a folder, in lower case and with its dot; those of two parts are whole: ".nii.gz",
/// ".seg.nrrd", ".ome.tif", ".ome.tiff", ".ome.zarr".
[[nodiscard]] std::string long_ending(const std::string& path);

/// 3D Slicer's segmentations, whose label values have names.
[[nodiscard]] bool is_segmentation_name(const std::string& path);

/// "vdb", "image", "mesh", "points"
[[nodiscard]] const char* to_string(FileKind kind);

}  // namespace covol::tool
