#pragma once
#include <chrono>
#include <filesystem>

#include "covol/run.h"
#include "files/descriptor.h"

namespace covol::detail {

/// How long a run waits for a folder that another program has locked: longer than any covol holds such a lock.
constexpr std::chrono::milliseconds kLockPatience{60000};

/// A folder that is open, with its advisory lock (flock) where the file system has such locks.
class FolderLock {
public:
    /// Waits while another program has the lock; after a second the run's log says which.
    /// @throws Error Io (no folder; locked for longer than `patience`), Cancelled.
    explicit FolderLock(const std::filesystem::path& folder, const RunContext& run = {},
                        std::chrono::milliseconds patience = kLockPatience);
    /// False where the file system has no such locks.
    [[nodiscard]] bool is_locked() const noexcept { return locked_; }
    [[nodiscard]] FileId id() const { return id_of(file_.get()); }

private:
    Descriptor file_;
    bool locked_ = false;
};

}  // namespace covol::detail
