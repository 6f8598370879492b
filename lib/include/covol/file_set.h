#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// A hidden folder, `.covol-XXXXXX`, that is gone with this object.
///
/// While it lives it is locked. Those that a process left beside it which was killed are cleared first: files that
/// FileSet::publish() had begun to put in place are put there, all others are removed.
class COVOL_API ScratchFolder {
public:
    /// @param beside  the folder to make it in @throws Error Io.
    explicit ScratchFolder(const std::filesystem::path& beside);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

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
    /// @throws Error Io; what `write` throws, an Error's text with the path in place of the temporary one.
    void write(const std::string& path, const std::function<void(const std::string& temporary)>& write);

    /// Puts all that was written in place of what is there; the set is empty after. Where that fails half way, what was
    /// there is put back. Where the process is killed half way, the next ScratchFolder in this folder goes on.
    /// @throws Error Io.
    void publish();

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
