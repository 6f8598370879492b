#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "covol/run.h"
#include "files/descriptor.h"

// How files in several folders are put in place together (FileSet::publish()), and how the next run continues if a
// process was killed meanwhile.
//
// Each scratch folder gets a manifest: the set's number, all scratch folders of the set, and inode and name of each
// file that it will put in place. Then a file in the first of them, the commit, states that the set is to be completed.
// Until that file exists, the outputs are the old ones, and the new ones are discarded; afterwards each folder's files
// are put in place by the next run that uses any of the folders. If there is only one folder, the manifest is also the
// commit. A manifest refers only to files in its own scratch folder and the parent of that. Of the other scratch
// folders it states only paths and inodes: these have manifests of their own, and are accepted only if they belong to
// this user and if this process can lock them.
namespace covol::detail {

struct ScratchPlace {
    std::filesystem::path path;
    /// Inodes of the scratch folder and of its parent. Device numbers are not stored, because they may change after a
    /// reboot.
    ino_t inode = 0, folder = 0;
};

/// The current state of a file. 0, 0: there is none.
struct Stamp {
    ino_t inode = 0;
    std::int64_t changed = 0;  ///< time of the last change of its contents, in nanoseconds
    bool operator==(const Stamp&) const = default;
    [[nodiscard]] std::string text() const { return std::to_string(inode) + " " + std::to_string(changed); }
};
[[nodiscard]] Stamp stamp_of(const std::filesystem::path& path);

struct Manifest {
    std::string set;                      ///< a random number
    std::vector<ScratchPlace> scratches;  ///< the first contains the commit
    struct File {
        /// The new file, and the one that it replaces. If the file `name` in the folder of the outputs is `made`, the
        /// new file is in place; if it is neither of the two, another process has put it there since.
        Stamp made, replaced;
        std::string name;
    };
    std::vector<File> files;
};

enum class SetOutcome { Complete, PutBack };

[[nodiscard]] std::string new_set_id();

/// @throws Error Io.
void write_manifest(const std::filesystem::path& scratch, const Manifest& manifest);
/// Records in the set's first scratch folder that the set is to be completed, or undone. @throws Error Io.
void write_commit(const std::filesystem::path& first, const std::string& set, SetOutcome fate);

/// Exchanges the files at `from` and `to`, or moves `from` if there is none at `to`. @returns whether that succeeded
bool exchange(const std::filesystem::path& from, const std::filesystem::path& to);
/// Undoes exchange(). @returns whether that succeeded
bool exchange_back(const std::filesystem::path& from, const std::filesystem::path& to);

/// Completes or removes what terminated processes left in a folder. @pre the folder is locked by the caller
void clear_abandoned(const std::filesystem::path& folder, const RunContext& run);

}  // namespace covol::detail
