#include "cli/output/outputs.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstring>
#include <filesystem>
#include <thread>

#include "covol/error.h"
#include "covol/image.h"
#include "covol/image_files.h"
#include "covol/image_stream.h"
#include "covol/mesh_io.h"
#include "covol/program_marks.h"

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
        case OutputKind::StructureSet: return check_extension(path, {".dcm"});
        case OutputKind::ProgramMarks: return check_program_marks(path);
        case OutputKind::Text: return;
    }
}

/// Whether the path is a device, a pipe or a stream, which must not be replaced by a file.
bool is_special(const OutputPlace& place) {
    std::error_code status;
    return place.is_stream || (fs::exists(place.path, status) && !fs::is_regular_file(place.path, status) &&
                               !fs::is_directory(place.path, status));
}

bool is_special(const std::string& path) {
    std::error_code status;
    // A path that does not exist or cannot be examined is not special; errors are reported when the file is written.
    return fs::exists(path, status) && is_special(place_of_output(path));
}

bool is_zarr_name(const fs::path& path) {
    return lower_extension((path.has_filename() ? path : path.parent_path()).string()) == ".zarr";
}

bool lies_in(const fs::path& path, const fs::path& folder) {
    std::error_code status;
    for (fs::path at = fs::weakly_canonical(path, status); at.has_relative_path(); at = at.parent_path())
        if (fs::equivalent(at, folder, status)) return true;
    return false;
}

/// Whether the file may be a header that refers to files in any folder.
bool may_refer_elsewhere(const std::string& path) {
    const std::string end = lower_extension(path);
    return end == ".nhdr" || end == ".nrrd" || end == ".mhd" || end == ".mha";
}

/// Opens a device, pipe or stream without blocking. A pipe without a reader is tried repeatedly until one opens it.
int open_special(const std::string& path, const RunContext& run) {
    const OutputPlace place = place_of_output(path);
    std::error_code status;
    // A stream of this process is duplicated, so that writing continues at the stream's position, even if it is a file.
    if (place.is_stream && place.path.parent_path() == fs::canonical("/proc/self/fd", status))
        return ::dup(std::stoi(place.path.filename().string()));
    constexpr std::chrono::milliseconds kPause{20}, kUntilReported{1000};
    const auto begin = std::chrono::steady_clock::now();
    bool reported = false;
    for (;;) {
        const int file = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
        if (file >= 0 || (errno != ENXIO && errno != EINTR)) return file;
        struct stat entry {};
        if (::stat(path.c_str(), &entry) != 0 || !S_ISFIFO(entry.st_mode)) {
            errno = ENXIO;
            return -1;
        }
        run.check();
        if (!reported && std::chrono::steady_clock::now() - begin > kUntilReported) {
            run.info(path + ": waiting for a program that reads this pipe");
            reported = true;
        }
        std::this_thread::sleep_for(kPause);
    }
}

}  // namespace

void Outputs::check_store(const std::string& flag, const std::string& path, const fs::path& target) {
    std::error_code status;
    if (!fs::exists(target, status)) return;
    if (!is_zarr_store(target.string()))
        throw Error(Errc::Io, flag + ": " + path +
                                  ": cannot write: it exists and is not a Zarr store; choose "
                                  "another name");
    for (Input& input : inputs_) {
        std::vector<File> files = may_refer_elsewhere(input.path) ? files_of(input, {}) : std::vector<File>{};
        files.push_back(input);
        for (const File& file : files)
            if (lies_in(file.path, target))
                throw Error(Errc::InvalidOptions, flag + ": " + path + ": " + file.path +
                                                      ", an input of this run, lies in it; choose another name");
    }
}

void Outputs::protect(const std::vector<std::string>& inputs) {
    std::error_code status;
    for (const std::string& path : inputs) {
        if (!protected_.insert(path).second) continue;
        const fs::path folder = fs::is_directory(path, status) ? fs::path(path) : fs::absolute(path).parent_path();
        inputs_.push_back({{path, file_id(path)}, file_id(folder), {}});
        if (is_zarr_name(path)) stores_.push_back(path);
    }
}

const std::vector<Outputs::File>& Outputs::files_of(Input& input, const FileId& folder) {
    static const std::vector<File> none;
    if (!may_refer_elsewhere(input.path) && input.folder != folder) return none;
    if (!input.refers_to) {
        input.refers_to.emplace();
        try {
            for (const std::string& path : list_image_files(input.path))
                input.refers_to->push_back({path, file_id(path)});
        } catch (const Error& error) {
            // The input is not an image, or it is one that cannot be read; this error is reported when it is read.
            if (error.code() == Errc::Cancelled) throw;
        }
    }
    return *input.refers_to;
}

