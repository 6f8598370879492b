#pragma once
#include <string>
#include <vector>

#include "io/dicom/dicom_slices.h"

namespace covol::detail {

/// The planes that form one volume, one of possibly several in a series.
struct DicomVolume {
    std::vector<DicomSlice> slices;
    std::string name;  ///< distinguishes the volume from the others of the series, for example "time 2, echo 4.6"
};

/// All planes of the series in a folder, or of the series that a file belongs to. @throws Error InvalidInput (no
/// series), Unsupported (several series, which the message lists), Io, Cancelled.
std::vector<DicomSlice> read_dicom_series(const std::string& path, const RunContext& run);

/// The volumes of a series. Its planes are separated by orientation and stack, and by time and echo if several planes
/// have the same position. @throws Error Unsupported (planes of different sizes; different orientations if each plane
/// is a file).
std::vector<DicomVolume> dicom_volumes(const std::string& path, std::vector<DicomSlice> slices);

/// Sorts a volume's planes by position or, if they have none, by their order in the file or by InstanceNumber. Sets
/// geometry, spacing_known and fields of `info`. @throws Error InvalidInput (gaps; only some of the planes have a
/// position), Unsupported.
void place_dicom_volume(const std::string& path, DicomVolume& volume, ImageInfo& info);

}  // namespace covol::detail
