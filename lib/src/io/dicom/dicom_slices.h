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
    std::size_t frame = 0;                ///< index of the frame in the file
    std::size_t file_frames = 1;          ///< number of frames in the file
    Index3 size{};                        ///< number of columns, number of rows, 1
    /// Distance between neighbouring columns and between rows, in mm; 0 if the file does not state it.
    std::array<double, 2> step{};
    Vec3 origin{};
    Matrix3 direction{};      ///< the third column is the normal of the plane
    bool has_origin = false;  ///< whether the file states the position or the offset of this plane
    /// Distance to the next plane in mm, for files that state it instead of positions; 0 if unknown.
    double gap = 0;
    std::string gap_field;          ///< the element that states the distance, offset or location
    double number = 0;              ///< the element InstanceNumber, by which slices without a position are sorted
    std::string time, echo, stack;  ///< which of several volumes this plane belongs to; empty if not stated
    unsigned components = 1;
    PixelType type = PixelType::UInt8;  ///< type of the pixels after rescaling
    PixelType decoded_type = PixelType::UInt8;
    /// Whether the pixels are uncompressed, and are read with `place` and `unused_bits`; otherwise GDCM reads the file.
    bool plain = false;
    PixelPlace place;                 ///< position of the pixels, with the slope and intercept of the rescaling
    int unused_bits = 0;              ///< number of unused upper bits in each stored value
    double slope = 1, intercept = 0;  ///< pixel = slope * decoded + intercept, for pixels that GDCM decodes
};

/// For each file, its planes in the file's order, or the error that explains why it cannot be read.
/// @throws Error Cancelled, Io (GDCM's module is missing).
std::vector<std::variant<std::vector<DicomSlice>, Error>> read_dicom_slices(const std::vector<std::string>& paths,
                                                                            const RunContext& run);

}  // namespace covol::detail
