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

/// Where the system puts an output of some name.
struct OutputPlace {
    std::filesystem::path path;  ///< absolute, without symbolic links; the file need not be there
    bool is_stream = false;      ///< a stream that a process has open, as /dev/stdout: nothing can take its place
};

/// Follows folders and links as the system does: `link/../a` lies beside the folder that the link points to, and an
/// output that is a symbolic link goes to the file that the link points to, there or not.
/// @throws Error Io (the folder does not exist, too many links, another user's link in a folder like /tmp).
[[nodiscard]] COVOL_API OutputPlace place_of_output(const std::string& path);

/// Opens a regular file to be read. A named pipe, which may wait for its other end for ever, and anything else is not
/// opened: the stream has failed then.
[[nodiscard]] COVOL_API std::ifstream open_regular_file(const std::string& path);

/// Waits until no other program has a lock on the folder, as FileSet::publish() will need it.
/// @throws Error Io (still locked after a minute), Cancelled.
COVOL_API void wait_for_folder(const std::filesystem::path& folder, const RunContext& run = {});

/// A hidden folder, `.covol-XXXXXX`, that is gone with this object.
///
/// While it lives it is locked. Those that a process left beside it which was killed are cleared first: files that
/// FileSet::publish() had begun to put in place are put there, in other folders too, and what else covol made is
/// removed. Only folders of exactly such a name are touched that have covol's own mark in them, made for this folder by
/// this user, or that are empty.
class COVOL_API ScratchFolder {
public:
    /// What the next run removes where this process is killed.
    enum class Clears { All, Listed };
    /// @param beside  the folder to make it in @throws Error Io (another program locks that folder for more than a
    /// minute), Cancelled.
    explicit ScratchFolder(const std::filesystem::path& beside, const RunContext& run = {},
                           Clears clears = Clears::All);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    /// For Clears::Listed: a file or folder of this name will be in it. @throws Error Io.
    void list(const std::string& name);
    /// remove_all() leaves it from here on.
    void keep_for_next_run() noexcept;

    /// Removes those of this process, for one that ends without destroying them, of want of memory say.
    static void remove_all() noexcept;

private:
    std::filesystem::path path_;
    int lock_ = -1;
};

/// Files, and folders such as Zarr stores, that belong together: written into a ScratchFolder in the folder of each,
/// then put in place all at once, or not at all. Until publish() what was there before stays as it is.
class COVOL_API FileSet {
public:
    FileSet();
    ~FileSet();
    FileSet(const FileSet&) = delete;
    FileSet& operator=(const FileSet&) = delete;

    /// Lets `write` make the file under a temporary path that has the same name.
    /// @throws Error Io, Cancelled; what `write` throws, an Error's text with the path in place of the temporary one.
    void write(const std::string& path, const std::function<void(const std::string& temporary)>& write,
               const RunContext& run = {});

    /// Puts all that was written in place of what is there, with the permissions and the owner that it had; the set is
    /// empty after. Where that fails half way, what was there is put back. Where the process is killed half way, the
    /// next ScratchFolder in any folder of the set completes it in all of them.
    /// @throws Error Io (a folder that another program locks for more than a minute), Cancelled: what was there is
    /// untouched.
    void publish(const RunContext& run = {});

    /// A text with the paths that were given in place of the temporary ones: what a writer says of its file.
    [[nodiscard]] std::string shown(std::string text) const;

    /// What publish() would put in place, in the order of writing.
    [[nodiscard]] std::vector<std::string> paths() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Writes a text, whole or not at all. @throws Error Io.
COVOL_API void write_text_file(const std::string& path, const std::string& text);

}  // namespace covol
