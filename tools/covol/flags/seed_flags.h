#pragma once
#include <string>
#include <vector>

#include "flags/bindings.h"

namespace covol::tool {

/// Positions that are known to be inside or outside: --inside and --outside.
struct SeedFlags {
    std::vector<std::string> inside, outside;  ///< files or world positions x,y,z; NAME=... for one structure

    void bind(CLI::App& command, bool names);
};

/// Adds the argument of --inside or --outside: a position, or a file.
void add_seed(const std::string& flag, const std::string& text, std::vector<std::string>& files,
              std::vector<PointCloud>& clouds);

}  // namespace covol::tool
