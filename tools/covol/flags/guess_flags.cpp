#include "flags/guess_flags.h"

namespace covol::tool {

void GuessFlags::bind(CLI::App& command) {
    in_group(command, Group::Marks);
    command
        .add_option("--guess", paths,
                    "result of another tool (a mask, mesh or level set) that marks and seeds correct in their "
                    "neighbourhood; farther away it stays unchanged")
        ->type_name("[NAME=]FILE")
        ->allow_extra_args(false);
    bind_options(command, inputs, Offered::WithImage);
}

Json to_json(const CorrectionReport& r) {
    return {{"marks", r.marks},
            {"seeds", r.seeds},
            {"marks_to_guess", {{"mean", r.before_mean}, {"max", r.before_max}}},
            {"marks_to_corrected", {{"mean", r.after_mean}, {"max", r.after_max}}},
            {"radius", {{"least", r.min_radius}, {"largest", r.largest_radius}}},
            {"depth", r.depth}};
}

}  // namespace covol::tool
