#include "covol/study.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "covol/error.h"
#include "covol/file_set.h"
#include "files/descriptor.h"
#include "study/study_json.h"

namespace covol {
namespace {

namespace fs = std::filesystem;
using detail::Descriptor;
using nlohmann::json;

constexpr int kVersion = 1;
constexpr const char* kJournal = "journal.jsonl";
constexpr std::uintmax_t kMaxBytes = std::uintmax_t(1) << 32;

[[noreturn]] void fail(Errc code, const fs::path& path, const std::string& why) {
    throw Error(code, "study: " + path.string() + ": " + why);
}

std::string error_text() { return std::strerror(errno); }

std::string header_of(const StudyImage& image) {
    const ImageGeometry& g = image.geometry;
    return json{{"covol_study", kVersion},
                {"image",
                 {{"path", image.path},
                  {"size", g.size},
                  {"spacing", g.spacing},
                  {"origin", g.origin},
                  {"direction", g.direction}}}}
        .dump();
}

StudyImage parse_header(std::string_view line, const fs::path& path) {
    try {
        const json object = detail::parse_object(line);
        const int version = object.at("covol_study").get<int>();
        if (version != kVersion)
            fail(Errc::Unsupported, path,
                 "its version is " + std::to_string(version) + ", expected " + std::to_string(kVersion));
        const json& from = object.at("image");
        StudyImage image;
        image.path = from.at("path").get<std::string>();
        image.geometry.size = from.at("size").get<Index3>();
        image.geometry.spacing = from.at("spacing").get<Vec3>();
        image.geometry.origin = from.at("origin").get<Vec3>();
        image.geometry.direction = from.at("direction").get<Matrix3>();
        return image;
    } catch (const json::exception&) {
        fail(Errc::InvalidInput, path, "expected the journal of a study, but its first line is not that of one");
    } catch (const Error& error) {
        if (error.code() == Errc::Unsupported) throw;
        fail(Errc::InvalidInput, path, "expected the journal of a study, but its first line is not that of one");
    }
}

/// Whether two images have the same size and position, up to the rounding to single precision in files.
bool is_same(const ImageGeometry& a, const ImageGeometry& b) {
    if (a.size != b.size) return false;
    const double slack = 1e-3 * b.smallest_spacing();
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index{};
        for (std::size_t axis = 0; axis < 3; ++axis) index[axis] = (corner >> axis & 1) != 0 ? a.size[axis] : 0;
        const Vec3 one = a.index_to_world(index), other = b.index_to_world(index);
        if (!(std::hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]) <= slack)) return false;
    }
    return true;
}

std::string read_text(const fs::path& path) {
    std::error_code none;
    const std::uintmax_t bytes = fs::file_size(path, none);
    if (none == std::errc::no_such_file_or_directory)
        fail(Errc::Io, path, "it does not exist; expected the journal of a study");
    if (none) fail(Errc::Io, path, "it cannot be read (" + none.message() + ")");
    if (bytes > kMaxBytes) fail(Errc::InvalidInput, path, "it is too large for the journal of a study");
    std::ifstream file = open_regular_file(path.string());
    std::string text(std::size_t(bytes), '\0');
    file.read(text.data(), std::streamsize(bytes));
    text.resize(std::size_t(std::max<std::streamsize>(file.gcount(), 0)));
    if (file.bad()) fail(Errc::Io, path, "it cannot be read");
    return text;
}

/// The lines that end in a newline, without it. An incomplete last line is omitted.
std::vector<std::string_view> whole_lines(std::string_view text) {
    std::vector<std::string_view> lines;
    for (std::size_t end; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1))
        lines.push_back(text.substr(0, end));
    return lines;
}

template <typename Take>
void each_action(const std::vector<std::string_view>& lines, const fs::path& path, const Take& take) {
    for (std::size_t n = 1; n < lines.size(); ++n) try {
            take(parse_study_action(lines[n]));
        } catch (const Error& error) {
            fail(Errc::InvalidInput, path,
                 "line " + std::to_string(n + 1) + " is damaged (" + error.what() +
                     "); to keep the lines before it, delete this line and all after it");
        }
}

}  // namespace

/// A file to which lines are appended. append() returns when the line is on disk.
struct Study::Journal {
    fs::path path;
    Descriptor file;
    off_t end = 0;  ///< end of the lines that are known to be on disk

