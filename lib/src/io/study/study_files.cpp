#include "covol/study_files.h"

#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include "covol/digest.h"
#include "covol/error.h"
#include "covol/file_kind.h"
#include "covol/image_files.h"
#include "covol/read_marks.h"
#include "covol/safe_text.h"

namespace covol {
namespace {

namespace fs = std::filesystem;

/// Reads the guesses of a study, which are results of other programs that marks correct, and keeps the most recent ones
/// in memory. read() locks a mutex, because solvers call it from several threads.
class GuessReader {
public:
    GuessReader(std::string folder, const ImageGeometry& image) : folder_(std::move(folder)), image_(image) {}

    GivenGuess read(const StudyGuess& guess, const RunContext& run) {
        const std::lock_guard lock(mutex_);
        for (const auto& [of, known] : known_)
            if (of == guess) return known;
        const std::string path = (fs::path(folder_) / guess.path).lexically_normal().string();
        if (digest_of(path) != guess.digest)
            throw Error(Errc::InvalidInput, "study: " + path +
                                                ": this file has changed since it was chosen as the guess; restore the "
                                                "old file, or choose the guess again");
        ReadMarksOptions options;
        options.guess_label = guess.label;
        GivenGuess given = kind_of_file(path) == FileKind::Image
                               ? make_guess(image_of(path, guess.digest, run), guess.label, image_)
                               : read_guess(path, image_, options, run);
        given.mask.reset();
        constexpr std::size_t kMaxKept = 4;
        if (known_.size() == kMaxKept) known_.pop_front();
        known_.emplace_back(guess, given);
        return given;
    }

private:
    const Image& image_of(const std::string& path, const std::string& digest, const RunContext& run) {
        if (!labels_ || labels_digest_ != digest) {
            RunContext silent = run;
            silent.log = {};
            labels_ = read_image(path, {}, silent);
            labels_digest_ = digest;
        }
        return *labels_;
    }

    std::string folder_;
    ImageGeometry image_;
    std::mutex mutex_;
    std::deque<std::pair<StudyGuess, GivenGuess>> known_;
    std::optional<Image> labels_;
    std::string labels_digest_;
};

}  // namespace

StudyGuess guess_of_file(const std::string& folder, const std::string& file, int label) {
    std::error_code failed;
    const fs::path absolute = fs::absolute(file, failed), base = fs::absolute(folder, failed);
    const fs::path relative = absolute.lexically_normal().lexically_relative(base.lexically_normal());
    return {(relative.empty() ? absolute : relative).generic_string(), digest_of(file), label};
}

StudySite open_study_site(const std::string& folder, const ImageGeometry& image) {
    const auto reader = std::make_shared<GuessReader>(folder, image);
    return {image, [reader](const StudyGuess& guess, const RunContext& run) { return reader->read(guess, run); }};
}

std::vector<StudyActions::AddLabels::Label> labels_of_file(const std::string& file, const ImageGeometry& image,
                                                           const StudyState& taken, const RunContext& run) {
    if (kind_of_file(file) != FileKind::Image)
        throw Error(Errc::InvalidInput, "labels: " + file + ": expected a label image");
    RunContext silent = run;
    silent.log = {};
    std::set<std::string> names;
    for (const auto& structure : taken) names.insert(structure->name);
    std::vector<StudyActions::AddLabels::Label> labels;
    for (const LabelName& found : find_painted_labels(placed_on(read_image(file, {}, silent), image))) {
        const std::string name = safe_text(found.name);
        std::string unique = name;
        for (int n = 2; !names.insert(unique).second; ++n) unique = name + " " + std::to_string(n);
        labels.push_back({found.label, unique});
    }
    return labels;
}

}  // namespace covol
