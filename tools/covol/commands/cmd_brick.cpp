#include <string>
#include <vector>

#include "cli/arguments.h"
#include "commands/commands.h"

namespace covol::tool {
namespace {

/// `brick plan ...`, `brick run ...` and `brick join ...` are segment and reconstruct (see Session::main); this is the
/// help, and the error for all else.
struct BrickHelp {
    std::vector<std::string> words;
    void run(Session&) const { throw UsageError("brick: expected plan, run or join, got " + words.front()); }
};

}  // namespace

void add_brick(Session& session) {
    const auto [job, command] = session.add_job<BrickHelp>(
        "brick",
        "A segment or reconstruct in bricks: plan it, run them on any number of machines, join what they found");
    in_group(*command, Group::Input);
    command
        ->add_option("step", job->words,
                     "plan segment|reconstruct ... -o FOLDER, with all of its options; run FOLDER [BRICK...] [--sweep "
                     "N], all bricks and sweeps where none is named; join FOLDER -o OUT.vdb [--mesh ...]")
        ->required()
        ->type_name("plan|run|join ...");
}

}  // namespace covol::tool
