#pragma once
#include <array>
#include <string>
#include <variant>
#include <vector>

#include "covol/error.h"
#include "io/modules/modules.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// One plane of a DICOM file: its only plane, or one of its frames.
struct DicomSlice {
    std::string path, series, description;
    std::string sop_class, sop_instance;  ///< UIDs by which other objects refer to the file
    std::size_t frame = 0;                ///< index in the file
    std::size_t file_frames = 1;          ///< number of frames in the file
    Index3 size{};                        ///< columns, rows, 1
    std::array<double, 2> step{};         ///< along columns and rows, in mm; 0 if the file does not state it
    Vec3 origin{};
    Matrix3 direction{};      ///< the third column is the normal of the plane
    bool has_origin = false;  ///< the file states the position or the offset of this plane
    double gap = 0;         ///< distance to the next plane, for files that state it instead of positions; 0 if unknown
    std::string gap_field;  ///< the element that states the distance, offset or location
    double number = 0;      ///< InstanceNumber
    std::string time, echo, stack;  ///< which of several volumes this plane belongs to; empty if not stated
    unsigned components = 1;
    PixelType type = PixelType::UInt8;  ///< after rescaling
    PixelType decoded_type = PixelType::UInt8;
    bool plain = false;               ///< uncompressed, read with the fields below; otherwise read by GDCM
    PixelPlace place;                 ///< position of the pixels, with the slope and intercept of the rescaling
    int unused_bits = 0;              ///< number of unused upper bits in each stored value
    double slope = 1, intercept = 0;  ///< pixel = slope * decoded + intercept, for pixels that GDCM decodes
};

/// For each file, its planes in the file's order, or the reason why it has none.
/// @throws Error Cancelled, Io (GDCM's module is missing).
std::vector<std::variant<std::vector<DicomSlice>, Error>> read_dicom_slices(const std::vector<std::string>& paths,
                                                                            const RunContext& run);

}  // namespace covol::detail
