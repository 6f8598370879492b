#include "files/atomic.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>

#include "base/file.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "files/output_path.h"

namespace covol::detail {
namespace fs = std::filesystem;
namespace {

/// Makes an empty file next to `target`, with a hidden name that is unpredictable and unique.
std::string new_file_beside(const fs::path& target, mode_t mode) {
    const std::string whole = target.filename().string();
    // Keeps the extension, which writers depend on, but not the whole name, whose length file systems limit.
    constexpr std::size_t kEnd = 32;
    const std::string end = whole.substr(whole.size() - std::min(whole.size(), kEnd));
    std::random_device random;
    for (;;) {
        const fs::path path = target.parent_path() / (".covol-" + std::to_string(random()) + "-" + end);
        const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        if (file >= 0) {
            ::close(file);
            return path.string();
        }
        if (errno != EEXIST) throw Error(Errc::Io, target.string() + ": cannot write: " + std::strerror(errno));
    }
}

/// Calls write(temporary). In messages of its errors, `path` replaces the name of the temporary file or folder.
void write_as(const std::string& path, const std::string& temporary,
              const std::function<void(const std::string&)>& write) {
    try {
        write(temporary);
    } catch (const Error& error) {
        std::string text = error.what();
        std::size_t at = text.find(temporary);
        if (at == std::string::npos) throw;
        for (; at != std::string::npos; at = text.find(temporary, at + path.size()))
            text.replace(at, temporary.size(), path);
        throw Error(error.code(), text, error.option());
    }
}

}  // namespace

void write_folder_atomically(const std::string& path, bool may_replace,
                             const std::function<void(const std::string&)>& write) {
    std::error_code status;
    const fs::path target = path_of_output(path);
    const bool exists = fs::exists(fs::symlink_status(target, status));
    if (exists && (!fs::is_directory(target, status) || !may_replace))
        throw Error(Errc::Io, path + ": cannot write: it exists and must not be replaced; choose another name");
    const ScratchFolder scratch(target.parent_path());
    const std::string temporary = (scratch.path() / target.filename()).string();
    if (!fs::create_directory(temporary, status)) throw Error(Errc::Io, path + ": cannot write: " + status.message());
    write_as(path, temporary, write);
    // All files of the new folder are flushed to the disk before it is renamed.
    const int folder = ::open(temporary.c_str(), O_RDONLY | O_DIRECTORY);
    const bool flushed = folder >= 0 && ::syncfs(folder) == 0;
    const int why = errno;
    if (folder >= 0) ::close(folder);
    if (!flushed) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(why));
    keep_attributes(target, temporary);
    if (exists ? !swap_paths(temporary, target.string()) : std::rename(temporary.c_str(), target.c_str()) != 0)
        throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
}

void write_atomically(const std::string& path, const std::function<void(const std::string&)>& write) {
    const fs::path target = path_of_output(path);
    std::error_code status;
    const bool exists = fs::exists(target, status);
    if (fs::is_directory(target, status)) throw Error(Errc::Io, path + ": cannot write: it is a folder");
    if (exists && !fs::is_regular_file(target, status))
        throw Error(Errc::Io, path + ": cannot write: it is not a regular file");
    // Until keep_attributes(), only this user may read the temporary file, because the old file may be protected.
    const std::string temporary = new_file_beside(target, exists ? 0600 : 0666);
    struct Remover {
        const std::string& name;
        ~Remover() { ::unlink(name.c_str()); }
    } remover{temporary};
    write_as(path, temporary, write);
    const int file = ::open(temporary.c_str(), O_RDONLY);
    const bool flushed = file >= 0 && ::fsync(file) == 0;
    const int why = errno;
    if (file >= 0) ::close(file);
    if (!flushed) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(why));
    keep_attributes(target, temporary);
    if (std::rename(temporary.c_str(), target.c_str()) != 0)
        throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
}

}  // namespace covol::detail
