#include "flags/checkpoint_flags.h"

#include <memory>

#include "covol/checkpoints.h"
#include "flags/bindings.h"

namespace covol::tool {

void CheckpointFlags::bind(CLI::App& command) {
    in_group(command, Group::Output);
    command
        .add_option("--checkpoint", folder,
                    "keep the flow's state in this folder until the results are written, for --resume")
        ->type_name("OUT_FOLDER");
    command.add_option("--checkpoint-every", every, "seconds between two states")
        ->type_name("SECONDS")
        ->capture_default_str();
    command
        .add_option("--resume", resumed,
                    "continue from the states in this folder, if there are any, with a bit-identical result; new "
                    "states are kept there, too")
        ->type_name("OUT_FOLDER");
}

void CheckpointFlags::begin(Session& session) const {
    if (!given()) return;
    if (!folder.empty() && !resumed.empty() && folder != resumed)
        throw UsageError("--checkpoint and --resume: expected one folder, got " + folder + " and " + resumed);
    const bool resumes = !resumed.empty();
    const std::string& path = resumes ? resumed : folder;
    const auto checkpoints = std::make_shared<Checkpoints>(path, every, session.provenance().job_text(), resumes);
    if (resumes && !checkpoints->had_states())
        session.note("--resume: " + path + " has no state yet; the run starts from the beginning");
    session.keep_states(checkpoints);
}

}  // namespace covol::tool
