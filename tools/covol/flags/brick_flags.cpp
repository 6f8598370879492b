#include "flags/brick_flags.h"

#include <algorithm>
#include <cmath>

namespace covol::tool {
namespace {

// Memory in bytes; measured, see docs/benchmarks_speed.md, Bricks.
constexpr double kBandBytes = 200;    ///< peak memory for each voxel of a band that is solved
constexpr double kJoinBytes = 30;     ///< peak memory for each voxel of a band whose bricks are joined
constexpr double kMeshBytes = 80;     ///< peak memory for each voxel if bricks are joined and the whole mesh is made
constexpr double kBaseBytes = 1.5e8;  ///< memory of the program itself
constexpr double kLayerFactor = 1.3;  ///< ratio of the voxels of a brick with and without the layers of its neighbours
constexpr double kMinVoxels = 2e5;

}  // namespace

double memory_of_band(double active_voxels) { return kBaseBytes + kBandBytes * active_voxels; }
double memory_of_brick(double active_voxels) { return memory_of_band(kLayerFactor * active_voxels); }

double memory_of_joined(double active_voxels) { return kBaseBytes + kJoinBytes * active_voxels; }
double memory_of_joined_mesh(double active_voxels) { return kBaseBytes + kMeshBytes * active_voxels; }

void BrickFlags::bind(CLI::App& command) {
    in_group(command, Group::Numerics);
    command
        .add_option("--brick-voxels", max_voxels,
                    "maximum number of band voxels in a brick, for covol brick and for runs that exceed --memory-limit "
                    "[8000000, or what --memory-limit allows]")
        ->check(CLI::Range(std::int64_t(1000), std::int64_t(1) << 40).description(""))
        ->type_name("N");
    bind_options(command, *this, Offered::Always);
}

BrickOptions BrickFlags::resolve(std::optional<std::uint64_t> memory) const {
    BrickOptions resolved = options;
    if (memory)
        resolved.max_voxels =
            std::llround(std::max(kMinVoxels, (double(*memory) - kBaseBytes) / (kBandBytes * kLayerFactor)));
    if (max_voxels) resolved.max_voxels = *max_voxels;
    return resolved;
}

}  // namespace covol::tool
