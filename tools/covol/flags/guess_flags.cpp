#include "flags/guess_flags.h"

#include <algorithm>

#include "cli/file_kind.h"
#include "covol/error.h"
#include "covol/painted.h"
#include "flags/one_label.h"

namespace covol::tool {
namespace {

std::string list_of(const std::vector<LabelName>& labels) {
    std::string text;
    for (const LabelName& label : labels) text += (text.empty() ? "" : ", ") + std::to_string(label.label);
    return text;
}

}  // namespace

void GuessFlags::bind(CLI::App& command) {
    in_group(command, Group::Marks);
    command
        .add_option("--guess", paths,
                    "another tool's result, a mask, mesh or level set, that marks and seeds correct near them; what is "
                    "farther away stays as it is")
        ->type_name("[NAME=]FILE")
        ->allow_extra_args(false);
    bind_options(command, inputs, Offered::WithImage);
}

Guess read_guess(const std::string& path, int label, const ImageGeometry& image, bool force, const RunContext& run) {
    Guess guess;
    guess.start.path = path;
    switch (kind_of_file(path)) {
        case FileKind::Vdb: guess.start.kind = Start::Kind::Vdb; return guess;
        case FileKind::Mesh: guess.start.kind = Start::Kind::Mesh; return guess;
        case FileKind::Points:
            throw Error(Errc::InvalidInput, "--guess: " + path + ": expected a mask, mesh or level set, got points");
        case FileKind::Image: break;
    }
    RunContext silent = run;
    silent.log = {};
    guess.mask = placed_on(read_image(path, {}, silent), image, force);
    const std::vector<LabelName> labels = find_painted_labels(*guess.mask);
    if (label == 0 && labels.size() > 1)
        throw Error(Errc::InvalidInput, "--guess: " + path + ": expected one label, got " + list_of(labels) +
                                            "; choose one by --guess-label");
    guess.label = label != 0 ? label : labels.front().label;
    if (std::none_of(labels.begin(), labels.end(), [&](const LabelName& l) { return l.label == guess.label; }))
        throw Error(Errc::InvalidInput, "--guess-label: expected one of the labels of " + path + ", " +
                                            list_of(labels) + ", got " + std::to_string(guess.label));
    guess.start.kind = Start::Kind::Mask;
    guess.start.mask = std::make_shared<const Image>(only(*guess.mask, guess.label));
    run.info("--guess " + path + ": label " + std::to_string(guess.label));
    return guess;
}

Json to_json(const CorrectionReport& r) {
    return {{"marks", r.marks},
            {"seeds", r.seeds},
            {"marks_to_guess", {{"mean", r.before_mean}, {"max", r.before_max}}},
            {"marks_to_corrected", {{"mean", r.after_mean}, {"max", r.after_max}}},
            {"radius", {{"least", r.least_radius}, {"largest", r.largest_radius}}},
            {"depth", r.depth}};
}

}  // namespace covol::tool
