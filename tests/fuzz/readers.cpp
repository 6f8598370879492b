// Each reader under a fuzzer that is guided by coverage (clang's libFuzzer): tests/fuzz/run.sh builds and runs it.
//
// COVOL_FUZZ_FORMAT says how the file's name ends, and thereby which reader gets it. A covol::Error of any kind is an
// answer; everything else that is thrown, and whatever a sanitizer finds, is a finding.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <string_view>
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

// A damaged chunk is found when its first voxel is asked for.
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

struct Format {
    std::function<void(const std::string&)> read;
    std::string name;  // of the file
    std::string part;  // not empty: what follows the first NUL goes into this file of the same folder
};

Format format_of(const std::string& end) {
    static const std::map<std::string, void (*)(const std::string&)> kReaders = {
        {"nrrd", read_as_image},   {"mha", read_as_image},   {"nii", read_as_image},       {"nii.gz", read_as_image},
        {"tif", read_as_image},    {"mrc", read_as_image},   {"npy", read_as_image},       {"h5", read_as_image},
        {"ims", read_as_image},    {"dcm", read_as_image},   {"ply", read_as_mesh},        {"obj", read_as_mesh},
        {"off", read_as_mesh},     {"stl", read_as_mesh},    {"glb", read_as_mesh},        {"xyz", read_as_points},
        {"csv", read_as_points},   {"roi", read_as_points},  {"zip", read_as_points},      {"las", read_as_points},
        {"pcd", read_as_points},   {"fcsv", read_as_points}, {"mrk.json", read_as_points}, {"annot", read_as_points},
        {"vdb", read_as_level_set}};
    if (end == "points.ply") return {read_as_points, "file.ply", ""};
    if (end == "image.vdb") return {read_as_image, "file.vdb", ""};
    if (end == "zarr")
        return {[](const std::string& path) { read_as_image(fs::path(path).parent_path()); }, ".zarray", "0.0.0"};
    if (end == "zarr3")
        return {[](const std::string& path) { read_as_image(fs::path(path).parent_path()); }, "zarr.json", "c/0/0/0"};
    const auto reader = kReaders.find(end);
    if (reader == kReaders.end()) {
        std::fprintf(stderr, "COVOL_FUZZ_FORMAT: no reader for '%s'\n", end.c_str());
        std::exit(2);
    }
    return {reader->second, "file." + end, ""};
}

struct Target {
    Format format;
    fs::path folder;
    Target() {
        const char* end = std::getenv("COVOL_FUZZ_FORMAT");
        format = format_of(end != nullptr ? end : "");
        // In memory where the system has such a folder.
        std::string name =
            (fs::exists("/dev/shm") ? "/dev/shm" : fs::temp_directory_path().string()) + "/covol-fuzz-XXXXXX";
        if (mkdtemp(name.data()) == nullptr) std::exit(2);
        folder = name;
        folder /= "x.zarr";
        fs::create_directories((folder / (format.part.empty() ? "part" : format.part)).parent_path());
        openvdb::initialize();
    }
    ~Target() { fs::remove_all(folder.parent_path()); }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Target target;
    const std::string_view whole(reinterpret_cast<const char*>(data), size);
    const fs::path path = target.folder / target.format.name;
    const std::size_t end = target.format.part.empty() ? size : std::min(size, whole.find('\0'));
    write(path, whole.substr(0, end));
    if (!target.format.part.empty()) write(target.folder / target.format.part, whole.substr(std::min(size, end + 1)));
    try {
        target.format.read(path);
    } catch (const covol::Error&) {
    }
    return 0;
}
