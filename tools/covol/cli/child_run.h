#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "covol/file_set.h"
#include "covol/run.h"

// Another run of this program within this one.
namespace covol::tool {

/// A ScratchFolder that is removed even where this process is killed: by a process that does nothing else. The next
/// run that writes beside it clears it where that one is killed, too.
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
    int keeper_ = 0, pipe_ = -1;
};

/// Runs this program with these words, and waits. It ends when this process does, however that ends. To be called by
/// the thread that ends last. @return exit code @throws Error Io, Cancelled.
[[nodiscard]] int run_this_program(const std::vector<std::string>& words, const RunContext& run);

}  // namespace covol::tool
