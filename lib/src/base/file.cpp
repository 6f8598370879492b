#include "base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "covol/error.h"

namespace covol::detail {
namespace fs = std::filesystem;

std::string extension(const std::string& path) {
    std::string name = fs::path(path).filename().string();
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    std::string end = fs::path(name).extension().string();
    if (end == ".gz") end = fs::path(name).stem().extension().string() + end;
    return end;
}

std::string without_end_slash(const std::string& path) {
    std::string text = path;
    while (text.size() > 1 && text.back() == '/') text.pop_back();
    return text;
}

namespace {

/// A hidden name beside `target`. @throws Error Io when its folder does not exist.
std::string name_beside(const fs::path& target) {
    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
    std::error_code status;
    if (!fs::is_directory(folder, status))
        throw Error(Errc::Io, target.string() + ": cannot write: the folder " + folder.string() + " does not exist");
    return (folder / (".covol-" + std::to_string(::getpid()) + "-" + target.filename().string())).string();
}

/// Puts the folder `temporary` in the place of `path`; what was there is at `temporary` after.
bool swap_folders(const std::string& temporary, const std::string& path) {
    if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path.c_str(), RENAME_EXCHANGE) == 0) return true;
    if (errno != EINVAL && errno != ENOSYS) return false;
    // A file system that cannot exchange them: for a moment none is there.
    const std::string old = temporary + ".old";
    if (std::rename(path.c_str(), old.c_str()) != 0) return false;
    if (std::rename(temporary.c_str(), path.c_str()) == 0) return std::rename(old.c_str(), temporary.c_str()) == 0;
    const int why = errno;
    static_cast<void>(std::rename(old.c_str(), path.c_str()));
    errno = why;
    return false;
}

}  // namespace

void write_folder_atomically(const std::string& path, bool may_replace,
                             const std::function<void(const std::string&)>& write) {
    const std::string temporary = name_beside(path);
    std::error_code status;
    const bool exists = fs::exists(fs::symlink_status(path, status));
    if (exists && (!fs::is_directory(path, status) || fs::is_symlink(path, status) || !may_replace))
        throw Error(Errc::Io, path + ": cannot write: something else is there, and not replaced; choose another name");
    fs::remove_all(temporary, status);
    struct Remover {
        const std::string& name;
        ~Remover() {
            std::error_code ignored;
            fs::remove_all(name, ignored);
        }
    } remover{temporary};
    if (!fs::create_directory(temporary, status)) throw Error(Errc::Io, path + ": cannot write: " + status.message());
    write(temporary);
    // All files of it reach the disk before its name does.
    const int folder = ::open(temporary.c_str(), O_RDONLY | O_DIRECTORY);
    const bool flushed = folder >= 0 && ::syncfs(folder) == 0;
    const int why = errno;
    if (folder >= 0) ::close(folder);
    if (!flushed) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(why));
    if (exists ? !swap_folders(temporary, path) : std::rename(temporary.c_str(), path.c_str()) != 0)
        throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
}

void write_atomically(const std::string& path, const std::function<void(const std::string&)>& write) {
    const fs::path target(path);
    const std::string temporary = name_beside(target);
    std::error_code status;
    if (fs::is_directory(target, status)) throw Error(Errc::Io, path + ": cannot write: it is a folder");
    if (fs::exists(target, status) && !fs::is_regular_file(target, status))
        throw Error(Errc::Io, path + ": cannot write: it is not a regular file");
    struct Remover {
        const std::string& name;
        ~Remover() { ::unlink(name.c_str()); }
    } remover{temporary};
    write(temporary);
    const int file = ::open(temporary.c_str(), O_RDONLY);
    const bool flushed = file >= 0 && ::fsync(file) == 0;
    const int why = errno;
    if (file >= 0) ::close(file);
    if (!flushed) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(why));
    if (std::rename(temporary.c_str(), path.c_str()) != 0)
        throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
}

}  // namespace covol::detail
