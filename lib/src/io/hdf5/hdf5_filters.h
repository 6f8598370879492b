#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/chunked/zarr_store.h"

namespace covol::detail {

/// A filter that the chunks of a dataset went through.
struct Hdf5Filter {
    unsigned id = 0;
    std::vector<unsigned> values;  ///< its parameters
    std::string name;
};

/// Whether undo_filters() knows them all: shuffle, and at most one of gzip, LZF, Blosc, Zstandard and LZ4. What it does
/// in parallel the library would do in one thread alone, and some of them not at all.
bool can_undo(const std::vector<Hdf5Filter>& filters);

/// Undoes them, the last first. Sizes are compared before memory is taken.
/// @param passed_over  a bit for each filter that this chunk did not go through
/// @throws Error InvalidInput, with `path`, unless that gives `expected` bytes.
Bytes undo_filters(const std::string& path, const std::vector<Hdf5Filter>& filters, unsigned passed_over, Bytes bytes,
                   std::uint64_t expected);

}  // namespace covol::detail
