#include "files/output_path.h"

#include <sys/stat.h>
#include <sys/vfs.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "base/file.h"
#include "covol/error.h"

namespace covol {
namespace fs = std::filesystem;
namespace {

constexpr const char* kAccessList = "system.posix_acl_access";

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw Error(Errc::Io, path + ": cannot write: " + why);
}

/// The folder in which the system would create `at`, without symbolic links.
fs::path real_folder(const fs::path& at, const std::string& given) {
    const fs::path folder = at.has_parent_path() ? at.parent_path() : fs::path(".");
    std::error_code status;
    fs::path real = fs::canonical(folder, status);
    if (status == std::errc::no_such_file_or_directory || status == std::errc::not_a_directory ||
        (!status && !fs::is_directory(real, status)))
        refuse(given, "the folder " + folder.string() + " does not exist");
    if (status) refuse(given, status.message());
    return real;
}

bool is_in_proc(const fs::path& folder) {
    constexpr decltype(std::declval<struct statfs>().f_type) kProc = 0x9fa0;
    struct statfs system {};
    return ::statfs(folder.c_str(), &system) == 0 && system.f_type == kProc;
}

/// In a folder that everyone may write to, such as /tmp, another user's link is not followed, which is also the
/// kernel's rule (fs.protected_symlinks).
void require_own_link(const fs::path& folder, const struct stat& link, const std::string& given) {
    struct stat around {};
    if (::stat(folder.c_str(), &around) != 0) return;
    const bool for_all = (around.st_mode & S_ISVTX) != 0 && (around.st_mode & S_IWOTH) != 0;
    if (for_all && link.st_uid != ::geteuid() && link.st_uid != around.st_uid)
        refuse(given, "it is another user's symbolic link in a folder that everyone may write to");
}

}  // namespace

OutputPlace place_of_output(const std::string& path) {
    constexpr int kMaxLinks = 40;  // the kernel's limit
    fs::path at = path;
    for (int links = 0; links <= kMaxLinks; ++links) {
        at = detail::without_end_slash(at.string());
        const fs::path folder = real_folder(at, path), name = at.filename();
        if (name.empty() || name == "." || name == "..") return {fs::canonical(at), false};
        at = folder / name;
        struct stat entry {};
        if (::lstat(at.c_str(), &entry) != 0 && errno == ENAMETOOLONG) refuse(path, std::strerror(errno));
        if (!S_ISLNK(entry.st_mode)) return {at, false};
        if (is_in_proc(folder)) return {at, true};
        require_own_link(folder, entry, path);
        std::error_code status;
        at = folder / fs::read_symlink(at, status);
        if (status) refuse(path, status.message());
    }
    refuse(path, std::strerror(ELOOP));
}

FileId file_id(const fs::path& path) {
    struct stat entry {};
    return ::stat(path.c_str(), &entry) == 0 ? FileId{entry.st_dev, entry.st_ino} : FileId{};
}

namespace detail {

fs::path path_of_output(const std::string& path) {
    OutputPlace place = place_of_output(path);
    if (place.is_stream) refuse(path, "expected the name of a file, got a stream");
    return std::move(place.path);
}

void keep_attributes(const fs::path& replaced, const fs::path& made) {
    struct stat old {
    }, now{};
    if (::lstat(replaced.c_str(), &old) != 0 || ::lstat(made.c_str(), &now) != 0) return;
    if ((old.st_mode & S_IFMT) != (now.st_mode & S_IFMT) || (!S_ISREG(old.st_mode) && !S_ISDIR(old.st_mode))) return;
    constexpr auto kSame = static_cast<uid_t>(-1);
    if (old.st_uid != now.st_uid) static_cast<void>(!::lchown(made.c_str(), old.st_uid, kSame));
    bool as_before = old.st_gid == now.st_gid || ::lchown(made.c_str(), kSame, old.st_gid) == 0;
    if (const ssize_t size = ::getxattr(replaced.c_str(), kAccessList, nullptr, 0); size > 0) {
        std::vector<char> list(static_cast<std::size_t>(size));
        as_before = ::getxattr(replaced.c_str(), kAccessList, list.data(), list.size()) == size &&
                    ::setxattr(made.c_str(), kAccessList, list.data(), list.size(), 0) == 0 && as_before;
    } else {
        ::removexattr(made.c_str(), kAccessList);  // an access list inherited from the folder
    }
    mode_t mode = old.st_mode & (S_ISDIR(old.st_mode) ? 07777 : 0777);
    if (!as_before) mode &= ~mode_t(S_IRWXG) | ((mode & S_IRWXO) << 3);
    static_cast<void>(!::chmod(made.c_str(), mode));
}

}  // namespace detail
}  // namespace covol
