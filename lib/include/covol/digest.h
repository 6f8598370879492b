#pragma once
#include <string>

#include "covol/api.h"

namespace covol {

/// A digest of the content, which distinguishes inputs of the same name: "xxh128:HEX" of a file, as xxh128sum prints
/// it; "xxh128-of-pieces:HEX" of a file above 64 MiB, from 64 evenly spaced pieces of 1 MiB, which include its first
/// and last byte; "xxh128-of-metadata:HEX" of a folder such as a Zarr store or a study, from its files .zarray,
/// .zattrs, .zgroup, zarr.json and journal.jsonl, ordered by their paths; "xxh128-of-files:HEX" of a folder without
/// these files, such as a DICOM series, from the names, sizes and contents of its DICOM images, or of all files in it
/// if there are none, but never of segmentations, structure sets and other DICOM objects without an image; if these
/// files have more than 64 MiB in total, only the first and last bytes of each are used.
/// @throws Error Io.
[[nodiscard]] COVOL_API std::string digest_of(const std::string& path);

/// The digest that digest_of() returns for a file with these bytes.
[[nodiscard]] COVOL_API std::string digest_of_bytes(const std::string& bytes);

}  // namespace covol
