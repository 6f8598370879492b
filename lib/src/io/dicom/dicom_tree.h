#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

// DICOM files that hold no pixels: all that lies in sequences counts.
namespace covol::detail {

/// The elements of a file or an item, by their tags; views of the file's bytes, which must outlive it.
struct DicomTree {
    std::map<std::uint32_t, std::string_view> values;
    std::map<std::uint32_t, std::vector<DicomTree>> sequences;  ///< those that were asked for

    /// Without padding; empty when there is none.
    [[nodiscard]] std::string_view text(std::uint32_t tag) const;
    /// The items of a sequence; none when there is none.
    [[nodiscard]] const std::vector<DicomTree>& items(std::uint32_t tag) const;
};

/// Reads a file after PS3.10 and PS3.5: little-endian, with explicit or implicit VR, with or without preamble and meta
/// group. Every length is checked against the bytes that are there.
/// @param wanted  the sequences that are kept; without explicit VR also those that are told by their tags alone
/// @throws Error InvalidInput (no DICOM; damaged, with the byte), Unsupported (big-endian, deflated).
DicomTree parse_dicom(const std::string& path, std::string_view bytes, const std::vector<std::uint32_t>& wanted);

}  // namespace covol::detail
