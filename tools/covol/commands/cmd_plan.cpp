#include <string>
#include <vector>

#include "cli/arguments.h"
#include "commands/commands.h"

namespace covol::tool {
namespace {

/// `plan segment ...` and `plan reconstruct ...` are these commands (see Session::main); this is the help, and the
/// error for the others.
struct PlanJob {
    std::vector<std::string> words;
    void run(Session&) const {
        throw UsageError("plan: expected segment or reconstruct with its options, got " + words.front());
    }
};

}  // namespace

void add_plan(Session& session) {
    const auto [job, command] =
        session.add_job<PlanJob>("plan", "What a segment or reconstruct would read, hold and take, before it starts");
    in_group(*command, Group::Input);
    command->add_option("command", job->words, "segment or reconstruct, with all its options")
        ->required()
        ->type_name("COMMAND...");
}

}  // namespace covol::tool
