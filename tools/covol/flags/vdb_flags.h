#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "covol/vdb_io.h"

namespace covol::tool {

/// Of --density.
inline constexpr const char* kDensityHelp =
    "the solid as a fog volume, 0 to 1; with the name that -o has, both grids are in that file";

/// How .vdb files are written.
struct VdbFlags {
    WriteVdbOptions options;
    void bind(CLI::App& command);
    [[nodiscard]] WriteVdbOptions with(const std::map<std::string, std::string>& metadata) const {
        return {options.half, metadata, options.compression};
    }
};

}  // namespace covol::tool
