#include "covol/file_set.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <utility>

#include "covol/error.h"
#include "files/atomic.h"
#include "files/folder_lock.h"
#include "files/output_path.h"
#include "files/publishing.h"
#include "files/scratch.h"

namespace covol {
namespace fs = std::filesystem;
namespace {

/// The reason of a failed write, which libraries do not report, if the disk is full, or a quota or the maximum size of
/// a file is exceeded. Empty for other reasons, and if `message` already contains the reason.
std::string disk_full_reason(const std::string& message) {
    const int why = errno;
    if (why != ENOSPC && why != EDQUOT && why != EFBIG) return {};
    const std::string text = std::strerror(why);
    return message.find(text) == std::string::npos ? ": " + text : std::string();
}

struct Folder {
    Folder(const fs::path& folder, const RunContext& run)
        : path(folder), scratch(folder, run, ScratchFolder::Clears::Listed) {}
    fs::path path;
    ScratchFolder scratch;
};

}  // namespace

struct FileSet::State {
    struct File {
        std::string path;  ///< path as given by the caller
        fs::path target, temporary;
    };
    /// Sorted by their identities, so that all processes lock folders in the same order and none waits for another that
    /// waits for it.
    std::map<FileId, Folder> folders;
    std::vector<File> files;
    File writing;

    [[nodiscard]] std::vector<std::unique_ptr<detail::FolderLock>> lock_folders(const RunContext& run) const {
        std::vector<std::unique_ptr<detail::FolderLock>> locks;
        for (const auto& [id, folder] : folders)
            locks.push_back(std::make_unique<detail::FolderLock>(folder.path, run));
        return locks;
    }

    /// Writes the manifest of each scratch folder. @returns the set's number
    [[nodiscard]] std::string write_manifests() const {
        detail::Manifest manifest{detail::new_set_id(), {}, {}};
        for (const auto& [id, folder] : folders)
            manifest.scratches.push_back(
                {folder.scratch.path(), detail::id_of_entry(folder.scratch.path()).inode, id.inode});
        for (const auto& [id, folder] : folders) {
            manifest.files.clear();
            for (const File& file : files)
                if (file.temporary.parent_path() == folder.scratch.path())
                    manifest.files.push_back({detail::stamp_of(file.temporary), detail::stamp_of(file.target),
                                              file.target.filename().string()});
            detail::write_manifest(folder.scratch.path(), manifest);
        }
        return manifest.set;
    }

    /// Restores the files that the first `count` outputs have replaced.
    void put_back(std::size_t count, const std::string& set) noexcept {
        try {
            detail::write_commit(folders.begin()->second.scratch.path(), set, detail::SetOutcome::PutBack);
        } catch (const std::exception&) {
            // The previous commit, which states that the set is to be completed, remains. This matters only if the
            // process is killed before the end of this function: the next run would complete the set instead of undoing
            // it.
        }
        while (count-- > 0) static_cast<void>(detail::exchange_back(files[count].temporary, files[count].target));
    }

    /// The commit is removed last: without it, outputs remaining in other folders would be discarded.
    void remove_manifests() const noexcept {
        for (auto folder = folders.rbegin(); folder != folders.rend(); ++folder) {
            const fs::path& scratch = folder->second.scratch.path();
            ::unlink((scratch / detail::kManifest).c_str());
            const fs::path commit = scratch / detail::kCommit;
            if (detail::id_of_entry(commit) != FileId{}) ::unlink(commit.c_str());
        }
    }
};

FileSet::FileSet() : state_(std::make_unique<State>()) {}
FileSet::~FileSet() = default;

void FileSet::write(const std::string& path, const std::function<void(const std::string&)>& write,
                    const RunContext& run) {
    fs::path target = detail::path_of_output(path);
    if (!detail::is_output_name(target.filename().string()))
        throw Error(Errc::Io, path + ": cannot write: names that begin with " + detail::kHiddenPrefix +
                                  " are reserved for covol; choose another name");
    const fs::path folder = target.parent_path();
    ScratchFolder& scratch =
        state_->folders.try_emplace(detail::id_of_entry(folder), folder, run).first->second.scratch;
    const fs::path temporary = scratch.path() / target.filename();
    scratch.list(target.filename().string());
    state_->writing = {path, target, temporary};
    errno = 0;
    try {
        write(temporary.string());
    } catch (const Error& error) {
        throw Error(error.code(), shown(error.what()) + disk_full_reason(error.what()));
    }
    std::error_code status;
    if (fs::exists(target, status) && fs::is_directory(target, status) != fs::is_directory(temporary, status))
        throw Error(Errc::Io, path + ": cannot write: it is a " +
                                  (fs::is_directory(target, status) ? "folder, which a file cannot replace"
                                                                    : "file, which a folder cannot replace") +
                                  "; choose another name");
    state_->files.push_back({path, std::move(target), temporary});
}

void FileSet::publish(const RunContext& run) {
    std::vector<State::File>& files = state_->files;
    if (files.empty()) return state_->folders.clear();
    // If two runs end at the same time with the same outputs, one set is published after the other.
    const auto one_at_a_time = state_->lock_folders(run);
    for (const State::File& file : files) detail::keep_attributes(file.target, file.temporary);
    const std::string set = state_->write_manifests();
    // From here on, another thread that ends the process must not remove the scratch folders, because the next run
    // needs them to complete the publication.
    for (auto& [id, folder] : state_->folders) folder.scratch.keep_for_next_run();
    if (state_->folders.size() > 1)
        detail::write_commit(state_->folders.begin()->second.scratch.path(), set, detail::SetOutcome::Complete);
    for (std::size_t n = 0; n < files.size(); ++n)
        if (!detail::exchange(files[n].temporary, files[n].target)) {
            const int why = errno;
            state_->put_back(n, set);
            state_->remove_manifests();
            throw Error(Errc::Io, files[n].path + ": cannot write: " + std::strerror(why));
        }
    for (const auto& [id, folder] : state_->folders) detail::flush_folder(folder.path);
    // Without manifests, the next run does not restore the replaced files, which are deleted with the scratch folders.
    state_->remove_manifests();
    files.clear();
    state_->folders.clear();
}

std::string FileSet::shown(std::string text) const {
    const std::string temporary = state_->writing.temporary.string();
    if (temporary.empty()) return text;
    for (std::size_t at = 0; (at = text.find(temporary, at)) != std::string::npos; at += state_->writing.path.size())
        text.replace(at, temporary.size(), state_->writing.path);
    return text;
}

std::vector<std::string> FileSet::paths() const {
    std::vector<std::string> paths;
    for (const State::File& file : state_->files) paths.push_back(file.path);
    return paths;
}

void write_text_file(const std::string& path, const std::string& text) {
    detail::write_atomically(path, [&](const std::string& temporary) {
        std::ofstream file(temporary, std::ios::binary);
        file << text;
        file.close();
        if (!file) throw Error(Errc::Io, path + ": cannot write: " + std::strerror(errno));
    });
}

}  // namespace covol
