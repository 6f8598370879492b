#pragma once
#include <string>

namespace covol::detail {

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