void Outputs::check_inputs(const std::string& flag, const std::string& path, const fs::path& target) {
    const auto refuse = [&](const std::string& why) {
        throw Error(Errc::InvalidOptions, flag + ": " + path + ": " + why + "; choose another name");
    };
    std::error_code status;
    // Only a file that exists can be an input. Each output is compared with each input, of which there can be
    // thousands: the inputs' files are therefore examined once.
    if (const FileId id = file_id(target); id != FileId{}) {
        const FileId folder = file_id(target.parent_path());
        for (Input& input : inputs_) {
            if (input.id == id) refuse("is an input of this run");
            for (const File& file : files_of(input, folder))
                if (file.id == id) refuse("belongs to " + input.path + ", an input of this run");
        }
    }
    for (const std::string& store : stores_)
        if (fs::is_directory(store, status) && lies_in(target, store))
            refuse("lies in " + store + ", an input of this run");
}

void Outputs::check(const std::string& flag, const std::string& path, OutputKind kind) {
    if (path.empty()) return;
    OutputPlace place;
    try {
        check_ending(path, kind);
        place = place_of_output(path);
    } catch (const Error& error) {
        throw Error(error.code(), flag + ": " + error.what());
    }
    const fs::path target = place.path, folder = target.parent_path();
    std::error_code status;
    if (is_special(place)) {
        if (kind == OutputKind::Text || kind == OutputKind::Table) return;
        throw Error(Errc::Io, flag + ": " + path + ": cannot write: it is not a regular file");
    }
    if (is_zarr_name(path))
        check_store(flag, path, target);
    else if (fs::is_directory(target, status))
        throw Error(Errc::Io, flag + ": " + path + ": cannot write: it is a folder");
    check_inputs(flag, path, target);
    if (::access(folder.c_str(), W_OK) != 0)
        throw Error(Errc::Io, flag + ": " + path + ": cannot write: no permission to write in " + folder.string());
    // Another program may hold the lock on the folder. Waiting for it before the computation, and failing if it is not
    // released, avoids a failure after the computation.
    wait_for_folder(folder, run_);
    if (std::find(checked_.begin(), checked_.end(), target.string()) != checked_.end())
        throw Error(Errc::InvalidOptions, flag + ": " + path + ": another output has the same name");
    checked_.push_back(target.string());
}

void Outputs::add(const std::string& path, std::function<void(const std::string&)> write) {
    if (!path.empty()) pending_.push_back({path, std::move(write)});
}

bool Outputs::write(const std::string& path, const std::function<void(const std::string&)>& write) {
    if (path.empty()) return false;
    check_inputs("output", path, place_of_output(path).path);
    files_.write(path, write, run_);
    files_.publish(run_);  // publishes only this file: write_queued() adds the queued ones later
    kept_.push_back(path);
    return true;
}

void Outputs::write_queued() {
    for (Pending& output : pending_)
        if (is_special(output.path)) {
            devices_.push_back(std::move(output));
        } else {
            // check() compared the path with the inputs known at that time; protect() may have added others since.
            check_inputs("output", output.path, place_of_output(output.path).path);
            files_.write(output.path, output.write, run_);
        }
    pending_.clear();
}

void Outputs::publish() {
    for (const Pending& device : devices_) device.write(device.path);
    devices_.clear();
    written_ = files_.paths();
    files_.publish(run_);
}

void write_stream(int stream, const std::string& text, const std::string& name, const RunContext& run) {
    for (std::size_t done = 0; done < text.size();) {
        pollfd ready{stream, POLLOUT, 0};
        constexpr int kPause = 50;                          // milliseconds
        const bool waits = ::poll(&ready, 1, kPause) <= 0;  // the stream is not ready yet, or a signal arrived
        run.check();
        if (waits) continue;
        // At most PIPE_BUF bytes are written, which a pipe that is ready accepts without blocking.
        const ssize_t wrote = ::write(stream, text.data() + done, std::min<std::size_t>(text.size() - done, PIPE_BUF));
        if (wrote < 0 && errno != EINTR && errno != EAGAIN)
            throw Error(Errc::Io, name + ": cannot write: " + std::strerror(errno));
        done += std::size_t(std::max<ssize_t>(wrote, 0));
    }
}

void write_text(const std::string& path, const std::string& text, const RunContext& run) {
    if (!is_special(path)) return write_text_file(path, text);
    const int stream = open_special(path, run);
    if (stream < 0) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
    struct Closer {
        int stream;
        ~Closer() { ::close(stream); }
    } closer{stream};
    write_stream(stream, text, path, run);
}

}  // namespace covol::tool
