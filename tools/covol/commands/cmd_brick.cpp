#include <string>
#include <vector>

#include "cli/options/arguments.h"
#include "commands/commands.h"

namespace covol::tool {
namespace {

/// `brick plan ...`, `brick run ...` and `brick join ...` are handled as segment and reconstruct (see Session::main);
/// this class provides the help, and the error for everything else.
struct BrickHelp {
    std::vector<std::string> words;
    void run(Session&) const { throw UsageError("brick: expected plan, run or join, got " + words.front()); }
};

}  // namespace

void add_brick(Session& session) {
    const auto [job, command] = session.add_job<BrickHelp>(
        "brick",
        "Run segment or reconstruct in bricks: plan them, run them on any number of machines, join their results");
    in_group(*command, Group::Input);
    command
        ->add_option(
            "step", job->words,
            "plan segment|reconstruct ... -o FOLDER, with all options of that command; run FOLDER [BRICK...] [--sweep "
            "N], by default all bricks and sweeps; join FOLDER -o OUT.vdb, with --mesh and the other outputs")
        ->required()
        ->type_name("plan|run|join ...");
}

}  // namespace covol::tool
