#pragma once
#include <string>

namespace covol::detail {

/// Whether the elements of a DICOM file follow each other as PS3.5 has it, up to its end: lengths, value
/// representations, nesting, order. Debian's GDCM ends the program where they do not.
bool is_sound_dicom(const std::string& path);

}  // namespace covol::detail
