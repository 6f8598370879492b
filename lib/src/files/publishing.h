#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "covol/run.h"
#include "files/descriptor.h"

// How files of several folders are put in place together (FileSet::publish()), and how the next run goes on where a
// process was killed meanwhile.
//
// Each scratch folder gets a manifest: the set's number, all scratch folders of the set, and inode and name of each
// file that it will put in place. Then one file in the first of them, the commit, says that the set is to be completed.
// Before that file is there the outputs are the old ones, and what was written is thrown away; after that each folder's
// files are put in place, by whoever comes next to any of the folders. In one folder the manifest is the commit. A
// manifest only ever speaks of files in its own scratch folder and the folder around it: of the others it says where
// they are, and these have manifests of their own, in folders of this user with a lock that this process could take.
namespace covol::detail {

struct ScratchPlace {
    std::filesystem::path path;
    ino_t inode = 0,
          folder = 0;  ///< its own, and that of the folder around it: devices have other numbers after a start
};

/// A file as it is now. 0, 0: there is none.
struct Stamp {
    ino_t inode = 0;
    std::int64_t changed = 0;  ///< its contents, nanoseconds
    bool operator==(const Stamp&) const = default;
    [[nodiscard]] std::string text() const { return std::to_string(inode) + " " + std::to_string(changed); }
};
[[nodiscard]] Stamp stamp_of(const std::filesystem::path& path);

struct Manifest {
    std::string set;                      ///< a random number
    std::vector<ScratchPlace> scratches;  ///< the first has the commit
    struct File {
        Stamp made, replaced;  ///< the new file, and what it is to replace; with its name in the folder around,
                               ///< `made` is in its place, and another than these two was put there since
        std::string name;
    };
    std::vector<File> files;
};

enum class Fate { Complete, PutBack };

[[nodiscard]] std::string new_set_number();

/// @throws Error Io.
void write_manifest(const std::filesystem::path& scratch, const Manifest& manifest);
/// From here on the set is to be completed, or put back. @throws Error Io.
void write_commit(const std::filesystem::path& first, const std::string& set, Fate fate);

/// What lies at `from` takes the place of `to`, and the other way round where something was there.
bool exchange(const std::filesystem::path& from, const std::filesystem::path& to);
/// Undoes exchange().
bool exchange_back(const std::filesystem::path& from, const std::filesystem::path& to);

/// Clears what dead processes left in a folder. @pre the folder is locked by the caller
void clear_after_the_dead(const std::filesystem::path& folder, const RunContext& run);

}  // namespace covol::detail
