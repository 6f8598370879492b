#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace covol::detail {

/// A DICOM file begins with a preamble of arbitrary bytes and this marker (PS3.10, 7.1).
inline constexpr std::size_t kDicomPreamble = 128;  // bytes
inline constexpr std::string_view kDicomMarker = "DICM";
/// [bytes] Position of the first element of a file with the marker.
inline constexpr std::size_t kFirstDicomElement = kDicomPreamble + kDicomMarker.size();

/// Whether a file that begins with these bytes, at least kFirstDicomElement of them, has the marker.
bool has_dicom_marker(std::string_view begin);

/// Whether a file is a regular file that can be read and has the marker.
bool is_marked_dicom(const std::string& path);

/// The kind of object according to the file's meta group (a SOP class, PS3.6 A); empty if it is not stated.
std::string dicom_class(const std::string& path);

/// SOP classes: RT structure sets, which contain contours but no pixels, and segmentations.
inline constexpr const char* kRtStructureSet = "1.2.840.10008.5.1.4.1.1.481.3";
inline constexpr const char* kSegmentationStorage = "1.2.840.10008.5.1.4.1.1.66.4";

/// Whether a file is a DICOM object without an image, or a segmentation. Such files are often stored in the folder of a
/// series, of which they are not slices: structure sets, plans, treatments, registrations, reports, presentations,
/// documents (PS3.4 B.5).
bool holds_no_image(const std::string& path);

}  // namespace covol::detail
