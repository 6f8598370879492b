#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

// Fields of the NIfTI-1 header. https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h
namespace covol::detail {

/// Names of NIfTI's units of length. The index is the code in the header; the code 0 means that the unit is not stated.
constexpr std::array<const char*, 4> kNiftiUnits{"", "m", "mm", "um"};

namespace nifti {
// Size of the header and positions of fields in it, in bytes.
constexpr std::size_t kHeader = 348, kPixdim = 76, kCodes = 252, kQuatern = 256, kSrow = 280;
}  // namespace nifti

/// The mapping of a file's voxels to the world.
struct NiftiSpace {
    std::array<std::int16_t, 2> codes{0, 0};  ///< qform_code, sform_code: the kind of world coordinates; 0: not stated
    float qfac = 1;                           ///< pixdim[0]: -1 if the qform reverses the third axis
    std::array<float, 6> qform{};             ///< quatern_b, c, d and qoffset_x, y, z
    std::array<float, 12> sform{};            ///< the rows srow_x, y, z
};

/// Reads the mapping of a .nii or .nii.gz file; nothing for other files, and for files that cannot be read.
[[nodiscard]] std::optional<NiftiSpace> read_nifti_space(const std::string& path);

}  // namespace covol::detail
