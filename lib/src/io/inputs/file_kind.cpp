#include "covol/file_kind.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

#include "covol/error.h"
#include "covol/image.h"
#include "covol/mesh_io.h"
#include "covol/points.h"
#include "covol/vdb_io.h"
#include "files/dicom_class.h"

namespace covol {
namespace {

std::string ending_of(const std::string& path) {
    std::string end = std::filesystem::path(path).extension().string();
    std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return end;
}

template <std::size_t N>
bool is_one_of(const std::string& end, const std::array<std::string_view, N>& list) {
    return std::find(list.begin(), list.end(), end) != list.end();
}

constexpr std::array<std::string_view, 18> kPointEndings{".xyz",   ".csv", ".tsv",       ".txt",  ".pts",  ".asc",
                                                         ".roi",   ".zip", ".xml",       ".json", ".fcsv", ".csl",
                                                         ".annot", ".lmk", ".landmarks", ".pcd",  ".las",  ".ptx"};
constexpr std::array<std::string_view, 2> kMeshEndings{".stl", ".glb"};
constexpr std::array<std::string_view, 3> kSharedEndings{".ply", ".obj", ".off"};

/// Whether a file in a format for both meshes and points holds triangles. If the file can be read neither as a mesh nor
/// as points, the error of the mesh reader is thrown.
bool holds_triangles(const std::string& path) {
    try {
        return !read_mesh(path).empty();
    } catch (const Error& error) {
        if (error.code() != Errc::InvalidInput) throw;
        try {
            (void)read_points(path);
        } catch (const Error&) {
            throw error;
        }
        return false;
    }
}

}  // namespace

FileKind kind_of_file(const std::string& path) {
    const std::string end = ending_of(split_grid_name(path).path);
    if (end == ".vdb") return FileKind::Vdb;
    if (end == ".nvdb")
        throw Error(Errc::Unsupported,
                    path + ": NanoVDB files are for viewers and are not read; give the .vdb instead");
    if (is_one_of(end, kPointEndings) || end == ".laz")
        return FileKind::Points;  // LAZ is not supported; the reader of points reports this
    if (end == ".dcm" && detail::dicom_class(path) == detail::kRtStructureSet) return FileKind::Points;
    if (is_one_of(end, kMeshEndings)) return FileKind::Mesh;
    if (is_one_of(end, kSharedEndings)) return holds_triangles(path) ? FileKind::Mesh : FileKind::Points;
    return FileKind::Image;
}

FileKind kind_of_output(const std::string& path, FileKind like) {
    const std::string end = ending_of(path);
    if (end == ".vdb" || end == ".nvdb") return FileKind::Vdb;
    if (is_one_of(end, kPointEndings)) return FileKind::Points;
    if (is_one_of(end, kMeshEndings)) return FileKind::Mesh;
    if (is_one_of(end, kSharedEndings)) return like == FileKind::Points ? FileKind::Points : FileKind::Mesh;
    return FileKind::Image;
}

bool is_nanovdb_name(const std::string& path) { return ending_of(path) == ".nvdb"; }

bool is_image_name(const std::string& path) {
    try {
        check_image_extension(path);
    } catch (const Error&) {
        return false;
    }
    return true;
}

std::string long_ending(const std::string& path) {
    const std::filesystem::path whole(path);
    std::string name = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    for (const char* end : {".nii.gz", ".seg.nrrd", ".ome.tif", ".ome.tiff", ".ome.zarr"})
        if (name.size() > std::string_view(end).size() && name.ends_with(end)) return end;
    return std::filesystem::path(name).extension().string();
}

bool is_segmentation_name(const std::string& path) {
    return long_ending(path) == ".seg.nrrd" || long_ending(path) == ".dcm";
}

const char* to_string(FileKind kind) {
    switch (kind) {
        case FileKind::Vdb: return "vdb";
        case FileKind::Image: return "image";
        case FileKind::Mesh: return "mesh";
        case FileKind::Points: break;
    }
    return "points";
}

}  // namespace covol
