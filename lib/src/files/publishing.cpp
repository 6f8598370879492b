#include "files/publishing.h"

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <sstream>
#include <utility>

#include "base/file.h"
#include "covol/error.h"
#include "covol/file_set.h"
#include "files/folder_lock.h"
#include "files/scratch.h"

namespace covol::detail {
namespace fs = std::filesystem;
namespace {

constexpr const char* kManifestMagic = "covol manifest, format 2";
constexpr const char* kCommitMagic = "covol commit, format 2";
constexpr const char* kEnd = "end";
// Longer than a run takes to clear a folder, but short, because the waiting process holds the lock of another folder.
constexpr std::chrono::milliseconds kShortPatience{2000};

/// Reads texts that each end with a zero, since names may contain any other character.
class Fields {
public:
    explicit Fields(const fs::path& path) {
        struct stat entry {};
        const Descriptor file(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK);
        const bool own = file.get() >= 0 && ::fstat(file.get(), &entry) == 0 && S_ISREG(entry.st_mode) &&
                         entry.st_uid == ::geteuid();
        if (!own) return;
        std::ifstream stream(path, std::ios::binary);
        text_.assign(std::istreambuf_iterator<char>(stream), {});
    }
    [[nodiscard]] bool empty() const { return at_ >= text_.size(); }
    std::string next() {
        const std::size_t begin = std::min(at_, text_.size()), end = std::min(text_.find('\0', begin), text_.size());
        at_ = end + 1;
        return text_.substr(begin, end - begin);
    }
    std::uint64_t next_number() { return parse_pair<std::uint64_t, std::uint64_t>(next() + " 0").first; }
    Stamp next_stamp() {
        const auto [inode, changed] = parse_pair<ino_t, std::int64_t>(next());
        return {inode, changed};
    }

private:
    template <typename A, typename B>
    static std::pair<A, B> parse_pair(const std::string& text) {
        std::pair<A, B> pair;
        std::istringstream numbers(text);
        return numbers >> pair.first >> pair.second ? pair : std::pair<A, B>{};
    }

    std::string text_;
    std::size_t at_ = 0;
};

std::optional<Manifest> read_manifest(const fs::path& scratch) {
    Fields fields(scratch / kManifest);
    if (fields.next() != kManifestMagic) return std::nullopt;
    Manifest manifest;
    manifest.set = fields.next();
    const std::uint64_t scratches = fields.next_number(), files = fields.next_number();
    for (std::uint64_t n = 0; n < scratches && !fields.empty(); ++n) {
        ScratchPlace place{fields.next(), 0, 0};
        place.inode = fields.next_number();
        place.folder = fields.next_number();
        manifest.scratches.push_back(std::move(place));
    }
    for (std::uint64_t n = 0; n < files && !fields.empty(); ++n) {
        const Stamp made = fields.next_stamp(), replaced = fields.next_stamp();
        manifest.files.push_back({made, replaced, fields.next()});
        if (!is_output_name(manifest.files.back().name)) return std::nullopt;
    }
    if (fields.next() != kEnd || manifest.scratches.empty()) return std::nullopt;
    return manifest;
}

std::optional<SetOutcome> read_commit(const fs::path& first, const std::string& set) {
    Fields fields(first / kCommit);
    if (fields.next() != kCommitMagic || fields.next() != set) return std::nullopt;
    return fields.next() == "complete" ? SetOutcome::Complete : SetOutcome::PutBack;
}

/// The files that a process which was killed in FileSet::publish() left in one scratch folder. This process holds the
/// locks of that folder and of its parent.
class AbandonedSet {
public:
    AbandonedSet(fs::path scratch, const RunContext& run) : scratch_(std::move(scratch)), run_(run) {
        manifest_ = read_manifest(scratch_);
    }

    /// Puts the files of all folders of the set in place, or restores the old ones, as the set's commit states. Without
    /// a commit, nothing is changed. @returns whether this scratch folder may be removed
    bool finish() {
        if (!manifest_) return !fs::exists(fs::symlink_status(scratch_ / kManifest));
        const std::size_t self = own_number();
        if (self == manifest_->scratches.size()) return false;  // the manifest belongs to another folder
        bool known = true;
        std::optional<SetOutcome> fate = self == 0 ? read_commit(scratch_, manifest_->set) : fate_elsewhere(known);
        // If there is only one folder, its manifest is also the commit.
        if (!fate && manifest_->scratches.size() == 1) fate = SetOutcome::Complete;
        if (!known) return false;
        if (!fate) return true;  // no file has been put in place yet
        bool others = true;
        for (std::size_t n = 1; n < manifest_->scratches.size(); ++n)
            if (n != self) others = finish_other(manifest_->scratches[n], *fate, true) && others;
        const bool done = put(*fate);
        if (self == 0) return done && others;
        if (done) ::unlink((scratch_ / kManifest).c_str());
        // The commit is removed last: without it, outputs remaining in other folders would be discarded.
        static_cast<void>(finish_other(manifest_->scratches[0], *fate, done && others));
        return done;
    }

private:
    [[nodiscard]] std::size_t own_number() const {
        const ino_t own = id_of_entry(scratch_).inode;
        std::size_t n = 0;
        while (n < manifest_->scratches.size() && manifest_->scratches[n].inode != own) ++n;
        return n;
    }

    [[nodiscard]] bool any_in_place() const {
        for (const Manifest::File& file : manifest_->files)
            if (stamp_of(scratch_.parent_path() / file.name).inode == file.made.inode) return true;
        return false;
    }

