#include "io/image/dicom_header.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

namespace covol::detail {
namespace {

constexpr std::uint32_t kUndefined = 0xFFFFFFFF;
constexpr std::uint32_t kItem = 0xFFFEE000, kItemEnd = 0xFFFEE00D, kSequenceEnd = 0xFFFEE0DD;
constexpr std::uint32_t kTransferSyntax = 0x00020010, kPixelData = 0x7FE00010;
constexpr int kDeepest = 16;

constexpr std::string_view kShort[] = {"AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO",
                                       "LT", "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US"};
constexpr std::string_view kLong[] = {"OB", "OD", "OF", "OL", "OW", "SQ", "UC", "UN", "UR", "UT"};

constexpr std::uint64_t kLongestValue = 1 << 12;

/// What PS3.6 says of the elements of which an image is made. Debian's GDCM ends the program where a file says
/// otherwise, in a sequence too.
struct Representation {
    std::uint32_t tag;
    std::string_view vr;
};
constexpr Representation kRepresentations[] = {
    {0x00080005, "CS"}, {0x00080008, "CS"}, {0x00082111, "ST"}, {0x00180015, "CS"}, {0x00180088, "DS"},
    {0x00181063, "DS"}, {0x00181310, "US"}, {0x00181312, "CS"}, {0x0020000D, "UI"}, {0x0020000E, "UI"},
    {0x00200011, "IS"}, {0x00200013, "IS"}, {0x00200020, "CS"}, {0x00200030, "DS"}, {0x00200032, "DS"},
    {0x00200035, "DS"}, {0x00200037, "DS"}, {0x00200060, "CS"}, {0x00280002, "US"}, {0x00280004, "CS"},
    {0x00280005, "US"}, {0x00280006, "US"}, {0x00280008, "IS"}, {0x00280009, "AT"}, {0x00280010, "US"},
    {0x00280011, "US"}, {0x00280012, "US"}, {0x00280030, "DS"}, {0x00280034, "IS"}, {0x00280100, "US"},
    {0x00280101, "US"}, {0x00280102, "US"}, {0x00280103, "US"}, {0x00280301, "CS"}, {0x00281050, "DS"},
    {0x00281051, "DS"}, {0x00281052, "DS"}, {0x00281053, "DS"}, {0x00281054, "LO"}, {0x00281101, "US"},
    {0x00281102, "US"}, {0x00281103, "US"}, {0x00282110, "CS"}, {0x00282112, "DS"}, {0x00282114, "CS"},
    {0x00409224, "FD"}, {0x00409225, "FD"}, {0x3004000C, "DS"}, {0x3004000E, "DS"}};

/// Unknown, "UN", goes for all.
bool is_represented_well(std::uint32_t tag, std::string_view vr) {
    if (vr == "UN") return true;
    // The palettes' descriptors are signed where the pixels are.
    if (vr == "SS" && tag >= 0x00281101 && tag <= 0x00281103) return true;
    const auto* known = std::lower_bound(std::begin(kRepresentations), std::end(kRepresentations), tag,
                                         [](const Representation& r, std::uint32_t t) { return r.tag < t; });
    return known == std::end(kRepresentations) || known->tag != tag || known->vr == vr;
}

bool is_one_of(const auto& value, const auto& list) {
    return std::find(std::begin(list), std::end(list), value) != std::end(list);
}

struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string vr;
};

class Walker {
public:
    explicit Walker(const std::string& path) : file_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {}

    [[nodiscard]] const DicomHeader& header() const { return header_; }

