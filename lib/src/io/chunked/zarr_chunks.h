#pragma once
#include <memory>
#include <optional>

#include "io/chunked/zarr_array.h"
#include "io/pixels/chunks.h"

namespace covol::detail {

/// Which dimensions of an array are the axes x, y, z, and its channels and frames where it has them.
struct ZarrAxes {
    std::array<std::size_t, 3> space{};
    std::optional<std::size_t> channel, frame;
};

/// The chunks of one channel and frame. Dimensions that are no axes have one element.
std::shared_ptr<const ChunkSource> zarr_chunks(const ZarrArray& array, const ZarrAxes& axes, const Index3& size,
                                               std::uint64_t channel, std::uint64_t frame);

}  // namespace covol::detail
