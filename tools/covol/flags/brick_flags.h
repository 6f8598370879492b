#pragma once
#include <cstdint>
#include <optional>

#include "covol/bricks.h"
#include "flags/bindings.h"

namespace covol::tool {

/// How a job is split, by `covol brick` and because of --memory-limit.
struct BrickFlags : Given<BrickOptions> {
    std::optional<std::int64_t> max_voxels;

    void bind(CLI::App& command);
    /// @param memory  bytes available for one brick; nullopt: the default size is used
    [[nodiscard]] BrickOptions resolve(std::optional<std::uint64_t> memory) const;
};

/// Memory for solving a band of that many voxels, including the program itself, bytes.
[[nodiscard]] double memory_of_band(double active_voxels);
/// The same for joining bricks, without and with the mesh.
[[nodiscard]] double memory_of_joined(double active_voxels);
[[nodiscard]] double memory_of_joined_mesh(double active_voxels);

}  // namespace covol::tool
