#pragma once
#include <memory>

#include "io/chunked/zarr_array.h"

namespace covol::detail {

/// The chunks of one channel and frame. Dimensions that are not in `axes` must have a single element.
std::shared_ptr<const ChunkSource> zarr_chunks(const ZarrArray& array, const ArrayAxes& axes, const Index3& size,
                                               std::uint64_t channel, std::uint64_t frame);

}  // namespace covol::detail
