// Reads a level set from a .vdb file, which may also contain other grids.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/ValueTransformer.h>

#include <algorithm>

#include "base/number.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/vdb_io.h"

namespace covol {
namespace {

/// The name of the level set that is used if the user names none; empty if there is no suitable grid.
std::string choose_level_set(const std::string& path, const RunContext& run) {
    std::vector<std::string> level_sets, others;
    for (const VdbGridInfo& grid : list_vdb(path)) {
        if (!grid.type.starts_with(FloatGrid::gridType()) || grid.grid_class == "fog volume") continue;
        (grid.grid_class == "level set" ? level_sets : others).push_back(grid.name);
    }
    const bool has_surface = std::find(level_sets.begin(), level_sets.end(), "surface") != level_sets.end();
    if (level_sets.empty()) std::swap(level_sets, others);
    if (level_sets.empty()) return {};
    const std::string chosen = has_surface ? "surface" : level_sets.front();
    if (level_sets.size() > 1) {
        std::string list;
        for (const std::string& name : level_sets) list += (list.empty() ? "" : ", ") + name;
        const bool last = level_sets.back() != chosen;
        run.warn(path + ": '" + chosen + "' is used, one of the level sets " + list + "; choose another with " + path +
                 ":" + (last ? level_sets.back() : level_sets.front()));
    }
    return chosen;
}

/// The minimum and maximum of all values of the grid, including tiles, inactive voxels and the background.
std::array<float, 2> range_of(const FloatGrid& grid) {
    std::array<float, 2> range{grid.background(), grid.background()};
    for (auto value = grid.cbeginValueAll(); value; ++value) {
        range[0] = std::min(range[0], *value);
        range[1] = std::max(range[1], *value);
    }
    return range;
}

/// Converts an indicator, which is 0 outside and 2 * `half` inside, to a level set: values above `half` become
/// negative, that is, inside.
void make_level_set(FloatGrid& grid, float half) {
    const auto h = float(domain_of(grid).voxel_size);
    openvdb::tools::dilateActiveValues(grid.tree(), 2, openvdb::tools::NN_FACE_EDGE_VERTEX);
    const auto turn = [&](float value) { return (half - value) / half * h; };
    openvdb::tools::foreach (grid.beginValueAll(),
                             [&](const FloatGrid::ValueAllIter& value) { value.setValue(turn(*value)); });
    grid.tree().root().setBackground(turn(0), /*updateChildNodes=*/true);
    grid.setGridClass(openvdb::GRID_LEVEL_SET);
}

}  // namespace

FloatGridPtr read_vdb_level_set(const std::string& path, const RunContext& run) {
    std::string chosen = split_grid_name(path).grid;
    if (chosen.empty()) chosen = choose_level_set(path, run);
    FloatGridPtr grid = read_vdb(path, chosen);
    if (grid->getGridClass() == openvdb::GRID_FOG_VOLUME)
        throw Error(Errc::Unsupported,
                    path + ": grid '" + grid->getName() + "': expected a level set, got a fog volume");
    if (grid->getGridClass() == openvdb::GRID_LEVEL_SET || grid->background() != 0) return grid;
    const auto [minimum, maximum] = range_of(*grid);
    if (minimum < 0 || !(maximum > 0)) return grid;
    run.warn(path + ": grid '" + grid->getName() + "' has no class and values from 0 to " + detail::number(maximum) +
             ", like an indicator function of the inside: its boundary is placed at " + detail::number(maximum / 2));
    make_level_set(*grid, maximum / 2);
    return grid;
}

}  // namespace covol
