#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace covol::detail {

/// Tags of the image pixel module, PS3.3 C.7.6.3.
inline constexpr std::uint32_t kSamples = 0x00280002, kRows = 0x00280010, kColumns = 0x00280011;
inline constexpr std::uint32_t kBitsAllocated = 0x00280100, kBitsStored = 0x00280101, kHighBit = 0x00280102;
inline constexpr std::uint32_t kRepresentation = 0x00280103;

/// The elements of a DICOM file outside its sequences, and where its pixels lie.
struct DicomHeader {
    std::map<std::uint32_t, std::string> values;  ///< tag (group << 16 | element) to bytes; long ones are left out
    bool big_endian = false;
    bool encapsulated = false;       ///< compressed
    std::uint64_t pixel_offset = 0;  ///< in the file
    std::uint64_t pixel_bytes = 0;   ///< 0 when encapsulated

    /// Without padding; empty when there is none.
    [[nodiscard]] std::string text(std::uint32_t tag) const;
    /// Decimal strings, one for each value; empty when there is none, or one is no finite number.
    [[nodiscard]] std::vector<double> numbers(std::uint32_t tag) const;
    /// A 16-bit number (VR US).
    [[nodiscard]] std::optional<std::uint32_t> integer(std::uint32_t tag) const;
};

/// Reads the elements of a file after PS3.10 and PS3.5, and checks that they follow each other up to the file's end:
/// lengths, value representations, nesting, order, and the numbers of the image pixel module. Debian's GDCM ends the
/// program where they do not, so it sees only files that pass. Empty when they do not, or there are no pixels.
std::optional<DicomHeader> read_dicom_header(const std::string& path);

}  // namespace covol::detail
