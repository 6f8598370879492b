#pragma once
#include <map>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// Compression of the values of a .vdb file. Blosc is the fastest, and the default of OpenVDB's own programs; a reader
/// that was built without it fails on such a file, or crashes. Zip only affects grids that are neither level sets nor
/// fog volumes, because OpenVDB leaves those uncompressed.
enum class VdbCompression { None, Zip, Blosc };
template <>
inline constexpr auto kWords<VdbCompression> = std::array{"none", "zip", "blosc"};

struct WriteVdbOptions {
    bool half = false;                            ///< values as 16-bit floats
    std::map<std::string, std::string> metadata;  ///< provenance, stored in the file and on every grid
    VdbCompression compression = VdbCompression::Blosc;
};

template <>
inline constexpr auto kOptions<WriteVdbOptions> =
    std::tuple{Option{"half", &WriteVdbOptions::half, Group::Output, "store values in .vdb files as 16-bit floats"},
               Option{"compression", &WriteVdbOptions::compression, Group::Output,
                      "compression of .vdb files: zip and none can also be read by programs without Blosc, or with "
                      "another version of it; with zip, OpenVDB leaves level sets and fog volumes uncompressed"}};

/// Writes the grids in order, with statistics metadata and creator "covol VERSION".
/// The file is written completely or not at all. @throws Error Io, InvalidInput (names empty or not unique).
COVOL_API void write_vdb(const std::string& path, const std::vector<FloatGridPtr>& grids,
                         const WriteVdbOptions& options = {});

/// NanoVDB, for viewers and GPUs: the same grids, values as floats, uncompressed and without metadata; only the name,
/// class, transform and values of a grid are kept. covol does not read such files. The file is written completely or
/// not at all. @throws Error as write_vdb; Unsupported (covol was built without NanoVDB's headers).
COVOL_API void write_nvdb(const std::string& path, const std::vector<FloatGridPtr>& grids);

/// A grid as the user gives it, "FILE.vdb:name".
struct VdbGridName {
    std::string path, grid;  ///< no grid if none is given, or if a file with the whole text as its name exists
};
[[nodiscard]] COVOL_API VdbGridName split_grid_name(const std::string& text);

/// The grid of that name; with an empty name the one in the path ("FILE.vdb:name"), else the file's first float grid.
/// @throws Error Io, InvalidInput (no such grid; not a float grid: lists the grids that exist).
[[nodiscard]] COVOL_API FloatGridPtr read_vdb(const std::string& path, const std::string& name = {});

/// The level set in the path ("FILE.vdb:name"); else "surface", else the file's first level set, else its first float
/// grid that is not a fog volume. Warns, with their names, if a file has several to choose from.
/// @throws Error as read_vdb; Unsupported (a fog volume).
[[nodiscard]] COVOL_API FloatGridPtr read_vdb_level_set(const std::string& path, const RunContext& run = {});

/// Properties of a grid, which `covol info` prints in one line.
struct VdbGridInfo {
    std::string name, type, grid_class;
    double voxel_size = 0;
    bool uniform = true;
    std::uint64_t active_voxels = 0;
    Index3 min{}, max{};
    std::map<std::string, std::string> metadata;
    std::string compression;  ///< "none", "zip" or "blosc"
};
/// All grids, or the one in the path ("FILE.vdb:name"). @throws as read_vdb.
[[nodiscard]] COVOL_API std::vector<VdbGridInfo> list_vdb(const std::string& path);

}  // namespace covol
