#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "covol/fwd.h"

// Encodes the elements of DICOM files for writing: PS3.5 7.1, 7.5, and PS3.10 7.1.
namespace covol::detail {

/// The elements of a file or of an item of a sequence, sorted by tag (group << 16 | element).
class DicomItem {
public:
    /// Adds an element, or replaces the element with the same tag.
    /// @param vr  the value representation, two letters
    /// @param bytes  the value as in the file; put() pads it to an even length
    void put(std::uint32_t tag, const char* vr, std::string bytes);
    /// Numbers of 16 bits.
    void put_shorts(std::uint32_t tag, const std::vector<std::uint16_t>& values);
    /// Numbers of 32 bits (VR UL).
    void put_longs(std::uint32_t tag, const std::vector<std::uint32_t>& values);
    /// An element whose value is a tag (VR AT).
    void put_tag(std::uint32_t tag, std::uint32_t value);
    /// Numbers as decimal texts (VR DS).
    void put_decimals(std::uint32_t tag, const std::vector<double>& values);
    void put_items(std::uint32_t tag, const std::vector<DicomItem>& items);
    /// Adds the elements of another item; they replace elements with the same tags.
    void add(const DicomItem& other);

    /// The bytes of all elements one after another, little-endian. @param with_vr  whether the encoding is explicit VR;
    /// otherwise it is implicit VR
    [[nodiscard]] std::string encoded(bool with_vr) const;

private:
    struct Element {
        std::string vr, bytes;
        std::vector<DicomItem> items;  ///< items of a sequence
    };
    std::map<std::uint32_t, Element> elements_;
};

/// Whether an element with this explicit VR has two reserved bytes and a length of 32 bits after the VR.
[[nodiscard]] bool is_long_vr(std::string_view vr);

/// An item with a coded term: the code, its coding scheme and its meaning.
[[nodiscard]] DicomItem dicom_code(const char* value, const char* scheme, const char* meaning);

/// Converts Latin-1 (ISO 8859-1) to UTF-8.
[[nodiscard]] std::string latin_to_utf8(std::string_view text);

/// A number with at most 16 characters, as the VR DS requires.
[[nodiscard]] std::string decimal_string(double value);

/// A unique identifier (UID) that is derived from a text: equal texts have equal UIDs. @see RFC 9562, UUIDs of version
/// 8, and PS3.5 B.2
[[nodiscard]] std::string dicom_uid(const std::string& text);

/// Writes a file with one instance, which is the only one of its series. The UIDs of the instance and of the series are
/// derived from the contents.
/// @param with_vr  whether the encoding is explicit VR; otherwise it is implicit VR, which allows texts longer than 64
/// KiB
/// @throws Error Io, Unsupported if the length of an element does not fit into 32 bits.
void write_dicom_instance(const std::string& path, DicomItem& file, bool with_vr, const std::string& sop_class);

}  // namespace covol::detail
