#pragma once
#include <cstdint>
#include <optional>

#include "covol/bricks.h"
#include "flags/bindings.h"

namespace covol::tool {

/// How a job is split, by `covol brick` and where --memory-limit asks for it.
struct BrickFlags : Given<BrickOptions> {
    std::optional<std::int64_t> max_voxels;

    void bind(CLI::App& command);
    /// @param memory  bytes that a brick may take; none: the default's size
    [[nodiscard]] BrickOptions resolve(std::optional<std::uint64_t> memory) const;
};

/// Memory that solving so many voxels of a band takes, with the program itself, bytes.
[[nodiscard]] double memory_of_band(double active_voxels);
/// The same of joining bricks, without the mesh and with it.
[[nodiscard]] double memory_of_joined(double active_voxels);
[[nodiscard]] double memory_of_joined_mesh(double active_voxels);

}  // namespace covol::tool
