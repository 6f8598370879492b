#include "mark/imports.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "covol/digest.h"
#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/image_files.h"
#include "covol/mark_kinds.h"
#include "covol/points.h"
#include "covol/study_files.h"

namespace covol::tool {
namespace {

constexpr std::array kMarksEndings{".csv", ".tsv", ".txt",  ".xyz",  ".pts",  ".asc",
                                   ".roi", ".zip", ".json", ".fcsv", ".annot"};
constexpr std::array kGuessEndings{".nii",  ".nii.gz", ".nrrd", ".seg.nrrd", ".mha", ".tif",
                                   ".tiff", ".vdb",    ".stl",  ".ply",      ".obj", ".off"};
constexpr const char* kFolder = "files";  // name of the folder of imported files, in that of the study
constexpr std::uintmax_t kMaxFolderBytes = std::uintmax_t(4) << 30;
constexpr std::size_t kMaxImported = 100'000;

template <std::size_t N>
void require_ending(const std::string& ending, const std::array<const char*, N>& known) {
    if (std::find(known.begin(), known.end(), ending) != known.end()) return;
    std::string list;
    for (const char* one : known) list += (list.empty() ? "" : ", ") + std::string(one);
    throw Error(Errc::InvalidInput, "import: expected a file whose name ends in one of " + list +
                                        "; give files of other kinds on the command line");
}

std::uintmax_t bytes_in(const std::filesystem::path& folder) {
    std::uintmax_t bytes = 0;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none))
        if (entry.is_regular_file(none)) bytes += entry.file_size(none);
    return bytes;
}

/// The outline for a line on a slice of the image; nullopt if the line is on no slice, or has too few corners.
std::optional<StudyOutline> outline_of(const std::vector<Vec3>& world, const MarkLine& line,
                                       const ImageGeometry& image) {
    constexpr double kSlack = 0.01;  // voxels: rounding in text files
    if (line.end - line.begin < (line.closed ? 3U : 2U)) return std::nullopt;
    Vec3 low{}, high{};
    for (std::size_t n = line.begin; n < line.end; ++n) {
        const Vec3 index = image.world_to_index(world[n]);
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = n == line.begin ? index[a] : std::min(low[a], index[a]);
            high[a] = n == line.begin ? index[a] : std::max(high[a], index[a]);
        }
    }
    for (const int axis : {2, 1, 0}) {
        const auto a = std::size_t(axis);
        if (high[a] - low[a] > kSlack) continue;
        StudyOutline outline{0, axis, 0.5 * (low[a] + high[a]), line.closed, {}};
        // Rounded, because the page draws an outline only on a slice with exactly this position.
        if (std::abs(outline.at - std::round(outline.at)) <= kSlack) outline.at = std::round(outline.at);
        outline.world.assign(world.begin() + std::ptrdiff_t(line.begin), world.begin() + std::ptrdiff_t(line.end));
        return outline;
    }
    return std::nullopt;
}

}  // namespace

GivenFile::GivenFile(std::string path) : path_(std::make_unique<std::string>(std::move(path))) {}

GivenFile::~GivenFile() {
    std::error_code ignored;
    if (path_ && !*is_kept_) std::filesystem::remove(*path_, ignored);
}

GivenFile keep_file(const std::string& name, const std::string& bytes, bool is_marks, const std::string& folder,
                    const RunContext& run) {
    const std::string ending = long_ending(name);
    if (is_marks)
        require_ending(ending, kMarksEndings);
    else
        require_ending(ending, kGuessEndings);
    const std::size_t maximum = is_marks ? kMaxMarksBytes : kMaxFileBytes;
    if (bytes.size() > maximum)
        throw Error(Errc::InvalidInput, "import: expected at most " + std::to_string(maximum >> 20) +
                                            " MiB; give larger files on the command line");
    const std::filesystem::path into = std::filesystem::path(folder) / kFolder;
    std::error_code failed;
    std::filesystem::create_directories(into, failed);
    if (failed) throw Error(Errc::Io, "import: " + into.string() + ": cannot be created (" + failed.message() + ")");
    if (bytes_in(into) + bytes.size() > kMaxFolderBytes)
        throw Error(Errc::InvalidInput,
                    "import: " + into.string() +
                        ": expected at most 4 GiB with this file; remove files that no structure uses");
    const std::string digest = digest_of_bytes(bytes);
    const std::filesystem::path path = into / (digest.substr(digest.find(':') + 1) + ending);
    // The file has been imported before, perhaps for another structure; it is not replaced.
    if (std::filesystem::exists(path, failed)) {
        GivenFile known(path.string());
        known.keep();
        return known;
    }
    GivenFile file(path.string());
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), std::streamsize(bytes.size()));
    out.close();
    if (!out) throw Error(Errc::Io, "import: " + path.string() + ": cannot be written");
    // Data from a page must not cause the program to read other files.
    if (!is_marks && kind_of_file(path.string()) == FileKind::Image && !list_image_files(path.string(), run).empty())
        throw Error(Errc::InvalidInput, "import: expected an image in one file; this one refers to others");
    return file;
}

StudyAction import_points(const std::string& file, StudyId structure, const ImageGeometry& image,
                          const RunContext& run) {
    const KindedPoints given = read_kinded_points(file);
    const PointCloud& cloud = given.cloud;
    if (cloud.points.size() > kMaxImported)
        throw Error(Errc::InvalidInput, "import: " + file + ": contains " + std::to_string(cloud.points.size()) +
                                            " marks, but a study accepts at most " + std::to_string(kMaxImported) +
                                            " from a file; covol segment --points uses all");
    check_inside(cloud, image, run);
    const std::vector<Vec3> world = to_world(cloud, image);
    StudyActions::AddMarks action{structure, MarkKind::Surface, {}};
    std::vector<bool> is_in_outline(world.size(), false);
    for (const MarkLine& line : cloud.lines) {
        std::optional<StudyOutline> outline = outline_of(world, line, image);
        if (!outline) continue;  // its points are added as single marks
        action.outlines.push_back(*std::move(outline));
        std::fill(is_in_outline.begin() + std::ptrdiff_t(line.begin), is_in_outline.begin() + std::ptrdiff_t(line.end),
                  true);
    }
    for (std::size_t n = 0; n < world.size(); ++n) {
        if (is_in_outline[n]) continue;
        switch (given.kinds.empty() ? MarkKind::Surface : given.kinds[n]) {
            case MarkKind::Surface: action.world.push_back(world[n]); break;
            case MarkKind::Inside: action.inside.push_back(world[n]); break;
            case MarkKind::Outside: action.outside.push_back(world[n]); break;
        }
    }
    return action;
}

StudyAction import_guess(const std::string& file, StudyId structure, const std::string& folder, const StudySite& site,
                         const RunContext& run) {
    StudyGuess guess = guess_of_file(folder, file);
    (void)site.read_guess(guess, run);
    return StudyActions::SetGuess{structure, std::move(guess)};
}

StudyAction import_labels(const std::string& file, const std::string& folder, const StudyState& state,
                          const StudySite& site, const RunContext& run) {
    auto labels = labels_of_file(file, site.image, state, run);
    StudyGuess named = guess_of_file(folder, file);
    return StudyActions::AddLabels{std::move(named.path), std::move(named.digest), std::move(labels)};
}

}  // namespace covol::tool
