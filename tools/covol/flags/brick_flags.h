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
/// The same for a brick with this number of voxels, which is solved with layers of its neighbours.
[[nodiscard]] double memory_of_brick(double active_voxels);
/// Memory for joining the bricks of such a band, without and with the whole mesh, bytes.
[[nodiscard]] double memory_of_joined(double active_voxels);
[[nodiscard]] double memory_of_joined_mesh(double active_voxels);

}  // namespace covol::tool
