#pragma once
#include <string>
#include <vector>

#include "flags/bindings.h"

namespace covol::tool {

/// Positions whose side is known: --inside and --outside.
struct SeedFlags {
    std::vector<std::string> inside, outside;  ///< files, or x,y,z in the world; with NAME= of one structure

    void bind(CLI::App& command, bool names);
};

/// Adds what --inside or --outside names: a position, or a file.
void add_seed(const std::string& flag, const std::string& text, std::vector<std::string>& files,
              std::vector<PointCloud>& clouds);

}  // namespace covol::tool
