#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>

#include "covol/error.h"
#include "covol/file_set.h"
#include "files/folder_lock.h"
#include "files/publishing.h"
#include "files/scratch.h"

namespace covol {
namespace fs = std::filesystem;
namespace {

/// The scratch folders of this process.
struct Living {
    std::mutex mutex;
    std::set<fs::path> folders;
};
Living& living() {
    static Living all;
    return all;
}

bool write_all(int file, const std::string& text) {
    for (std::size_t done = 0; done < text.size();) {
        const ssize_t wrote = ::write(file, text.data() + done, text.size() - done);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) return false;
        done += std::size_t(wrote);
    }
    return true;
}

[[noreturn]] void fail(const fs::path& path, int why) {
    throw Error(Errc::Io, path.string() + ": cannot write: " + std::strerror(why));
}

}  // namespace

std::ifstream open_regular_file(const std::string& path) {
    struct stat entry {};
    const detail::Descriptor file(path, O_RDONLY | O_NONBLOCK);
    if (file.get() >= 0 && ::fstat(file.get(), &entry) == 0 && S_ISREG(entry.st_mode))
        return std::ifstream(path, std::ios::binary);
    std::ifstream failed;
    failed.setstate(std::ios::failbit);
    return failed;
}

void wait_for_folder(const fs::path& folder, const RunContext& run) {
    const detail::FolderLock until_free(folder, run);
}

void ScratchFolder::remove_all() noexcept {
    const std::lock_guard lock(living().mutex);
    for (const fs::path& folder : living().folders) detail::remove_scratch(folder);
}

ScratchFolder::ScratchFolder(const fs::path& beside, const RunContext& run, Clears clears) {
    const fs::path folder = fs::absolute(beside.empty() ? fs::path(".") : beside);
    // One process at a time, so that none mistakes a folder that is created but not yet locked for an abandoned one. If
    // a file system does not support such locks, nothing is cleared.
    const detail::FolderLock one_at_a_time(folder, run);
    if (one_at_a_time.is_locked()) detail::clear_abandoned(folder, run);
    std::string name = (folder / (std::string(detail::kHiddenPrefix) + "XXXXXX")).string();
    if (::mkdtemp(name.data()) == nullptr) fail(folder, errno);
    path_ = name;
    {
        const std::lock_guard own(living().mutex);
        living().folders.insert(path_);
    }
    detail::Descriptor lock(path_ / detail::kScratchLock, O_WRONLY | O_CREAT | O_EXCL | O_APPEND);
    if (lock.get() >= 0) static_cast<void>(::flock(lock.get(), LOCK_EX | LOCK_NB));
    if (lock.get() < 0 ||
        !write_all(lock.get(), detail::scratch_mark(detail::id_of_entry(path_).inode, clears == Clears::All))) {
        const int why = errno;
        keep_for_next_run();
        detail::remove_scratch(path_);
        fail(folder, why);
    }
    lock_ = lock.release();
}

ScratchFolder::~ScratchFolder() {
    detail::remove_scratch(path_);
    keep_for_next_run();
    ::close(lock_);
}

void ScratchFolder::list(const std::string& name) {
    if (!write_all(lock_, name + '\0')) fail(path_.parent_path(), errno);
}

void ScratchFolder::keep_for_next_run() noexcept {
    const std::lock_guard lock(living().mutex);
    living().folders.erase(path_);
}

}  // namespace covol
