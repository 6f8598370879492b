#pragma once
#include <string>

#include "covol/api.h"

namespace covol {

/// Distinguishes inputs of the same name: "xxh128:HEX" of the file, as xxh128sum prints it; for a file above 64 MiB
/// "xxh128-of-pieces:HEX", of 64 pieces of 1 MiB that are evenly spaced from its first byte to its last; for a folder,
/// such as a Zarr store, "xxh128-of-metadata:HEX", of the .zarray, .zattrs, .zgroup and zarr.json in it, ordered by
/// their paths.
/// @throws Error Io.
[[nodiscard]] COVOL_API std::string digest_of(const std::string& path);

/// The digest of a file with these bytes.
[[nodiscard]] COVOL_API std::string digest_of_bytes(const std::string& bytes);

}  // namespace covol
