#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

// A parser for DICOM files whose contents are in sequences, not in pixels, such as RT structure sets.
namespace covol::detail {

/// The elements of a file or an item, by their tags. The values refer to the bytes of the file, which must outlive this
/// object.
struct DicomTree {
    std::map<std::uint32_t, std::string_view> values;
    std::map<std::uint32_t, std::vector<DicomTree>> sequences;  ///< only the requested sequences

    /// The text of an element without padding; empty if there is no such element.
    [[nodiscard]] std::string_view text(std::uint32_t tag) const;
    /// The items of a sequence; empty if there is no such sequence.
    [[nodiscard]] const std::vector<DicomTree>& items(std::uint32_t tag) const;
};

/// Reads a file as specified in PS3.10 and PS3.5: little-endian, with explicit or implicit VR, with or without preamble
/// and meta group. Every length is checked against the number of bytes in the file.
/// @param wanted  the tags of the sequences to keep; with implicit VR, sequences of known length are recognized only by
/// these tags
/// @throws Error InvalidInput (not DICOM; damaged, with the position of the byte), Unsupported (big-endian, deflated).
DicomTree parse_dicom(const std::string& path, std::string_view bytes, const std::vector<std::uint32_t>& wanted);

}  // namespace covol::detail
