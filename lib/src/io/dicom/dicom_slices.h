#pragma once
#include <array>
#include <string>
#include <variant>
#include <vector>

#include "covol/error.h"
#include "io/modules/modules.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {

/// One plane of a DICOM file: the file's only one, or one of its frames.
struct DicomSlice {
    std::string path, series, description;
    std::string sop_class, sop_instance;  ///< what others refer to it by
    std::size_t frame = 0;                ///< in the file
    std::size_t file_frames = 1;          ///< how many the file has
    Index3 size{};                        ///< columns, rows, 1
    std::array<double, 2> step{};         ///< along columns and rows, in mm; 0: the file does not say
    Vec3 origin{};
    Matrix3 direction{};            ///< the third column is the plane's normal
    bool has_origin = false;        ///< the file says where this plane lies
    double gap = 0;                 ///< to the next plane, for files that say it instead of positions; 0: not known
    std::string gap_field;          ///< which element said it
    double number = 0;              ///< InstanceNumber
    std::string time, echo, stack;  ///< which volume of several this plane belongs to; empty: not said
    unsigned components = 1;
    PixelType type = PixelType::UInt8;  ///< of the rescaled pixels
    PixelType decoded_type = PixelType::UInt8;
    bool plain = false;               ///< read here: the fields below; else by GDCM
    PixelPlace place;                 ///< slope and intercept are the rescaling
    int unused_bits = 0;              ///< of each stored number, the upper ones
    double slope = 1, intercept = 0;  ///< from the decoded pixels to the rescaled ones
};

/// The planes of each file, in its order, or why it has none. @throws Error Cancelled, Io (GDCM's module is missing).
std::vector<std::variant<std::vector<DicomSlice>, Error>> read_dicom_slices(const std::vector<std::string>& paths,
                                                                            const RunContext& run);

}  // namespace covol::detail
