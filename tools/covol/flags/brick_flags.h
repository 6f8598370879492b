#pragma once
#include <cstdint>
#include <optional>

#include "covol/bricks.h"
#include "flags/bindings.h"

namespace covol::tool {

/// How a job is split into bricks, by `covol brick` or because of --memory-limit.
struct BrickFlags : Given<BrickOptions> {
    std::optional<std::int64_t> max_voxels;

    void bind(CLI::App& command);
    /// @param memory  bytes available for one brick; nullopt: the default size is used
    [[nodiscard]] BrickOptions resolve(std::optional<std::uint64_t> memory) const;
};

/// Memory for solving a band with this number of voxels, including the program itself, bytes.
[[nodiscard]] double memory_of_band(double active_voxels);
/// Memory for solving a brick with this number of band voxels, which is solved together with layers of its neighbours,
/// bytes.
[[nodiscard]] double memory_of_brick(double active_voxels);
/// Memory for joining the solved bricks of a band with this number of voxels, bytes. The first function is for a job
/// that does not hold the whole mesh, the second for one that does.
[[nodiscard]] double memory_of_joined(double active_voxels);
[[nodiscard]] double memory_of_joined_mesh(double active_voxels);

}  // namespace covol::tool
