#pragma once
#include <map>
#include <string>
#include <vector>

#include "covol/fwd.h"

namespace covol {

struct WriteVdbOptions {
    bool half = false;                            ///< values as 16-bit floats
    std::map<std::string, std::string> metadata;  ///< provenance, stored in the file and on every grid
};

/// Writes the grids in order, with statistics metadata and creator "covol VERSION".
/// Whole or not at all. @throws Error Io, InvalidInput (names empty or not unique).
void write_vdb(const std::string& path, const std::vector<FloatGridPtr>& grids, const WriteVdbOptions& options = {});

/// The grid of that name, or with an empty name the file's first float grid.
/// @throws Error Io, InvalidInput (no such grid; not a float grid: says which grids there are).
[[nodiscard]] FloatGridPtr read_vdb(const std::string& path, const std::string& name = {});

/// One line per grid for people and for `covol info`.
struct VdbGridInfo {
    std::string name, type, grid_class;
    double voxel_size = 0;
    bool uniform = true;
    std::uint64_t active_voxels = 0;
    Index3 min{}, max{};
    std::map<std::string, std::string> metadata;
};
[[nodiscard]] std::vector<VdbGridInfo> list_vdb(const std::string& path);

}  // namespace covol
