#pragma once
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/run.h"

namespace covol {

/// The location to which the system writes an output of some name.
struct OutputPlace {
    std::filesystem::path path;  ///< absolute, without symbolic links; the file need not exist
    bool is_stream = false;      ///< a stream that a process has open, such as /dev/stdout: no file can replace it
};

/// Resolves folders and links as the system does: `link/../a` lies beside the folder that the link points to, and an
/// output that is a symbolic link goes to the file that the link points to, whether that exists or not.
/// @throws Error Io (the folder does not exist, too many links, another user's link in a folder like /tmp).
[[nodiscard]] COVOL_API OutputPlace place_of_output(const std::string& path);

/// Opens a regular file for reading. Anything else is not opened, such as a named pipe, which may wait forever for its
/// other end: the returned stream has then failed.
[[nodiscard]] COVOL_API std::ifstream open_regular_file(const std::string& path);

/// Waits until no other program holds a lock on the folder, because FileSet::publish() will need it.
/// @throws Error Io (still locked after a minute), Cancelled.
COVOL_API void wait_for_folder(const std::filesystem::path& folder, const RunContext& run = {});

/// A hidden folder, `.covol-XXXXXX`, that is removed together with this object.
///
/// It is locked during its lifetime. Folders beside it that were left behind by a killed process are cleared first:
/// files that FileSet::publish() had begun to put in place are completed, in other folders too, and everything else
/// that covol made is removed. Only folders with exactly such a name are touched, and only if they are empty or contain
/// covol's own marker, made for this folder by this user.
class COVOL_API ScratchFolder {
public:
    /// What the next run removes if this process is killed.
    enum class Clears { All, Listed };
    /// @param beside  the folder in which it is made
    /// @throws Error Io (another program locks that folder for more than a minute), Cancelled.
    explicit ScratchFolder(const std::filesystem::path& beside, const RunContext& run = {},
                           Clears clears = Clears::All);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    /// For Clears::Listed: registers a file or folder that will be created in it under this name. @throws Error Io.
    void list(const std::string& name);
    /// Excludes it from remove_all() from now on.
    void keep_for_next_run() noexcept;

    /// Removes all scratch folders of this process, for one that ends without destroying them, for example for lack of
    /// memory.
    static void remove_all() noexcept;

private:
    std::filesystem::path path_;
    int lock_ = -1;
};

/// Files, and folders such as Zarr stores, that belong together: each is written into a ScratchFolder in its folder,
/// then all are put in place at once, or not at all. Until publish(), existing files stay unchanged.
class COVOL_API FileSet {
public:
    FileSet();
    ~FileSet();
    FileSet(const FileSet&) = delete;
    FileSet& operator=(const FileSet&) = delete;

    /// Calls `write` to make the file under a temporary path with the same file name.
    /// @throws Error Io, Cancelled; whatever `write` throws, with the path in place of the temporary one in an Error's
    ///     text.
    void write(const std::string& path, const std::function<void(const std::string& temporary)>& write,
               const RunContext& run = {});

    /// Replaces existing files by all that were written, keeping the permissions and the owner of the former; the set
    /// is empty afterwards. If that fails half way, the previous files are restored. If the process is killed half way,
    /// the next ScratchFolder in any folder of the set completes it in all of them.
    /// @throws Error Io (a folder that another program locks for more than a minute), Cancelled: existing files are
    ///     untouched.
    void publish(const RunContext& run = {});

    /// The text with the given paths in place of the temporary ones: for messages of writers about their files.
    [[nodiscard]] std::string shown(std::string text) const;

    /// The paths that publish() would write, in the order of writing.
    [[nodiscard]] std::vector<std::string> paths() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Writes a text file, completely or not at all. @throws Error Io.
COVOL_API void write_text_file(const std::string& path, const std::string& text);

}  // namespace covol
