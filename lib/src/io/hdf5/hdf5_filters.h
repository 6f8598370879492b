#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/chunked/zarr_store.h"

namespace covol::detail {

/// A filter that was applied to the chunks of a dataset.
struct Hdf5Filter {
    unsigned id = 0;
    std::vector<unsigned> values;  ///< parameters of the filter
    std::string name;
};

/// Whether undo_filters() supports the filters: shuffle, and at most one of gzip, LZF, Blosc, Zstandard and LZ4. Unlike
/// the HDF5 library, undo_filters() can be called by several threads at a time, and does not depend on the filters that
/// the library was built with.
bool can_undo(const std::vector<Hdf5Filter>& filters);

/// Reverses the filters, beginning with the last one. Sizes are checked before memory is allocated.
/// @param passed_over  bit mask of the filters that were not applied to this chunk
/// @throws Error InvalidInput, with `path`, unless the result has `expected` bytes.
Bytes undo_filters(const std::string& path, const std::vector<Hdf5Filter>& filters, unsigned passed_over, Bytes bytes,
                   std::uint64_t expected);

}  // namespace covol::detail
