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

/// The values of elements, as in the file, by their tags (group << 16 | element). Values of more than 4 KiB, such as
/// pixels, are omitted.
using DicomValues = std::map<std::uint32_t, std::string>;

/// The elements of a DICOM file outside its sequences, those of its functional groups (PS3.3 C.7.6.16), and the
/// position of its pixels.
struct DicomHeader {
    DicomValues values;
    DicomValues shared;  ///< functional groups of all frames, and other elements that give the positions of frames
    std::vector<DicomValues> frames;  ///< functional groups of each frame, in the file's order
    bool big_endian = false;
    bool encapsulated = false;       ///< the pixels are compressed, in fragments
    std::uint64_t pixel_offset = 0;  ///< position of the pixels in the file, in bytes
    std::uint64_t pixel_bytes = 0;   ///< size of the pixels in bytes; 0 if they are encapsulated

    /// The text of an element without padding; empty if the file has no such element. If a frame is given, its
    /// functional groups have priority over the shared functional groups, and these have priority over the elements
    /// outside of sequences.
    [[nodiscard]] std::string text(std::uint32_t tag, std::optional<std::size_t> frame = std::nullopt) const;
    /// The numbers of an element of decimal strings (VR DS, IS); empty if there is no such element, or if a value is
    /// not a finite number.
    [[nodiscard]] std::vector<double> numbers(std::uint32_t tag, std::optional<std::size_t> frame = std::nullopt) const;
    /// The numbers of an element in double precision (VR FD); empty if there is no such element, or if a value is not
    /// finite.
    [[nodiscard]] std::vector<double> doubles(std::uint32_t tag, std::optional<std::size_t> frame = std::nullopt) const;
    /// The number of an element with 16 or 32 bits (VR US, UL); nothing if there is no such element.
    [[nodiscard]] std::optional<std::uint32_t> integer(std::uint32_t tag,
                                                       std::optional<std::size_t> frame = std::nullopt) const;

private:
    [[nodiscard]] const std::string* find(std::uint32_t tag, std::optional<std::size_t> frame) const;
};

/// Reads the elements of a file as PS3.10 and PS3.5 specify, and checks the structure up to the end of the file:
/// lengths, value representations, nesting, order, and the elements of the image pixel module. Debian's GDCM terminates
/// the process on invalid files, so only files that pass these checks are given to it. The result is empty if a check
/// fails or there are no pixels. If the preamble and the meta group are missing, the first element determines the
/// encoding.
std::optional<DicomHeader> read_dicom_header(const std::string& path);

/// Whether the file has the marker "DICM" after a preamble, or begins with an element of the groups 0002 or 0008.
bool is_dicom(const std::string& path);

}  // namespace covol::detail
