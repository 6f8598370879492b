#pragma once
#include <map>
#include <string>

namespace covol::painted {

/// The names that 3D Slicer's segmentations (.seg.nrrd) assign to label values: SegmentN_Name, SegmentN_LabelValue.
/// Empty for other files, and for those that cannot be read.
[[nodiscard]] std::map<int, std::string> segment_names(const std::string& path);

}  // namespace covol::painted
