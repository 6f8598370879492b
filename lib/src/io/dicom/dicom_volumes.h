#pragma once
#include <string>
#include <vector>

#include "io/dicom/dicom_slices.h"

namespace covol::detail {

/// Planes of one lattice.
struct DicomVolume {
    std::vector<DicomSlice> slices;
    std::string name;  ///< what tells it from the other volumes of the series: "time 2, echo 4.6"
};

/// All planes of the series in a folder, or of the one that a file belongs to.
/// @throws Error InvalidInput (none), Unsupported (several: lists them), Io, Cancelled.
std::vector<DicomSlice> read_dicom_series(const std::string& path, const RunContext& run);

/// The volumes of a series: its planes by orientation and stack, and by time and echo where several lie at one place.
/// @throws Error Unsupported (planes that differ in size, or in orientation where each is a file of its own).
std::vector<DicomVolume> dicom_volumes(const std::string& path, std::vector<DicomSlice> slices);

/// Sorts a volume's planes by their positions, and fills geometry, spacing_known and fields by them.
/// @throws Error InvalidInput (gaps, planes without position among others with one), Unsupported.
void place_dicom_volume(const std::string& path, DicomVolume& volume, ImageInfo& info);

}  // namespace covol::detail
