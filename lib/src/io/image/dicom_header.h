#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace covol::detail {

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