    explicit Journal(fs::path p) : path(std::move(p)), file(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK) {
        struct stat entry {};
        if (file.get() < 0 || ::fstat(file.get(), &entry) != 0)
            fail(Errc::Io, path, "it cannot be opened for writing (" + error_text() + ")");
        if (!S_ISREG(entry.st_mode)) fail(Errc::Io, path, "it is not a regular file");
        if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
            fail(Errc::Io, path, "another program has this study open");
    }
    /// Discards everything after the first `bytes` bytes.
    void cut(off_t bytes) {
        if (::ftruncate(file.get(), bytes) != 0) fail(Errc::Io, path, "it cannot be written (" + error_text() + ")");
        end = bytes;
    }
    void append(const std::string& line) {
        const std::string text = line + '\n';
        std::size_t done = 0;
        while (done < text.size()) {
            const ssize_t wrote = ::pwrite(file.get(), text.data() + done, text.size() - done, end + off_t(done));
            if (wrote < 0 && errno == EINTR) continue;
            if (wrote <= 0) break;
            done += std::size_t(wrote);
        }
        if (done < text.size() || ::fdatasync(file.get()) != 0) {
            const std::string why = error_text();
            // If this fails, too, the incomplete line is cut off when the study is opened again.
            [[maybe_unused]] const int left = ::ftruncate(file.get(), end);
            fail(Errc::Io, path, "it cannot be written (" + why + "); the last action was not kept");
        }
        end += off_t(text.size());
    }
};

Study::Study(std::string folder, const std::string& image_path, const ImageGeometry& image)
    : folder_(std::move(folder)), history_(image) {
    std::error_code failed;
    fs::create_directories(folder_, failed);
    if (failed) fail(Errc::Io, folder_, "the folder cannot be created (" + failed.message() + ")");
    const fs::path path = fs::path(folder_) / kJournal;
    journal_ = std::make_unique<Journal>(path);
    const std::string text = read_text(path);
    const std::vector<std::string_view> lines = whole_lines(text);
    if (lines.empty()) {
        // A truncated first line contains no action, and the journal may begin anew; any other content is not a journal
        // and must not be overwritten.
        constexpr std::string_view kBegin = "{\"covol_study\":";
        if (!kBegin.starts_with(std::string_view(text).substr(0, kBegin.size())))
            fail(Errc::InvalidInput, path, "expected the journal of a study, but its first line is not that of one");
        const fs::path absolute = fs::absolute(image_path, failed), base = fs::absolute(folder_, failed);
        const fs::path relative = absolute.lexically_relative(base);
        journal_->cut(0);
        journal_->append(header_of({(relative.empty() ? absolute : relative).generic_string(), image}));
        detail::flush_folder(folder_);
        return;
    }
    if (!is_same(parse_header(lines.front(), path).geometry, image))
        fail(Errc::InvalidInput, path,
             "this study belongs to an image of another size, spacing or position; open that image, or choose another "
             "study");
    each_action(lines, path, [&](const KeyedAction& action) {
        const StudyId made = history_.apply(action.action).made;
        ++sequence_;
        if (!action.key.empty()) made_.emplace(action.key, made);
    });
    const std::size_t whole = std::size_t(lines.back().data() + lines.back().size() + 1 - text.data());
    if (whole < text.size()) {
        repaired_ = "the last line was cut off (" + std::to_string(text.size() - whole) +
                    " bytes): an unconfirmed action was dropped";
        journal_->cut(off_t(whole));
    }
    journal_->end = off_t(whole);
}

Study::~Study() = default;
Study::Study(Study&&) noexcept = default;

Study::Applied Study::apply(const KeyedAction& action) {
    if (const auto before = made_.find(action.key); before != made_.end()) return {{{}, before->second}, false};
    StudyHistory::Step step = history_.plan(action.action);
    journal_->append(to_json(action));
    ++sequence_;
    Applied applied{history_.carry_out(std::move(step)), true};
    if (!action.key.empty()) made_.emplace(action.key, applied.changed.made);
    return applied;
}

StudyImage read_study_image(const std::string& folder) {
    const fs::path path = fs::path(folder) / kJournal;
    const std::string text = read_text(path);
    const std::vector<std::string_view> lines = whole_lines(text);
    if (lines.empty()) fail(Errc::InvalidInput, path, "expected the journal of a study; it is empty");
    return parse_header(lines.front(), path);
}

namespace {

StudyHistory read_history(const std::string& folder) {
    const fs::path path = fs::path(folder) / kJournal;
    const std::string text = read_text(path);
    const std::vector<std::string_view> lines = whole_lines(text);
    if (lines.empty()) fail(Errc::InvalidInput, path, "expected the journal of a study; it is empty");
    StudyHistory history(parse_header(lines.front(), path).geometry);
    each_action(lines, path, [&](const KeyedAction& action) { (void)history.apply(action.action); });
    return history;
}

}  // namespace

StudyState read_study(const std::string& folder) { return read_history(folder).state(); }

StudyOptions read_study_options(const std::string& folder) { return read_history(folder).options(); }

SegmentOptions StudyOptions::applied_to(SegmentOptions options) const {
    if (voxel_size) options.voxel_size = *voxel_size;
    if (rho) options.evolve.rho = *rho;
    if (mark_precision) options.mark_precision = *mark_precision;
    if (model) options.model = *model;
    return options;
}

}  // namespace covol
