#include "io/dicom/dicom_elements.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <string_view>
#include <utility>

#include "covol/digest.h"
#include "covol/error.h"
#include "covol/version.h"
#include "files/dicom_class.h"

namespace covol::detail {
namespace {

constexpr std::uint64_t kMaxBytes = 0xFFFFFFFE;  // maximum length of a value; 2^32 - 1 means "undefined length"

template <typename T>
std::string little_endian(T value) {
    std::string bytes;
    for (std::size_t n = 0; n < sizeof(T); ++n) bytes += char(value >> (8 * n) & 0xFF);
    return bytes;
}

std::string tag_bytes(std::uint32_t tag) {
    return little_endian(std::uint16_t(tag >> 16)) + little_endian(std::uint16_t(tag & 0xFFFF));
}

std::string length_bytes(std::uint64_t length) {
    if (length > kMaxBytes)
        throw Error(Errc::Unsupported, "DICOM: expected at most 4 GB in one element, got " + std::to_string(length) +
                                           " bytes; write .nrrd or .zarr");
    return little_endian(std::uint32_t(length));
}

std::string element_head(std::uint32_t tag, const std::string& vr, std::uint64_t length, bool with_vr) {
    if (!with_vr) return tag_bytes(tag) + length_bytes(length);
    if (is_long_vr(vr)) return tag_bytes(tag) + vr + std::string(2, '\0') + length_bytes(length);
    if (length > 0xFFFF)
        throw Error(Errc::Unsupported, "DICOM: expected at most 65535 bytes in an element of type " + vr + ", got " +
                                           std::to_string(length));
    return tag_bytes(tag) + vr + little_endian(std::uint16_t(length));
}

}  // namespace

bool is_long_vr(std::string_view vr) {
    for (const char* one : {"OB", "OD", "OF", "OL", "OW", "SQ", "UC", "UN", "UR", "UT"})
        if (vr == one) return true;
    return false;
}

void DicomItem::put(std::uint32_t tag, const char* vr, std::string bytes) {
    const std::string_view kind(vr);
    if (bytes.size() % 2 != 0) bytes += kind == "UI" || kind == "OB" ? '\0' : ' ';
    elements_[tag] = {vr, std::move(bytes), {}};
}

void DicomItem::put_shorts(std::uint32_t tag, const std::vector<std::uint16_t>& values) {
    std::string bytes;
    for (const std::uint16_t value : values) bytes += little_endian(value);
    put(tag, "US", bytes);
}

void DicomItem::put_longs(std::uint32_t tag, const std::vector<std::uint32_t>& values) {
    std::string bytes;
    for (const std::uint32_t value : values) bytes += little_endian(value);
    put(tag, "UL", bytes);
}

void DicomItem::put_tag(std::uint32_t tag, std::uint32_t value) { put(tag, "AT", tag_bytes(value)); }

void DicomItem::put_decimals(std::uint32_t tag, const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : "\\") + decimal_string(value);
    put(tag, "DS", text);
}

void DicomItem::add(const DicomItem& other) {
    for (const auto& [tag, element] : other.elements_) elements_[tag] = element;
}

void DicomItem::put_items(std::uint32_t tag, const std::vector<DicomItem>& items) {
    elements_[tag] = {"SQ", {}, items};
}

std::string DicomItem::encoded(bool with_vr) const {
    constexpr std::uint32_t kItem = 0xFFFEE000;
    std::string bytes;
    for (const auto& [tag, element] : elements_) {
        if (element.vr != "SQ") {
            bytes += element_head(tag, element.vr, element.bytes.size(), with_vr) + element.bytes;
            continue;
        }
        std::string items;
        for (const DicomItem& item : element.items) {
            const std::string one = item.encoded(with_vr);
            items += tag_bytes(kItem) + length_bytes(one.size()) + one;
        }
        bytes += element_head(tag, element.vr, items.size(), with_vr) + items;
    }
    return bytes;
}

DicomItem dicom_code(const char* value, const char* scheme, const char* meaning) {
    DicomItem item;
    item.put(0x00080100, "SH", value);
    item.put(0x00080102, "SH", scheme);
    item.put(0x00080104, "LO", meaning);
    return item;
}

std::string latin_to_utf8(std::string_view text) {
    std::string out;
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        if (code < 128)
            out += c;
        else
            out += {char(0xC0 | code >> 6), char(0x80 | (code & 0x3F))};
    }
    return out;
}

std::string decimal_string(double value) {
    constexpr std::size_t kLongest = 16;
    std::array<char, 32> text{};
    const auto begin = text.data();
    std::string shown(begin, std::to_chars(begin, begin + text.size(), value == 0 ? 0.0 : value).ptr);
    for (int digits = 15; shown.size() > kLongest; --digits)
        shown.assign(begin, std::to_chars(begin, begin + text.size(), value, std::chars_format::general, digits).ptr);
    return shown;
}

std::string dicom_uid(const std::string& text) {
    const std::string digest = digest_of_bytes(text);
    std::array<unsigned, 16> bytes{};
    const std::string_view hex = std::string_view(digest).substr(digest.find(':') + 1);
    for (std::size_t n = 0; n < bytes.size(); ++n) {
        const char* const at = hex.data() + 2 * n;
        std::from_chars(at, at + 2, bytes[n], 16);
    }
    bytes[6] = (bytes[6] & 0x0FU) | 0x80U;  // sets the version of the UUID to 8
    bytes[8] = (bytes[8] & 0x3FU) | 0x80U;  // sets the variant of the UUID to that of RFC 9562
    // A UID contains the 128 bits of the UUID as one decimal number.
    std::string decimal = "0";
    for (const unsigned byte : bytes) {
        unsigned carry = byte;
        for (auto digit = decimal.rbegin(); digit != decimal.rend(); ++digit) {
            carry += unsigned(*digit - '0') * 256;
            *digit = char('0' + carry % 10);
            carry /= 10;
        }
        for (; carry > 0; carry /= 10) decimal.insert(decimal.begin(), char('0' + carry % 10));
    }
    return "2.25." + decimal.substr(std::min(decimal.find_first_not_of('0'), decimal.size() - 1));
}

void write_dicom_instance(const std::string& path, DicomItem& file, bool with_vr, const std::string& sop_class) {
    const std::string content = digest_of_bytes(file.encoded(with_vr)), instance = dicom_uid("instance " + content);
    file.put(0x00080016, "UI", sop_class);
    file.put(0x00080018, "UI", instance);
    file.put(0x0020000E, "UI", dicom_uid("series " + content));
    DicomItem meta;
    meta.put(0x00020001, "OB", std::string("\x00\x01", 2));
    meta.put(0x00020002, "UI", sop_class);
    meta.put(0x00020003, "UI", instance);
    meta.put(0x00020010, "UI", with_vr ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2");
    meta.put(0x00020012, "UI", dicom_uid("covol"));
    meta.put(0x00020013, "SH", "COVOL_" COVOL_VERSION_STRING);
    const std::string rest = meta.encoded(true);
    DicomItem size;
    size.put_longs(0x00020000, {std::uint32_t(rest.size())});
    const std::string begin = std::string(kDicomPreamble, '\0').append(kDicomMarker) + size.encoded(true) + rest;
    const std::string elements = file.encoded(with_vr);
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(begin.data(), std::streamsize(begin.size()));
    out.write(elements.data(), std::streamsize(elements.size()));
    out.close();
    if (!out) throw Error(Errc::Io, path + ": cannot write");
}

}  // namespace covol::detail
