#pragma once
#include <string>
#include <vector>

#include "io/dicom/dicom_slices.h"

namespace covol::detail {

/// Planes of one lattice.
struct DicomVolume {
    std::vector<DicomSlice> slices;
    std::string name;  ///< distinguishes it from the other volumes of the series: "time 2, echo 4.6"
};

/// All planes of the series in a folder, or of the series that a file belongs to. @throws Error InvalidInput (none),
/// Unsupported (several: lists them), Io, Cancelled.
std::vector<DicomSlice> read_dicom_series(const std::string& path, const RunContext& run);

/// The volumes of a series. Its planes are separated by orientation and stack, and by time and echo if several planes
/// have the same position. @throws Error Unsupported (planes of different sizes, or of different orientations if each
/// is a file of its own).
std::vector<DicomVolume> dicom_volumes(const std::string& path, std::vector<DicomSlice> slices);

/// Sorts a volume's planes by position, and derives geometry, spacing_known and fields from them. @throws Error
/// InvalidInput (gaps, planes without a position among others with one), Unsupported.
void place_dicom_volume(const std::string& path, DicomVolume& volume, ImageInfo& info);

}  // namespace covol::detail
