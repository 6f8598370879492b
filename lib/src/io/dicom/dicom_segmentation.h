#pragma once
#include <string>

#include "covol/image_stream.h"

namespace covol::detail {

/// A DICOM segmentation (SEG, PS3.3 A.51): binary, one segment for each label, with frames only for slices in which the
/// label has voxels. If options.like is a DICOM series, the patient, the study and the frame of reference are taken
/// from it, and each frame refers to the source instance at its slice. @throws Error Unsupported (values that are not
/// labels, rows and columns that are not perpendicular, more than 4 GB of packed voxels), Io.
void write_dicom_segmentation(const std::string& path, const PixelSource& source, const WriteImageOptions& options,
                              const RunContext& run);

/// Converts sRGB to CIELab with the white point D50, in 16 bits per component as DICOM stores it (PS3.3 C.10.7.1.1).
std::array<std::uint16_t, 3> to_cielab(const std::array<std::uint8_t, 3>& color);

}  // namespace covol::detail
