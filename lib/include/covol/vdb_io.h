#pragma once
#include <map>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/options_table.h"
#include "covol/run.h"

namespace covol {

/// Compression of the values of a .vdb file. Blosc is the fastest, and the default of OpenVDB's own programs; programs
/// that were built without Blosc fail on such a file, or crash. Zip only affects grids that are neither level sets nor
/// fog volumes, because OpenVDB leaves those uncompressed.
enum class VdbCompression { None, Zip, Blosc };
template <>
inline constexpr auto kWords<VdbCompression> = std::array{"none", "zip", "blosc"};

struct WriteVdbOptions {
    bool half = false;                            ///< values are stored as 16-bit floats
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

/// Writes grids as NanoVDB, for viewers and GPUs: values are uncompressed floats, and only the name, class, transform
/// and values of a grid are stored. covol does not read such files. The file is written completely or not at all.
/// @throws Error as write_vdb; Unsupported (covol was built without NanoVDB's headers).
COVOL_API void write_nvdb(const std::string& path, const std::vector<FloatGridPtr>& grids);

/// A grid as the user gives it, "FILE.vdb:name".
struct VdbGridName {
    /// `grid` is empty if no name is given, or if the whole text is the name of an existing file
    std::string path, grid;
};
[[nodiscard]] COVOL_API VdbGridName split_grid_name(const std::string& text);

/// Reads the grid with that name; if it is empty, the grid named in the path ("FILE.vdb:name"), else the first float
/// grid.
/// @throws Error Io, InvalidInput (no such grid; not a float grid: the message lists the existing grids).
[[nodiscard]] COVOL_API FloatGridPtr read_vdb(const std::string& path, const std::string& name = {});

/// Reads the grid named in the path ("FILE.vdb:name"), else "surface", else the file's first level set, else its first
/// float grid that is not a fog volume. If there are several candidates, a warning lists their names.
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
/// Properties of all grids, or of the grid named in the path ("FILE.vdb:name"). @throws as read_vdb.
[[nodiscard]] COVOL_API std::vector<VdbGridInfo> list_vdb(const std::string& path);

}  // namespace covol
