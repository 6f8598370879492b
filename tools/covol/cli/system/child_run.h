#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "covol/file_set.h"
#include "covol/run.h"

// Runs this program as a child process.
namespace covol::tool {

/// A ScratchFolder that is removed even if this process is killed, by a child process that only waits for this. If the
/// child process is killed, too, the next run that writes beside the folder removes it.
class KeptFolder {
public:
    /// @throws Error Io.
    explicit KeptFolder(const std::filesystem::path& beside);
    ~KeptFolder();
    KeptFolder(const KeptFolder&) = delete;
    KeptFolder& operator=(const KeptFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return folder_->path(); }

private:
    std::optional<ScratchFolder> folder_;
    int cleaner_pid_ = 0, pipe_ = -1;
};

/// Runs this program with these arguments and waits for it. The child is killed if the calling thread ends before it,
/// so it does not outlive this process. @return exit code @throws Error Io, Cancelled.
[[nodiscard]] int run_this_program(const std::vector<std::string>& words, const RunContext& run);

}  // namespace covol::tool
