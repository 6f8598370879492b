#include "base/file.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>

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

}  // namespace covol::detail
