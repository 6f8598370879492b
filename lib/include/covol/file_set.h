#pragma once
#include <compare>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/run.h"

namespace covol {

/// The location to which the operating system writes an output with a given name.
struct OutputPlace {
    std::filesystem::path path;  ///< absolute, without symbolic links; the file need not exist
    bool is_stream = false;      ///< a stream that a process has open, such as /dev/stdout, which no file can replace
};

/// Resolves folders and links as the operating system does: `link/../a` is beside the folder that `link` points to, and
/// an output whose name is a symbolic link is written to the link's target, whether the target exists or not.
/// @throws Error Io (the folder does not exist, too many links, another user's link in a folder like /tmp).
[[nodiscard]] COVOL_API OutputPlace place_of_output(const std::string& path);

/// Identifies a file or folder independently of its path. 0, 0: there is none.
struct FileId {
    std::uint64_t device = 0;
    std::uint64_t inode = 0;
    auto operator<=>(const FileId&) const = default;
};

/// The identity of the file or folder that is opened at the path: symbolic links are followed.
[[nodiscard]] COVOL_API FileId file_id(const std::filesystem::path& path);

/// Opens a regular file for reading. Other files, such as named pipes, are not opened, because opening them may block
/// forever; the returned stream is then in the failed state.
[[nodiscard]] COVOL_API std::ifstream open_regular_file(const std::string& path);

/// Waits until no other program holds the lock on the folder that FileSet::publish() will need.
/// @throws Error Io (still locked after a minute), Cancelled.
COVOL_API void wait_for_folder(const std::filesystem::path& folder, const RunContext& run = {});

/// A hidden folder, `.covol-XXXXXX`, that the destructor of this object removes.
///
/// The folder is locked during the object's lifetime. The constructor first clears scratch folders that killed
/// processes left in the same place: if FileSet::publish() was interrupted, it is completed, in other folders too, and
/// everything else that covol made is removed. Only folders with exactly such a name are changed, and only if they are
/// empty or contain covol's own marker, made for this folder by this user.
class COVOL_API ScratchFolder {
public:
    /// What the next run removes if this process is killed: the whole scratch folder, or only the names in it that were
    /// given to list().
    enum class Clears { All, Listed };
    /// @param beside  the folder in which the scratch folder is made
    /// @throws Error Io (another program locks that folder for more than a minute), Cancelled.
    explicit ScratchFolder(const std::filesystem::path& beside, const RunContext& run = {},
                           Clears clears = Clears::All);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    /// For Clears::Listed: registers the name of a file or folder that will be created in the scratch folder. @throws
    /// Error Io.
    void list(const std::string& name);
    /// Excludes this folder from remove_all(), so that the next run finds it and can complete an interrupted publish().
    void keep_for_next_run() noexcept;

    /// Removes all scratch folders of this process; for a process that ends without calling destructors, for example
    /// because memory is exhausted.
    static void remove_all() noexcept;

private:
    std::filesystem::path path_;
    int lock_ = -1;
};

/// Files, and folders such as Zarr stores, that belong together: each is written into a ScratchFolder beside its final
/// path, then all are moved to their final paths, or none of them is. Until publish(), existing files stay unchanged.
class COVOL_API FileSet {
public:
    FileSet();
    ~FileSet();
    FileSet(const FileSet&) = delete;
    FileSet& operator=(const FileSet&) = delete;

    /// Calls `write`, which has to create the file under a temporary path with the same file name.
    /// @throws Error Io, Cancelled; whatever `write` throws; in the message of an Error, the temporary path is replaced
    /// by `path`.
    void write(const std::string& path, const std::function<void(const std::string& temporary)>& write,
               const RunContext& run = {});

    /// Moves all written files to their final paths; existing files are replaced, and their permissions and owner are
    /// kept. The set is empty afterwards. If a step fails, the previous files are restored. If the process is killed
    /// during publish(), the next ScratchFolder in any folder of the set completes it in all folders.
    /// @throws Error Io (a folder that another program locks for more than a minute), Cancelled: existing files are
    ///     untouched.
    void publish(const RunContext& run = {});

    /// The text with temporary paths replaced by the final ones, for messages about the files.
    [[nodiscard]] std::string shown(std::string text) const;

    /// The paths that publish() would write, in the order of writing.
    [[nodiscard]] std::vector<std::string> paths() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Writes a text file either completely or not at all. @throws Error Io.
COVOL_API void write_text_file(const std::string& path, const std::string& text);

}  // namespace covol
