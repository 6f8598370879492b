#include "jobs/level_sets.h"

#include <algorithm>

#include "flags/bindings.h"

namespace covol::tool {

void bind_level_sets(CLI::App& command, std::string& input) {
    in_group(command, Group::Input);
    command
        .add_option("level_set", input,
                    "level sets; if a file has several, all are shown, or the one that :NAME selects")
        ->required()
        ->type_name("IN.vdb[:NAME]");
}

std::vector<NamedLevelSet> read_level_sets(const std::string& input, const RunContext& run) {
    std::vector<NamedLevelSet> all;
    const VdbGridName name = split_grid_name(input);
    if (name.grid.empty())
        for (const VdbGridInfo& grid : list_vdb(input))
            if (is_float_grid(grid) && grid.grid_class == "level set" && grid.active_voxels > 0)
                all.push_back({grid.name, read_vdb(name.path, grid.name)});
    if (all.empty()) all.push_back({name.grid.empty() ? "surface" : name.grid, read_vdb_level_set(input, run)});
    return all;
}

std::size_t owner_of(const std::vector<std::string>& level_sets, const std::string& flag, const Named& given,
                     const std::string& value) {
    if (given.name.empty() && level_sets.size() == 1) return 0;
    const auto at = std::find(level_sets.begin(), level_sets.end(), given.name);
    if (at != level_sets.end()) return std::size_t(at - level_sets.begin());
    std::string names;
    for (const std::string& name : level_sets) names += (names.empty() ? "" : ", ") + name;
    throw UsageError(flag + ": expected NAME=" + value + " with a level set of the file (" + names + "), got " +
                     (given.name.empty() ? given.value : given.name + "=" + given.value));
}

}  // namespace covol::tool
