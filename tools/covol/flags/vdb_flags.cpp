#include "flags/vdb_flags.h"

#include "flags/bindings.h"

namespace covol::tool {

void VdbFlags::bind(CLI::App& command) {
    in_group(command, Group::Output);
    command.add_flag("--half", options.half, "store values in .vdb files as 16-bit floats");
    add_choice(
        command, "--compression", options.compression,
        {{"none", VdbCompression::None}, {"zip", VdbCompression::Zip}, {"blosc", VdbCompression::Blosc}},
        "of .vdb files: zip and none open where a program has no Blosc, or another one; under zip OpenVDB leaves level "
        "sets and fog volumes as they are");
}

}  // namespace covol::tool
