#include "base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
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

void write_atomically(const std::string& path, const std::function<void(const std::string&)>& write) {
    const fs::path target(path);
    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
    std::error_code status;
    if (!fs::is_directory(folder, status))
        throw Error(Errc::Io, path + ": cannot write: the folder " + folder.string() + " does not exist");
    if (fs::is_directory(target, status)) throw Error(Errc::Io, path + ": cannot write: it is a folder");
    if (fs::exists(target, status) && !fs::is_regular_file(target, status))
        throw Error(Errc::Io, path + ": cannot write: it is not a regular file");
    const std::string temporary =
        (folder / (".covol-" + std::to_string(::getpid()) + "-" + target.filename().string())).string();
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
