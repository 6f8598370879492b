#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/chunked/zarr_store.h"

namespace covol::detail {

/// A filter that was applied to the chunks of a dataset.
struct Hdf5Filter {
    unsigned id = 0;
    std::vector<unsigned> values;  ///< its parameters
    std::string name;
};

/// Whether undo_filters() supports all of them: shuffle, and at most one of gzip, LZF, Blosc, Zstandard and LZ4. It
/// works in parallel, whereas the library uses a single thread and supports only some of these filters.
bool can_undo(const std::vector<Hdf5Filter>& filters);

/// Reverses the filters, the last first. Sizes are checked before memory is allocated.
/// @param passed_over  a bit for each filter that was not applied to this chunk
/// @throws Error InvalidInput, with `path`, unless the result has `expected` bytes.
Bytes undo_filters(const std::string& path, const std::vector<Hdf5Filter>& filters, unsigned passed_over, Bytes bytes,
                   std::uint64_t expected);

}  // namespace covol::detail
