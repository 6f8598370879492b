#include <string>
#include <vector>

#include "cli/options/arguments.h"
#include "commands/commands.h"

namespace covol::tool {
namespace {

/// `plan segment ...` and `plan reconstruct ...` are handled as these commands (see Session::main); this class provides
/// the help, and the error for other commands.
struct PlanJob {
    std::vector<std::string> words;
    void run(Session&) const {
        throw UsageError("plan: expected segment or reconstruct with its options, got " + words.front());
    }
};

}  // namespace

void add_plan(Session& session) {
    const auto [job, command] = session.add_job<PlanJob>(
        "plan", "Estimate what a segment or reconstruct run would read, and the memory and time that it would need");
    in_group(*command, Group::Input);
    command->add_option("command", job->words, "segment or reconstruct, with all its options")
        ->required()
        ->type_name("COMMAND...");
}

}  // namespace covol::tool
