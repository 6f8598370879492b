#pragma once
#include <string>
#include <vector>

#include "flags/bindings.h"

namespace covol::tool {

/// Positions whose side is known: --inside and --outside.
struct SeedFlags {
    std::vector<std::string> inside, outside;  ///< files, or x,y,z in the world; with NAME= of one structure

    void bind(CLI::App& command, bool names);
    [[nodiscard]] bool empty() const { return inside.empty() && outside.empty(); }
};

/// What they hold, world units.
struct Seeds {
    std::vector<Vec3> inside, outside;
};
/// Lines in files are scribbles, taken at points no farther apart than `step`. With an image, seeds outside it are an
/// error.
[[nodiscard]] Seeds read_seeds(const SeedFlags& flags, const ReadPointsOptions& reading, const ImageGeometry* geometry,
                               double step, const RunContext& run);

}  // namespace covol::tool
