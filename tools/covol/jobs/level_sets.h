#pragma once
#include <string>
#include <vector>

#include "cli/options/arguments.h"
#include "covol/vdb_io.h"

// Input of commands that use all level sets of a file.
namespace covol::tool {

struct NamedLevelSet {
    std::string name;
    FloatGridPtr surface;
};

/// Adds the positional argument whose text read_level_sets() expects.
void bind_level_sets(CLI::App& command, std::string& input);

/// All level sets of "FILE.vdb", or the one named by "FILE.vdb:name". @throws Error as read_vdb_level_set.
[[nodiscard]] std::vector<NamedLevelSet> read_level_sets(const std::string& input, const RunContext& run);

/// The index of the level set that `given` (NAME=VALUE) is for; a value without a name is for the only level set.
/// @param value  what VALUE is called in messages, such as "FILE" @throws UsageError, with the names of the level sets.
[[nodiscard]] std::size_t owner_of(const std::vector<std::string>& level_sets, const std::string& flag,
                                   const Named& given, const std::string& value);

}  // namespace covol::tool
