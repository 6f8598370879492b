#pragma once
#include <filesystem>
#include <string>

#include "files/descriptor.h"

// What a ScratchFolder is on the disk, so that the next run knows one that a dead process left.
namespace covol::detail {

/// Both ".covol-XXXXXX" and the files that covol itself keeps in there begin so; no output does.
constexpr const char* kHiddenPrefix = ".covol-";
constexpr const char* kScratchLock = ".covol-lock";
constexpr const char* kManifest = ".covol-publish";
constexpr const char* kCommit = ".covol-commit";

/// Six letters or digits, as mkdtemp() makes them, behind the prefix.
[[nodiscard]] bool is_scratch_name(const std::string& name);

/// A single name, none that covol keeps for itself.
[[nodiscard]] bool is_output_name(const std::string& name);

/// What a scratch folder's lock begins with.
[[nodiscard]] std::string scratch_mark(ino_t folder, bool all);

/// The lock of a scratch folder: a file that begins with scratch_mark(), of this user, with the names behind it that
/// may be removed.
class DeadScratch {
public:
    enum class State {
        Foreign,    ///< none of covol's, or not this user's
        Unstarted,  ///< nothing is in it but an empty lock, or nothing at all
        Alive,      ///< its process has the lock
        Dead        ///< its process is gone
    };
    explicit DeadScratch(const std::filesystem::path& folder);
    [[nodiscard]] State state() const noexcept { return state_; }
    /// Removes what its process made, and the folder, if nothing else is in it. @pre Unstarted or Dead
    void remove() const;

private:
    [[nodiscard]] State read_state();

    std::filesystem::path folder_;
    Descriptor lock_;
    std::string names_;  ///< each with a zero behind it
    bool all_ = false;
    State state_;
};

/// The lock goes last, so that a folder is known for what it is wherever this is cut short.
void remove_scratch(const std::filesystem::path& folder) noexcept;

}  // namespace covol::detail
