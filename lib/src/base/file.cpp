#include "base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>

#include "base/files/output_path.h"
#include "covol/error.h"
#include "covol/file_set.h"

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

bool swap_paths(const std::string& one, const std::string& other) {
    if (::renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE) == 0) return true;
    if (errno != EINVAL && errno != ENOSYS) return false;
    const std::string aside = one + ".old";
    if (std::rename(other.c_str(), aside.c_str()) != 0) return false;
    if (std::rename(one.c_str(), other.c_str()) == 0) return std::rename(aside.c_str(), one.c_str()) == 0;
    const int why = errno;
    static_cast<void>(std::rename(aside.c_str(), other.c_str()));
    errno = why;
    return false;
}

namespace {

/// Makes an empty file beside `target`, with a hidden name that nobody can foresee, and that no one else has.
std::string new_file_beside(const fs::path& target, mode_t mode) {
    const std::string whole = target.filename().string();
    // The ending, that writers go by; a name may be as long as the file system allows.
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

}  // namespace

void write_folder_atomically(const std::string& path, bool may_replace,
                             const std::function<void(const std::string&)>& write) {
    std::error_code status;
    const fs::path target = path_of_output(path);
    const bool exists = fs::exists(fs::symlink_status(target, status));
    if (exists && (!fs::is_directory(target, status) || !may_replace))
        throw Error(Errc::Io, path + ": cannot write: something else is there, and not replaced; choose another name");
    const ScratchFolder scratch(target.parent_path());
    const std::string temporary = (scratch.path() / target.filename()).string();
    if (!fs::create_directory(temporary, status)) throw Error(Errc::Io, path + ": cannot write: " + status.message());
    write(temporary);
    keep_attributes(target, temporary);
    // All files of it reach the disk before its name does.
    const int folder = ::open(temporary.c_str(), O_RDONLY | O_DIRECTORY);
    const bool flushed = folder >= 0 && ::syncfs(folder) == 0;
    const int why = errno;
    if (folder >= 0) ::close(folder);
    if (!flushed) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(why));
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
    // What only some may read is for none but this user meanwhile.
    const std::string temporary = new_file_beside(target, exists ? 0600 : 0666);
    struct Remover {
        const std::string& name;
        ~Remover() { ::unlink(name.c_str()); }
    } remover{temporary};
    write(temporary);
    keep_attributes(target, temporary);
    const int file = ::open(temporary.c_str(), O_RDONLY);
    const bool flushed = file >= 0 && ::fsync(file) == 0;
    const int why = errno;
    if (file >= 0) ::close(file);
    if (!flushed) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(why));
    if (std::rename(temporary.c_str(), target.c_str()) != 0)
        throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
}

}  // namespace covol::detail
