#pragma once
#include <map>
#include <string>

#include "covol/vdb_io.h"
#include "flags/bindings.h"

namespace covol::tool {

/// Help text of --density.
inline constexpr const char* kDensityHelp =
    "the solid as a fog volume, 0 to 1; with the same name as -o, that file contains both grids";

/// How .vdb files are written.
struct VdbFlags : Given<WriteVdbOptions> {
    void bind(CLI::App& command) { bind_options(command, *this, Offered::Always); }
    /// @throws UsageError if an option of .vdb files is given, but none is written.
    void check_used(bool writes) const {
        if (!writes && !names.empty())
            throw UsageError(flag_of(*names.begin()) +
                             ": it applies to .vdb files only, and this run writes none; write one, or leave it out");
    }
    [[nodiscard]] WriteVdbOptions with(const std::map<std::string, std::string>& metadata) const {
        return {options.half, metadata, options.compression};
    }
};

}  // namespace covol::tool
