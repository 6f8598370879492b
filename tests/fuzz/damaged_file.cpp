#include "damaged_file.h"

#include <openvdb/openvdb.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <vector>

#include "covol/error.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/mesh_io.h"
#include "covol/points.h"
#include "covol/vdb_io.h"

namespace {

namespace fs = std::filesystem;
using covol::Image;

// Reads the first 32^3 voxels of an image, because damaged chunks are detected only when their voxels are read.
void touch(const Image& image) {
    covol::VoxelBox box = image.held();
    for (int a = 0; a < 3; ++a) box.max[a] = std::min(box.max[a], box.min[a] + 31);
    const covol::Index3 size = box.size();
    std::vector<float> values(std::size_t(size[0]) * size[1] * size[2]);
    image.copy(box, values.data());
}

void read_as_image(const std::string& path) {
    (void)covol::read_image_info(path);
    covol::ReadImageOptions first;
    first.channel = first.frame = 0;
    touch(covol::read_image(path, first));
}

void read_as_mesh(const std::string& path) {
    const covol::TriangleMesh mesh = covol::read_mesh(path);
    for (const auto& triangle : mesh.triangles)
        for (const auto vertex : triangle)
            if (std::size_t(vertex) >= mesh.vertices.size()) std::abort();
}

void read_as_points(const std::string& path) {
    const covol::PointCloud cloud = covol::read_points(path);
    for (const covol::MarkLine& line : cloud.lines)
        if (line.begin > line.end || line.end > cloud.points.size()) std::abort();
}

void read_as_level_set(const std::string& path) {
    (void)covol::list_vdb(path);
    (void)covol::read_vdb_level_set(path);
}

void write(const fs::path& path, std::string_view data) {
    std::ofstream(path, std::ios::binary | std::ios::trunc).write(data.data(), std::streamsize(data.size()));
}

using Reader = std::function<void(const std::string&)>;

const std::map<std::string, Reader> kReaders = {
    {"nrrd", read_as_image},        {"mha", read_as_image},          {"nii", read_as_image},
    {"nii.gz", read_as_image},      {"tif", read_as_image},          {"mrc", read_as_image},
    {"ics", read_as_image},         {"npy", read_as_image},          {"h5", read_as_image},
    {"ims", read_as_image},         {"dcm", read_as_image},          {"ply", read_as_mesh},
    {"obj", read_as_mesh},          {"off", read_as_mesh},           {"stl", read_as_mesh},
    {"glb", read_as_mesh},          {"xyz", read_as_points},         {"csv", read_as_points},
    {"roi", read_as_points},        {"zip", read_as_points},         {"las", read_as_points},
    {"pcd", read_as_points},        {"fcsv", read_as_points},        {"mrk.json", read_as_points},
    {"annot", read_as_points},      {"xml", read_as_points},         {"vdb", read_as_level_set},
    {"points.ply", read_as_points}, {"image.vdb", read_as_image},    {"zarr", read_as_image},
    {"zarr3", read_as_image},       {"contours.dcm", read_as_points}};

}  // namespace

DamagedFile::DamagedFile(const std::string& end) {
    const auto reader = kReaders.find(end);
    if (reader == kReaders.end()) throw std::invalid_argument("no reader for '" + end + "'");
    reader_ = reader->second;
    // The file is written very often, so it is in a file system in memory if there is one.
    std::string name =
        (fs::exists("/dev/shm") ? "/dev/shm" : fs::temp_directory_path().string()) + "/covol-fuzz-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for files in " + name);
    folder_ = name;
    file_ = folder_ / ("file." + (end == "points.ply"     ? "ply"
                                  : end == "image.vdb"    ? "vdb"
                                  : end == "contours.dcm" ? "dcm"
                                                          : end));
    if (end == "zarr") part_ = file_ / "0.0.0";
    if (end == "zarr3") part_ = folder_ / "file.zarr/c/0/0/0";
    if (end == "zarr3") file_ = folder_ / "file.zarr";
    if (!part_.empty()) fs::create_directories(part_.parent_path());
    openvdb::initialize();
}

DamagedFile::~DamagedFile() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

void DamagedFile::read(std::string_view bytes) const {
    if (part_.empty()) {
        write(file_, bytes);
    } else {
        const std::size_t end = std::min(bytes.size(), bytes.find('\0'));
        write(file_ / (part_.parent_path() == file_ ? ".zarray" : "zarr.json"), bytes.substr(0, end));
        write(part_, bytes.substr(std::min(bytes.size(), end + 1)));
    }
    try {
        reader_(file_);
    } catch (const covol::Error&) {
    }
}
