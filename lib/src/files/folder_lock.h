#pragma once
#include <chrono>
#include <filesystem>

#include "covol/run.h"
#include "files/descriptor.h"

namespace covol::detail {

/// How long a run waits for a folder that another program has locked: longer than covol itself ever holds such a lock.
constexpr std::chrono::milliseconds kLockPatience{60000};

/// An open folder, with an advisory lock (flock) if the file system supports it.
class FolderLock {
public:
    /// Waits while another program holds the lock; after a second the run's log reports which. @throws Error Io (no
    /// folder; locked for longer than `patience`), Cancelled.
    explicit FolderLock(const std::filesystem::path& folder, const RunContext& run = {},
                        std::chrono::milliseconds patience = kLockPatience);
    /// Whether the folder is locked: false if the file system does not support such locks.
    [[nodiscard]] bool is_locked() const noexcept { return locked_; }
    [[nodiscard]] FileId id() const { return id_of(file_.get()); }

private:
    Descriptor file_;
    bool locked_ = false;
};

}  // namespace covol::detail
