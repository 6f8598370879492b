#include "mark/imports.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <utility>

#include "covol/digest.h"
#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/image_files.h"
#include "covol/read_marks.h"
#include "covol/study_files.h"

namespace covol::tool {
namespace {

constexpr std::array kMarksEndings{".csv", ".tsv", ".txt",  ".xyz",  ".pts",  ".asc",
                                   ".roi", ".zip", ".json", ".fcsv", ".annot"};
constexpr std::array kGuessEndings{".nii",  ".nii.gz", ".nrrd", ".seg.nrrd", ".mha", ".tif",
                                   ".tiff", ".vdb",    ".stl",  ".ply",      ".obj", ".off"};
constexpr const char* kFolder = "files";  // of the study
constexpr std::uintmax_t kMostFolderBytes = std::uintmax_t(4) << 30;
constexpr std::size_t kMostImported = 100'000;

template <std::size_t N>
void require_ending(const std::string& ending, const std::array<const char*, N>& known) {
    if (std::find(known.begin(), known.end(), ending) != known.end()) return;
    std::string list;
    for (const char* one : known) list += (list.empty() ? "" : ", ") + std::string(one);
    throw Error(Errc::InvalidInput, "import: expected a file whose name ends in one of " + list +
                                        "; other kinds are named on the command line");
}

std::uintmax_t bytes_in(const std::filesystem::path& folder) {
    std::uintmax_t bytes = 0;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none))
        if (entry.is_regular_file(none)) bytes += entry.file_size(none);
    return bytes;
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
    const std::size_t most = is_marks ? kMostMarksBytes : kMostFileBytes;
    if (bytes.size() > most)
        throw Error(Errc::InvalidInput, "import: expected at most " + std::to_string(most >> 20) +
                                            " MiB; larger files are named on the command line");
    const std::filesystem::path into = std::filesystem::path(folder) / kFolder;
    std::error_code failed;
    std::filesystem::create_directories(into, failed);
    if (failed) throw Error(Errc::Io, "import: " + into.string() + ": cannot be made (" + failed.message() + ")");
    if (bytes_in(into) + bytes.size() > kMostFolderBytes)
        throw Error(Errc::InvalidInput, "import: " + into.string() + ": holds 4 GiB; remove what no structure needs");
    const std::string digest = digest_of_bytes(bytes);
    const std::filesystem::path path = into / (digest.substr(digest.find(':') + 1) + ending);
    // The same file again, of another structure perhaps, is there already, and stays.
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
    // What a page sends may not have the program read other files.
    if (!is_marks && kind_of_file(path.string()) == FileKind::Image && !list_image_files(path.string(), run).empty())
        throw Error(Errc::InvalidInput, "import: expected an image in one file; this one names others");
    return file;
}

StudyAction import_points(const std::string& file, StudyId structure, const ImageGeometry& image,
                          const RunContext& run) {
    Marks marks;
    marks.files.points.push_back(file);
    read_marks(marks, image, {}, run);
    if (marks.points.empty()) throw Error(Errc::InvalidInput, "import: " + file + ": holds no marks");
    if (marks.points.size() > kMostImported)
        throw Error(Errc::InvalidInput, "import: " + file + ": holds " + std::to_string(marks.points.size()) +
                                            " marks, a study takes " + std::to_string(kMostImported) +
                                            " of a file; covol segment --points takes all");
    return StudyActions::AddMarks{structure, MarkKind::Surface, std::move(marks.points)};
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
