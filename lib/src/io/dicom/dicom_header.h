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

/// Tag (group << 16 | element) to bytes; long ones are left out.
using DicomValues = std::map<std::uint32_t, std::string>;

/// The elements of a DICOM file outside its sequences, those of its functional groups (PS3.3 C.7.6.16), and where its
/// pixels lie.
struct DicomHeader {
    DicomValues values;
    DicomValues shared;               ///< functional groups of all frames, and what else says where frames lie
    std::vector<DicomValues> frames;  ///< functional groups of each frame, in the file's order
    bool big_endian = false;
    bool encapsulated = false;       ///< compressed
    std::uint64_t pixel_offset = 0;  ///< in the file
    std::uint64_t pixel_bytes = 0;   ///< 0 when encapsulated

    /// Without padding; empty when there is none. With a frame's number, what holds for that frame: its own functional
    /// groups come first, then those of all frames, then the elements outside sequences.
    [[nodiscard]] std::string text(std::uint32_t tag, std::optional<std::size_t> frame = std::nullopt) const;
    /// Decimal strings, one for each value; empty when there is none, or one is no finite number.
    [[nodiscard]] std::vector<double> numbers(std::uint32_t tag, std::optional<std::size_t> frame = std::nullopt) const;
    /// Binary numbers of double precision (VR FD); empty when there is none, or one is not finite.
    [[nodiscard]] std::vector<double> doubles(std::uint32_t tag, std::optional<std::size_t> frame = std::nullopt) const;
    /// A number of 16 or 32 bits (VR US, UL).
    [[nodiscard]] std::optional<std::uint32_t> integer(std::uint32_t tag,
                                                       std::optional<std::size_t> frame = std::nullopt) const;

private:
    [[nodiscard]] const std::string* find(std::uint32_t tag, std::optional<std::size_t> frame) const;
};

/// Reads the elements of a file after PS3.10 and PS3.5, and checks that they follow each other up to the file's end:
/// lengths, value representations, nesting, order, and the numbers of the image pixel module. Debian's GDCM ends the
/// program where they do not, so it sees only files that pass. Empty when they do not, or there are no pixels. The
/// preamble and the meta group may be missing: the first element then says how the others are written.
std::optional<DicomHeader> read_dicom_header(const std::string& path);

/// What kind of object a file says to hold in its meta group (a SOP class, PS3.6 A); empty where it says nothing.
std::string dicom_class(const std::string& path);

/// RT structure sets: contours, no pixels.
inline constexpr const char* kRtStructureSet = "1.2.840.10008.5.1.4.1.1.481.3";
inline constexpr const char* kSegmentationStorage = "1.2.840.10008.5.1.4.1.1.66.4";

/// Whether the file has DICOM's mark behind a preamble, or begins with an element of the groups 0002 or 0008.
bool is_dicom(const std::string& path);

}  // namespace covol::detail
