#pragma once
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "covol/file_set.h"

namespace covol::detail {

/// An open file or folder.
class Descriptor {
public:
    Descriptor(const std::filesystem::path& path, int flags, mode_t mode = 0666)
        : file_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
    Descriptor(Descriptor&& other) noexcept : file_(other.release()) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int get() const noexcept { return file_; }
    /// Gives up ownership of the descriptor.
    int release() noexcept { return std::exchange(file_, -1); }
    void close() {
        if (file_ >= 0) ::close(release());
    }

private:
    int file_;
};

/// The identity of the entry at the path itself, without following a symbolic link as file_id() does.
inline FileId id_of_entry(const std::filesystem::path& path) {
    struct stat entry {};
    return ::lstat(path.c_str(), &entry) == 0 ? FileId{entry.st_dev, entry.st_ino} : FileId{};
}

inline FileId id_of(int file) {
    struct stat entry {};
    return ::fstat(file, &entry) == 0 ? FileId{entry.st_dev, entry.st_ino} : FileId{};
}

inline void flush_folder(const std::filesystem::path& folder) {
    const Descriptor file(folder, O_RDONLY | O_DIRECTORY);
    if (file.get() >= 0) ::fsync(file.get());
}

}  // namespace covol::detail
