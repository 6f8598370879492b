#include "cli/outputs.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "covol/error.h"
#include "covol/image.h"
#include "covol/image_stream.h"
#include "covol/mesh_io.h"

namespace covol::tool {
namespace fs = std::filesystem;
namespace {

std::string lower_extension(const std::string& path) {
    std::string end = fs::path(path).extension().string();
    std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return end;
}

void check_extension(const std::string& path, const std::vector<std::string>& known) {
    if (std::find(known.begin(), known.end(), lower_extension(path)) != known.end()) return;
    std::string list;
    for (const std::string& end : known) list += (list.empty() ? "" : ", ") + end;
    throw Error(Errc::InvalidOptions, path + ": expected a name that ends in " + list);
}

void check_ending(const std::string& path, OutputKind kind) {
    switch (kind) {
        case OutputKind::Vdb: return check_extension(path, {".vdb"});
        case OutputKind::NanoVdb: return check_extension(path, {".nvdb"});
        case OutputKind::Image: return check_image_extension(path);
        case OutputKind::Mesh: return check_mesh_extension(path);
        case OutputKind::Points: return check_extension(path, {".xyz", ".csv", ".ply"});
        case OutputKind::Picture: return check_extension(path, {".png"});
        case OutputKind::Page: return check_extension(path, {".html", ".htm"});
        case OutputKind::Scene: return check_extension(path, {".usda"});
        case OutputKind::Table: return check_extension(path, {".csv"});
        case OutputKind::Text: return;
    }
}

/// Something else than a file lies there, a device or a pipe: a file must not take its place.
bool is_special(const fs::path& path) {
    std::error_code status;
    return fs::exists(path, status) && !fs::is_regular_file(path, status) && !fs::is_directory(path, status);
}

bool is_zarr_name(const fs::path& path) {
    return lower_extension((path.has_filename() ? path : path.parent_path()).string()) == ".zarr";
}

bool lies_in(const fs::path& path, const fs::path& folder) {
    std::error_code status;
    for (fs::path at = fs::absolute(path); at.has_relative_path(); at = at.parent_path())
        if (fs::equivalent(at, folder, status)) return true;
    return false;
}

}  // namespace

void Outputs::check_store(const std::string& flag, const std::string& path, const fs::path& target) const {
    std::error_code status;
    if (!fs::exists(target, status)) return;
    if (!is_zarr_store(target.string()))
        throw Error(Errc::Io, flag + ": " + path +
                                  ": cannot write: something that is no Zarr store is there; choose "
                                  "another name");
    for (const std::string& input : inputs_)
        if (lies_in(input, target))
            throw Error(Errc::InvalidOptions,
                        flag + ": " + path + ": " + input + ", an input of this run, lies in it; choose another name");
}

void Outputs::check(const std::string& flag, const std::string& path, OutputKind kind) {
    if (path.empty()) return;
    try {
        check_ending(path, kind);
    } catch (const Error& error) {
        throw Error(error.code(), flag + ": " + error.what());
    }
    fs::path target = fs::absolute(path).lexically_normal();
    if (target.filename().empty()) target = target.parent_path();
    const fs::path folder = target.parent_path();
    std::error_code status;
    if (is_zarr_name(path))
        check_store(flag, path, target);
    else if (fs::is_directory(target, status))
        throw Error(Errc::Io, flag + ": " + path + ": cannot write: it is a folder");
    if (is_special(target)) {
        if (kind == OutputKind::Text || kind == OutputKind::Table) return;
        throw Error(Errc::Io, flag + ": " + path + ": cannot write: it is not a regular file");
    }
    for (const std::string& input : inputs_)
        if (fs::equivalent(target, input, status))
            throw Error(Errc::InvalidOptions, flag + ": " + path + ": is an input of this run; choose another name");
    if (!fs::is_directory(folder, status))
        throw Error(Errc::Io,
                    flag + ": " + path + ": cannot write: " +
                        (status == std::errc::filename_too_long ? status.message()
                                                                : "the folder " + folder.string() + " does not exist"));
    if (::access(folder.c_str(), W_OK) != 0)
        throw Error(Errc::Io, flag + ": " + path + ": cannot write: no permission to write in " + folder.string());
    if (std::find(checked_.begin(), checked_.end(), target.string()) != checked_.end())
        throw Error(Errc::InvalidOptions, flag + ": " + path + ": another output has the same name");
    checked_.push_back(target.string());
}

void Outputs::add(const std::string& path, std::function<void(const std::string&)> write) {
    if (!path.empty()) pending_.push_back({path, std::move(write)});
}

bool Outputs::write(const std::string& path, const std::function<void(const std::string&)>& write) {
    if (path.empty()) return false;
    files_.write(path, write);  // nothing else is in it before write_queued()
    files_.publish();
    kept_.push_back(path);
    return true;
}

void Outputs::write_queued() {
    for (Pending& output : pending_)
        if (is_special(output.path))
            devices_.push_back(std::move(output));
        else
            files_.write(output.path, output.write);
    pending_.clear();
}

void Outputs::publish() {
    for (const Pending& device : devices_) device.write(device.path);
    devices_.clear();
    written_ = files_.paths();
    files_.publish();
}

void write_text(const std::string& path, const std::string& text) {
    if (!is_special(path)) return write_text_file(path, text);
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw Error(Errc::Io, path + ": cannot write");
}

}  // namespace covol::tool