    /// Reads the commit, which is in another folder; none if it was not written. If it cannot be read, but a file of
    /// this folder is in place, the set is to be completed.
    /// @param known  becomes false if that folder's parent is inaccessible and no file is in place
    [[nodiscard]] std::optional<SetOutcome> fate_elsewhere(bool& known) const {
        const ScratchPlace& first = manifest_->scratches.front();
        known = id_of_entry(first.path.parent_path()).inode == first.folder;
        if (known) {
            if (id_of_entry(first.path).inode == first.inode) return read_commit(first.path, manifest_->set);
            // Without the folder of the commit, either the commit was never written, and no file is in place, or it was
            // removed after all files of the other folders had been put in place.
            if (!any_in_place()) return std::nullopt;
        }
        known = any_in_place();
        return SetOutcome::Complete;
    }

    /// Puts this folder's files in place, or restores the old ones. @returns whether that succeeded
    bool put(SetOutcome fate) {
        const fs::path folder = scratch_.parent_path();
        bool done = true;
        for (const Manifest::File& file : manifest_->files) {
            const fs::path temporary = scratch_ / file.name, target = folder / file.name;
            const Stamp there = stamp_of(target), here = stamp_of(temporary);
            // Files that other processes have put there since are not replaced.
            if (fate == SetOutcome::Complete && here == file.made && (there == file.replaced || there == Stamp{}))
                done = exchange(temporary, target) && done;
            if (fate == SetOutcome::PutBack && there == file.made) done = exchange_back(temporary, target) && done;
            // On file systems without atomic exchange, the process may have been killed in exchange_back(), after it
            // had moved the new file away and before the old one was in place.
            if (fate == SetOutcome::PutBack && there == Stamp{} && here == file.replaced && here != Stamp{})
                done = ::rename(temporary.c_str(), target.c_str()) == 0 && done;
        }
        flush_folder(folder);
        return done;
    }

    /// Calls put() for another scratch folder of the set, unless its parent stays locked. @returns whether that
    /// succeeded
    /// @param may_remove  whether that scratch folder is then removed
    [[nodiscard]] bool finish_other(const ScratchPlace& place, SetOutcome fate, bool may_remove) const {
        const fs::path folder = place.path.parent_path();
        if (id_of_entry(folder).inode != place.folder) return false;
        try {
            const FolderLock lock(folder, run_, kShortPatience);
            const FileId id = id_of_entry(place.path);
            if (id == FileId{}) return true;
            if (!lock.is_locked() || id.inode != place.inode) return false;
            const AbandonedScratch dead(place.path);
            if (dead.state() != AbandonedScratch::State::Dead) return false;
            AbandonedSet other(place.path, run_);
            if (other.manifest_ && other.manifest_->set != manifest_->set) return false;
            if (other.manifest_ && !other.put(fate)) return false;
            if (!may_remove) return true;
            ::unlink((place.path / kManifest).c_str());
            dead.remove();
            return true;
        } catch (const Error& error) {
            if (error.code() == Errc::Cancelled) throw;
            return false;
        }
    }

    fs::path scratch_;
    const RunContext& run_;
    std::optional<Manifest> manifest_;
};

}  // namespace

Stamp stamp_of(const fs::path& path) {
    struct stat entry {};
    if (::lstat(path.c_str(), &entry) != 0) return {};
    constexpr std::int64_t kNanoseconds = 1'000'000'000;
    return {entry.st_ino, entry.st_mtim.tv_sec * kNanoseconds + entry.st_mtim.tv_nsec};
}

std::string new_set_id() {
    std::random_device random;
    std::string text;
    for (int n = 0; n < 4; ++n) text += (n > 0 ? "-" : "") + std::to_string(random());
    return text;
}

void write_manifest(const fs::path& scratch, const Manifest& manifest) {
    std::string text;
    const auto add = [&](const std::string& field) { text += field + '\0'; };
    add(kManifestMagic);
    add(manifest.set);
    add(std::to_string(manifest.scratches.size()));
    add(std::to_string(manifest.files.size()));
    for (const ScratchPlace& place : manifest.scratches) {
        add(place.path.string());
        add(std::to_string(place.inode));
        add(std::to_string(place.folder));
    }
    for (const Manifest::File& file : manifest.files) {
        add(file.made.text());
        add(file.replaced.text());
        add(file.name);
    }
    add(kEnd);
    write_text_file((scratch / kManifest).string(), text);
    flush_folder(scratch);
}

void write_commit(const fs::path& first, const std::string& set, SetOutcome fate) {
    write_text_file((first / kCommit).string(), kCommitMagic + std::string(1, '\0') + set + '\0' +
                                                    (fate == SetOutcome::Complete ? "complete" : "put back") + '\0');
    flush_folder(first);
}

bool exchange(const fs::path& from, const fs::path& to) {
    if (id_of_entry(to) == FileId{}) return ::rename(from.c_str(), to.c_str()) == 0;
    return swap_paths(from.string(), to.string());
}

bool exchange_back(const fs::path& from, const fs::path& to) {
    if (id_of_entry(from) == FileId{}) return ::rename(to.c_str(), from.c_str()) == 0;
    return swap_paths(from.string(), to.string());
}

void clear_abandoned(const fs::path& folder, const RunContext& run) {
    std::vector<fs::path> found;
    std::error_code status;
    for (fs::directory_iterator at(folder, status), end; !status && at != end; at.increment(status))
        if (is_scratch_name(at->path().filename().string())) found.push_back(at->path());
    for (const fs::path& scratch : found) {
        const AbandonedScratch dead(scratch);
        if (dead.state() == AbandonedScratch::State::Unstarted ||
            (dead.state() == AbandonedScratch::State::Dead && AbandonedSet(scratch, run).finish()))
            dead.remove();
    }
}

}  // namespace covol::detail