    bool is_sound() {
        constexpr std::uint64_t kMeta = 132;
        go_to(kMeta);
        std::string syntax;
        for (std::uint32_t last = 0; at_ < size_;) {
            const std::uint64_t begin = at_;
            Element e;
            explicit_ = true, big_ = false;
            if (!read_tag(e.tag)) return false;
            go_to(begin);
            if (e.tag >> 16 != 2) break;
            if (!read_element(e) || e.tag <= last || e.length > size_ - at_) return false;
            last = e.tag;
            std::string value(e.length, '\0');
            file_.read(value.data(), e.length);
            if (e.tag == kTransferSyntax) syntax = value.substr(0, value.find_last_not_of(std::string("\0 ", 2)) + 1);
            go_to(at_ + e.length);
        }
        constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";
        if (syntax.rfind("1.2.840.10008.1.2", 0) != 0 || syntax == kDeflated) return false;
        explicit_ = syntax != "1.2.840.10008.1.2";
        big_ = syntax == "1.2.840.10008.1.2.2";
        // Compressed syntaxes, and only they, have their pixels in pieces.
        const bool plain = syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.10008.1.2.1" || big_;
        header_.big_endian = big_;
        return at_ < size_ && walk(size_, false, 0) && describes_pixels() && header_.encapsulated != plain &&
               (header_.encapsulated || header_.pixel_bytes > 0);
    }

private:
    void go_to(std::uint64_t at) {
        at_ = at;
        file_.clear();
        file_.seekg(static_cast<std::streamoff>(at));
    }
    bool read_number(int bytes, std::uint32_t& out) {
        unsigned char raw[4] = {};
        if (at_ + std::uint64_t(bytes) > size_ || !file_.read(reinterpret_cast<char*>(raw), bytes)) return false;
        at_ += std::uint64_t(bytes);
        out = 0;
        for (int b = 0; b < bytes; ++b) out |= std::uint32_t(raw[big_ ? bytes - 1 - b : b]) << 8 * b;
        return true;
    }
    bool read_tag(std::uint32_t& tag) {
        std::uint32_t group = 0, number = 0;
        if (!read_number(2, group) || !read_number(2, number)) return false;
        tag = group << 16 | number;
        return true;
    }
    /// Tag, value representation and length; the value comes next.
    bool read_element(Element& e) {
        if (!read_tag(e.tag)) return false;
        if (e.tag >> 16 == 0xFFFE || !explicit_) return read_number(4, e.length);
        char vr[2];
        if (at_ + 2 > size_ || !file_.read(vr, 2)) return false;
        at_ += 2;
        e.vr.assign(vr, 2);
        std::uint32_t reserved = 0;
        if (is_one_of(e.vr, kLong)) return read_number(2, reserved) && reserved == 0 && read_number(4, e.length);
        return is_one_of(e.vr, kShort) && read_number(2, e.length);
    }
    /// The numbers of the image pixel module fit each other.
    [[nodiscard]] bool describes_pixels() const {
        const auto number = [&](std::uint32_t tag) { return header_.integer(tag).value_or(kUndefined); };
        const std::uint32_t allocated = number(kBitsAllocated), stored = number(kBitsStored),
                            samples = number(kSamples);
        return (samples == 1 || samples == 3 || samples == 4) &&
               (allocated == 8 || allocated == 16 || allocated == 32) && stored > 0 && stored <= allocated &&
               number(kHighBit) + 1 == stored && number(kRepresentation) <= 1 && number(kRows) > 0 &&
               number(kRows) < kUndefined && number(kColumns) > 0 && number(kColumns) < kUndefined;
    }
    /// The elements up to `end`, or up to an item's end.
    bool walk(std::uint64_t end, bool in_item, int depth) {
        if (depth > kDeepest) return false;
        for (std::uint32_t last = 0; at_ < end;) {
            Element e;
            if (!read_element(e)) return false;
            if (e.tag == kItemEnd) return in_item && e.length == 0;
            if (e.tag <= last || e.tag >> 16 < 4 || e.tag >> 16 == 0xFFFE) return false;
            if (explicit_ && !is_represented_well(e.tag, e.vr)) return false;
            last = e.tag;
            if (!walk_value(e, end, depth)) return false;
        }
        return !in_item && at_ == end;
    }
    bool walk_value(const Element& e, std::uint64_t end, int depth) {
        const bool sequence = e.vr == "SQ" || (e.length == kUndefined && e.tag != kPixelData);
        if (depth == 0 && e.tag == kPixelData && e.length == kUndefined) header_.encapsulated = true;
        if (e.length == kUndefined) return walk_items(end, true, sequence, depth + 1);
        if (e.length > end - at_ || e.length % 2 != 0) return false;
        if (depth == 0 && e.tag == kPixelData) {
            header_.pixel_offset = at_;
            header_.pixel_bytes = e.length;
        } else if (depth == 0 && e.length <= kLongestValue && !sequence) {
            const std::uint64_t begin = at_;
            std::string& value = header_.values[e.tag];
            value.resize(e.length);
            if (!file_.read(value.data(), e.length)) return false;
            go_to(begin);
        }
        if (sequence) return walk_items(at_ + e.length, false, true, depth + 1);
        go_to(at_ + e.length);
        return true;
    }
    bool walk_items(std::uint64_t end, bool delimited, bool of_elements, int depth) {
        while (at_ < end) {
            Element e;
            if (!read_element(e)) return false;
            if (e.tag == kSequenceEnd) return delimited && e.length == 0;
            if (e.tag != kItem) return false;
            if (e.length == kUndefined) {
                if (!of_elements || !walk(end, true, depth)) return false;
            } else {
                if (e.length > end - at_) return false;
                if (!of_elements)
                    go_to(at_ + e.length);
                else if (!walk(at_ + e.length, false, depth))
                    return false;
            }
        }
        return !delimited && at_ == end;
    }

    std::ifstream file_;
    std::uint64_t size_, at_ = 0;
    bool explicit_ = true, big_ = false;
    DicomHeader header_;
};

}  // namespace

std::string DicomHeader::text(std::uint32_t tag) const {
    const auto found = values.find(tag);
    if (found == values.end()) return {};
    const std::string padding(" \0", 2);
    const std::size_t begin = found->second.find_first_not_of(padding), end = found->second.find_last_not_of(padding);
    return begin == std::string::npos ? "" : found->second.substr(begin, end + 1 - begin);
}

std::vector<double> DicomHeader::numbers(std::uint32_t tag) const {
    std::vector<double> list;
    std::string rest = text(tag);
    while (!rest.empty()) {
        const std::string one = rest.substr(0, rest.find('\\'));
        rest = one.size() == rest.size() ? "" : rest.substr(one.size() + 1);
        const std::size_t begin = one.find_first_not_of(" +");
        double value = 0;
        if (begin == std::string::npos) return {};
        const auto status = std::from_chars(one.data() + begin, one.data() + one.size(), value).ec;
        if (status != std::errc() || !std::isfinite(value)) return {};
        list.push_back(value);
    }
    return list;
}

std::optional<std::uint32_t> DicomHeader::integer(std::uint32_t tag) const {
    const auto found = values.find(tag);
    if (found == values.end() || found->second.size() != 2) return std::nullopt;
    const auto first = static_cast<unsigned char>(found->second[0]),
               second = static_cast<unsigned char>(found->second[1]);
    return big_endian ? std::uint32_t(first) << 8 | second : std::uint32_t(second) << 8 | first;
}

std::optional<DicomHeader> read_dicom_header(const std::string& path) {
    Walker walker(path);
    if (!walker.is_sound()) return std::nullopt;
    return walker.header();
}

}  // namespace covol::detail
