#pragma once
#include <string>

#include "covol/api.h"

namespace covol {

/// What tells one input from another of the same name: "xxh128:HEX" of the file, as xxh128sum prints it; of one above
/// 64 MiB "xxh128-of-pieces:HEX", of 64 pieces of 1 MiB that lie evenly from its first byte to its last; of a folder,
/// such as a Zarr store, "xxh128-of-metadata:HEX", of the .zarray, .zattrs, .zgroup and zarr.json in it, by their
/// paths.
/// @throws Error Io.
[[nodiscard]] COVOL_API std::string digest_of(const std::string& path);

/// Of a file of these bytes.
[[nodiscard]] COVOL_API std::string digest_of_bytes(const std::string& bytes);

}  // namespace covol
