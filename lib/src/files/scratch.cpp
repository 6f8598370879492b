#include "files/scratch.h"

#include <sys/file.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <system_error>
#include <vector>

namespace covol::detail {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMagic = "covol scratch folder, format 1\n";
constexpr const char* kAll = "all\n";
constexpr const char* kListed = "listed\n";

std::string read_all(int file) {
    std::string text;
    std::vector<char> piece(1 << 16);
    for (ssize_t got = 0; (got = ::pread(file, piece.data(), piece.size(), off_t(text.size()))) > 0;)
        text.append(piece.data(), std::size_t(got));
    return text;
}

/// The entries of a folder except the lock. Symbolic links are not followed.
std::vector<fs::path> contents(const fs::path& folder) {
    std::vector<fs::path> entries;
    std::error_code status;
    for (fs::directory_iterator at(folder, status), end; !status && at != end; at.increment(status))
        if (at->path().filename() != kScratchLock) entries.push_back(at->path());
    return entries;
}

void remove_lock_and_folder(const fs::path& folder) noexcept {
    ::unlink((folder / kScratchLock).c_str());
    ::rmdir(folder.c_str());
}

}  // namespace

bool is_scratch_name(const std::string& name) {
    const std::string_view prefix = kHiddenPrefix;
    const auto is_letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
    return name.starts_with(prefix) && name.size() == prefix.size() + 6 &&
           std::all_of(name.begin() + std::ptrdiff_t(prefix.size()), name.end(), is_letter);
}

bool is_output_name(const std::string& name) {
    return !name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos &&
           !name.starts_with(kHiddenPrefix);
}

std::string scratch_mark(ino_t folder, bool all) {
    return std::string(kMagic) + std::to_string(folder) + "\n" + (all ? kAll : kListed);
}

AbandonedScratch::AbandonedScratch(const fs::path& folder)
    : folder_(folder), lock_(folder / kScratchLock, O_RDWR | O_NOFOLLOW | O_NONBLOCK), state_(read_state()) {}

AbandonedScratch::State AbandonedScratch::read_state() {
    struct stat own {
    }, lock{};
    if (!is_scratch_name(folder_.filename().string()) || ::lstat(folder_.c_str(), &own) != 0 || !S_ISDIR(own.st_mode) ||
        own.st_uid != ::geteuid())
        return State::Foreign;
    std::error_code status;
    // The process ended before it created the lock.
    if (lock_.get() < 0) return fs::is_empty(folder_, status) && !status ? State::Unstarted : State::Foreign;
    // A file that belongs to this user was created by this user. One with a second link is not accepted, because it may
    // have been created in another folder.
    if (::fstat(lock_.get(), &lock) != 0 || !S_ISREG(lock.st_mode) || lock.st_uid != ::geteuid() || lock.st_nlink != 1)
        return State::Foreign;
    if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0) return State::Alive;
    const std::string text = read_all(lock_.get());
    if (text.empty()) return contents(folder_).empty() ? State::Unstarted : State::Foreign;
    for (const bool all : {true, false}) {
        // The mark contains the scratch folder's inode; in a copy of the folder, it therefore does not match.
        const std::string mark = scratch_mark(own.st_ino, all);
        if (!text.starts_with(mark)) continue;
        names_ = std::string(1, '\0') + text.substr(mark.size());
        all_ = all;
        return State::Dead;
    }
    return State::Foreign;
}

void AbandonedScratch::remove() const {
    const auto is_listed = [&](std::string name) {
        // Writers store parts of a file next to it, with its name and an additional extension.
        for (;; name.erase(name.rfind('.'))) {
            if (names_.find('\0' + name + '\0') != std::string::npos) return true;
            if (name.rfind('.') == std::string::npos) return false;
        }
    };
    std::error_code status;
    bool empty = true;
    for (const fs::path& entry : contents(folder_)) {
        const std::string name = entry.filename().string();
        if (all_ || name.starts_with(kHiddenPrefix) || is_listed(name)) fs::remove_all(entry, status);
        empty = empty && !fs::exists(fs::symlink_status(entry, status));
    }
    if (empty) remove_lock_and_folder(folder_);
}

void remove_scratch(const fs::path& folder) noexcept {
    std::error_code status;
    try {
        for (const fs::path& entry : contents(folder)) fs::remove_all(entry, status);
    } catch (const std::exception&) {
        return;  // the next run clears it
    }
    remove_lock_and_folder(folder);
}

}  // namespace covol::detail
