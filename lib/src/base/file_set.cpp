#include "covol/file_set.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "base/file.h"
#include "covol/error.h"

namespace covol {
namespace fs = std::filesystem;
namespace {

constexpr const char* kPrefix = ".covol-";
// No output has these names.
constexpr const char* kManifest = ".covol-publish";
constexpr const char* kLock = ".covol-lock";

[[noreturn]] void fail(const fs::path& path, int why) {
    throw Error(Errc::Io, path.string() + ": cannot write: " + std::strerror(why));
}

class Descriptor {
public:
    Descriptor(const fs::path& path, int flags) : file_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int get() const noexcept { return file_; }
    /// Gives the descriptor away.
    int release() noexcept { return std::exchange(file_, -1); }
    void close() {
        if (file_ >= 0) ::close(release());
    }

private:
    int file_;
};

/// What libraries do not say of a write that failed.
std::string why_no_room(const std::string& said) {
    const int why = errno;
    if (why != ENOSPC && why != EDQUOT && why != EFBIG) return {};
    const std::string text = std::strerror(why);
    return said.find(text) == std::string::npos ? ": " + text : std::string();
}

void flush_folder(const fs::path& folder) {
    const Descriptor file(folder, O_RDONLY | O_DIRECTORY);
    if (file.get() >= 0) ::fsync(file.get());
}

/// What lies at `from` takes the place of `to`, and the other way round where something was there.
bool exchange(const fs::path& from, const fs::path& to) {
    std::error_code status;
    if (!fs::exists(fs::symlink_status(to, status))) return ::rename(from.c_str(), to.c_str()) == 0;
    return detail::swap_paths(from.string(), to.string());
}

bool is_newer(const fs::path& path, const fs::path& than) {
    std::error_code status;
    const auto time = fs::last_write_time(path, status);
    if (status) return false;  // not there
    return time > fs::last_write_time(than, status) || status;
}

/// 0: nothing is there.
ino_t inode_of(const fs::path& path) {
    struct stat entry {};
    return ::lstat(path.c_str(), &entry) == 0 ? entry.st_ino : 0;
}

/// What FileSet::publish() is about to do: inode and name of each file. Where another inode has the name in the scratch
/// folder, the file is in its place already, and that is what it replaced.
std::string manifest_line(const fs::path& temporary) {
    return std::to_string(inode_of(temporary)) + " " + temporary.filename().string() + '\0';
}

/// Puts in place what a process left that was killed in FileSet::publish().
void finish_publishing(const fs::path& scratch) {
    const fs::path manifest = scratch / kManifest;
    std::ifstream file(manifest, std::ios::binary);
    for (std::string line; std::getline(file, line, '\0');) {
        const fs::path name = line.substr(std::min(line.find(' '), line.size() - 1) + 1);
        if (name.empty() || name != name.filename()) continue;
        const fs::path temporary = scratch / name, target = scratch.parent_path() / name;
        // What was put there since is not ours to replace.
        if (manifest_line(temporary) == line + '\0' && !is_newer(target, manifest))
            static_cast<void>(exchange(temporary, target));
    }
}

/// Clears what dead processes left in `folder`. @pre the folder is locked
void clear_after_the_dead(const fs::path& folder) {
    std::error_code status;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, status)) {
        if (!entry.path().filename().string().starts_with(kPrefix) || !entry.is_directory(status)) continue;
        struct stat owner {};
        if (::lstat(entry.path().c_str(), &owner) != 0 || !S_ISDIR(owner.st_mode) || owner.st_uid != ::geteuid())
            continue;
        // Without a lock it was made by a process that died at once.
        const Descriptor lock(entry.path() / kLock, O_RDWR | O_NOFOLLOW);
        if (lock.get() >= 0 && ::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) continue;
        finish_publishing(entry.path());
        fs::remove_all(entry.path(), status);
    }
}

/// Those of this process.
struct Living {
    std::mutex mutex;
    std::set<fs::path> folders;
};
Living& living() {
    static Living all;
    return all;
}

}  // namespace

void ScratchFolder::remove_all() noexcept {
    const std::lock_guard lock(living().mutex);
    std::error_code ignored;
    for (const fs::path& folder : living().folders) fs::remove_all(folder, ignored);
}

ScratchFolder::ScratchFolder(const fs::path& beside) {
    const fs::path folder = fs::absolute(beside.empty() ? fs::path(".") : beside);
    Descriptor parent(folder, O_RDONLY | O_DIRECTORY);
    if (parent.get() < 0) fail(folder, errno);
    // One process at a time, so that none takes a folder for a dead one's that is made but not yet locked. Where a file
    // system has no such locks nothing is cleared.
    const bool locked = ::flock(parent.get(), LOCK_EX) == 0;
    if (locked) clear_after_the_dead(folder);
    std::string name = (folder / (std::string(kPrefix) + "XXXXXX")).string();
    if (::mkdtemp(name.data()) == nullptr) fail(folder, errno);
    path_ = name;
    {
        const std::lock_guard own(living().mutex);
        living().folders.insert(path_);
    }
    Descriptor own(path_ / kLock, O_RDWR | O_CREAT | O_EXCL);
    if (own.get() >= 0 && ::flock(own.get(), LOCK_EX | LOCK_NB) == 0) lock_ = own.release();
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    {
        const std::lock_guard lock(living().mutex);
        living().folders.erase(path_);
    }
    if (lock_ >= 0) ::close(lock_);
}

struct FileSet::State {
    struct File {
        std::string path;  ///< as it was given
        fs::path target, temporary;
    };
    std::map<fs::path, ScratchFolder> folders;
    std::vector<File> files;
    File writing;
    /// Puts back what was there before the first `count` files took its place.
    void put_back(std::size_t count) {
        std::error_code status;
        while (count-- > 0) {
            const File& file = files[count];
            if (fs::exists(fs::symlink_status(file.temporary, status)))
                static_cast<void>(exchange(file.temporary, file.target));
            else
                static_cast<void>(::rename(file.target.c_str(), file.temporary.c_str()));
        }
    }
};

FileSet::FileSet() : state_(std::make_unique<State>()) {}
FileSet::~FileSet() = default;

void FileSet::write(const std::string& path, const std::function<void(const std::string&)>& write) {
    fs::path target = fs::absolute(detail::without_end_slash(path)).lexically_normal();
    const fs::path folder = target.parent_path();
    const fs::path scratch = state_->folders.try_emplace(folder, folder).first->second.path();
    const fs::path temporary = scratch / target.filename();
    state_->writing = {path, target, temporary};
    errno = 0;
    try {
        write(temporary.string());
    } catch (const Error& error) {
        throw Error(error.code(), shown(error.what()) + why_no_room(error.what()));
    }
    std::error_code status;
    if (fs::exists(target, status) && fs::is_directory(target, status) != fs::is_directory(temporary, status))
        throw Error(Errc::Io, path + ": cannot write: something of another kind is there");
    state_->files.push_back({path, std::move(target), temporary});
}

void FileSet::publish() {
    std::vector<State::File>& files = state_->files;
    // Of two runs that end at the same time with the same outputs, one set after the other; the folders have an order.
    std::vector<std::unique_ptr<Descriptor>> one_at_a_time;
    for (const auto& [folder, scratch] : state_->folders) {
        one_at_a_time.push_back(std::make_unique<Descriptor>(folder, O_RDONLY | O_DIRECTORY));
        ::flock(one_at_a_time.back()->get(), LOCK_EX);
    }
    for (const auto& [folder, scratch] : state_->folders) {
        std::string names;
        for (const State::File& file : files)
            if (file.target.parent_path() == folder) names += manifest_line(file.temporary);
        write_text_file((scratch.path() / kManifest).string(), names);
        flush_folder(scratch.path());
    }
    for (std::size_t n = 0; n < files.size(); ++n)
        if (!exchange(files[n].temporary, files[n].target)) {
            const int why = errno;
            const std::string path = files[n].path;
            for (const auto& [folder, scratch] : state_->folders) ::unlink((scratch.path() / kManifest).c_str());
            state_->put_back(n);
            fail(path, why);
        }
    for (const auto& [folder, scratch] : state_->folders) {
        flush_folder(folder);
        // What was replaced goes with the folder, and no one is to put it back.
        ::unlink((scratch.path() / kManifest).c_str());
    }
    files.clear();
    state_->folders.clear();
}

std::string FileSet::shown(std::string text) const {
    const std::string temporary = state_->writing.temporary.string();
    if (temporary.empty()) return text;
    for (std::size_t at = 0; (at = text.find(temporary, at)) != std::string::npos; at += state_->writing.path.size())
        text.replace(at, temporary.size(), state_->writing.path);
    return text;
}

std::vector<std::string> FileSet::paths() const {
    std::vector<std::string> paths;
    for (const State::File& file : state_->files) paths.push_back(file.path);
    return paths;
}

void write_text_file(const std::string& path, const std::string& text) {
    detail::write_atomically(path, [&](const std::string& temporary) {
        std::ofstream file(temporary, std::ios::binary);
        file << text;
        file.close();
        if (!file) fail(path, errno);
    });
}

}  // namespace covol
