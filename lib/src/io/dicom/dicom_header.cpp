#include "io/dicom/dicom_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

#include "files/dicom_class.h"
#include "io/dicom/dicom_elements.h"

namespace covol::detail {
namespace {

constexpr std::uint32_t kUndefined = 0xFFFFFFFF;
constexpr std::uint32_t kItem = 0xFFFEE000, kItemEnd = 0xFFFEE00D, kSequenceEnd = 0xFFFEE0DD;
constexpr std::uint32_t kTransferSyntax = 0x00020010, kPixelData = 0x7FE00010;
constexpr std::uint32_t kMaxPixels = 65535;  // maximum number of pixels along a side of a frame
constexpr int kDeepest = 16;

constexpr std::string_view kShort[] = {"AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO",
                                       "LT", "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US"};

constexpr std::uint64_t kLongestValue = 1 << 12;

constexpr std::uint32_t kSharedGroups = 0x52009229, kFrameGroups = 0x52009230;
/// Sequences outside functional groups that give the position or spacing of frames: detectors of nuclear medicine
/// (PS3.3 C.8.4.11) and regions of ultrasound (C.8.5.5). Only the first item of each sequence is used.
constexpr std::uint32_t kPositionSequences[] = {0x00186011, 0x00540022};
/// The functional groups (PS3.3 C.7.6.16) that are used: echo, frame content, position, orientation, position and
/// orientation of volumes, time, pixel measures, rescaling.
constexpr std::uint32_t kGroups[] = {0x00189114, 0x00209111, 0x00209113, 0x00209116, 0x0020930E,
                                     0x0020930F, 0x00209310, 0x00289110, 0x00289145};

/// The value representations (VR) that PS3.6 prescribes for the elements that describe an image. Debian's GDCM
/// terminates the process if an element has another VR, even within a sequence.
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

/// Whether an element may have this VR: the VR that kRepresentations states for its tag, or any VR if the tag is not in
/// that list. "UN" (unknown) is accepted for all tags.
bool has_expected_vr(std::uint32_t tag, std::string_view vr) {
    if (vr == "UN") return true;
    // The descriptors of palettes (tags 0028,1101 to 1103) are signed (SS) if the pixels are signed.
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
        std::string start(kFirstDicomElement, '\0');
        const bool is_marked =
            size_ > start.size() && file_.read(start.data(), std::streamsize(start.size())) && has_dicom_marker(start);
        go_to(is_marked ? kFirstDicomElement : 0);
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
        if (syntax.empty() && !is_marked) syntax = inferred_syntax();
        constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";
        if (syntax.rfind("1.2.840.10008.1.2", 0) != 0 || syntax == kDeflated) return false;
        explicit_ = syntax != "1.2.840.10008.1.2";
        big_ = syntax == "1.2.840.10008.1.2.2";
        // The pixels must be encapsulated in fragments if the transfer syntax is a compressed one, and must not be
        // otherwise.
        const bool plain = syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.10008.1.2.1" || big_;
        header_.big_endian = big_;
        return at_ < size_ && walk(size_, false, 0) && describes_pixels() && header_.encapsulated != plain &&
               (header_.encapsulated || header_.pixel_bytes > 0);
    }

private:
    /// The transfer syntax of a file without a meta group, from its first element: the two bytes of the group number
    /// show the byte order, and two capital letters after the tag mean explicit VR.
    std::string inferred_syntax() {
        const std::uint64_t begin = at_;
        char first[6] = {};
        const bool is_read = bool(file_.read(first, sizeof first));
        go_to(begin);
        if (!is_read) return {};
        if (first[0] == 0 && first[1] != 0) return "1.2.840.10008.1.2.2";
        const bool is_explicit = std::isupper(static_cast<unsigned char>(first[4])) != 0 &&
                                 std::isupper(static_cast<unsigned char>(first[5])) != 0;
        return is_explicit ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2";
    }
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
    /// Reads the tag, the VR and the length of an element; the value follows in the file.
    bool read_element(Element& e) {
        if (!read_tag(e.tag)) return false;
        if (e.tag >> 16 == 0xFFFE || !explicit_) return read_number(4, e.length);
        char vr[2];
        if (at_ + 2 > size_ || !file_.read(vr, 2)) return false;
        at_ += 2;
        e.vr.assign(vr, 2);
        std::uint32_t reserved = 0;
        if (is_long_vr(e.vr)) return read_number(2, reserved) && reserved == 0 && read_number(4, e.length);
        return is_one_of(e.vr, kShort) && read_number(2, e.length);
    }
    /// Whether the elements of the image pixel module are consistent and supported.
    [[nodiscard]] bool describes_pixels() const {
        const auto number = [&](std::uint32_t tag) { return header_.integer(tag).value_or(kUndefined); };
        const std::uint32_t allocated = number(kBitsAllocated), stored = number(kBitsStored),
                            samples = number(kSamples);
        return (samples == 1 || samples == 3 || samples == 4) &&
               (allocated == 8 || allocated == 16 || allocated == 32) && stored > 0 && stored <= allocated &&
               number(kHighBit) + 1 == stored && number(kRepresentation) <= 1 && number(kRows) > 0 &&
               number(kRows) <= kMaxPixels && number(kColumns) > 0 && number(kColumns) <= kMaxPixels;
    }
    /// Reads the elements up to `end` or, if `in_item`, up to the item's delimiter. @returns false if they are invalid
    bool walk(std::uint64_t end, bool in_item, int depth) {
        if (depth > kDeepest) return false;
        for (std::uint32_t last = 0; at_ < end;) {
            Element e;
            if (!read_element(e)) return false;
            if (e.tag == kItemEnd) return in_item && e.length == 0;
            if (e.tag <= last || e.tag >> 16 < 4 || e.tag >> 16 == 0xFFFE) return false;
            if (explicit_ && !has_expected_vr(e.tag, e.vr)) return false;
            last = e.tag;
            if (!walk_value(e, end, depth)) return false;
        }
        return !in_item && at_ == end;
    }
    /// The map that receives the elements of the item with index `item` of the sequence `tag`; null if these elements
    /// are not needed.
    DicomValues* values_of_item(std::uint32_t tag, int depth, std::size_t item) {
        const bool outermost = depth == 1;
        if (outermost && tag == kFrameGroups) {
            if (header_.frames.size() <= item) header_.frames.emplace_back();
            return &header_.frames[item];
        }
        if (item > 0) return nullptr;
        if (outermost) return tag == kSharedGroups || is_one_of(tag, kPositionSequences) ? &header_.shared : nullptr;
        return depth == 2 && is_one_of(tag, kGroups) ? destination_ : nullptr;
    }
    bool walk_value(const Element& e, std::uint64_t end, int depth) {
        // With implicit VR, no VR marks a sequence. If its length is known, only its tag shows that it is a sequence.
        const bool is_known = !explicit_ && (e.tag == kSharedGroups || e.tag == kFrameGroups ||
                                             is_one_of(e.tag, kPositionSequences) || is_one_of(e.tag, kGroups));
        const bool sequence = e.vr == "SQ" || is_known || (e.length == kUndefined && e.tag != kPixelData);
        if (depth == 0 && e.tag == kPixelData && e.length == kUndefined) header_.encapsulated = true;
        if (e.length == kUndefined) return walk_items(e.tag, end, true, sequence, depth + 1);
        if (e.length > end - at_ || e.length % 2 != 0) return false;
        if (depth == 0 && e.tag == kPixelData) {
            header_.pixel_offset = at_;
            header_.pixel_bytes = e.length;
        } else if (DicomValues* const values = depth == 0 ? &header_.values : destination_;
                   values != nullptr && e.length <= kLongestValue && !sequence) {
            const std::uint64_t begin = at_;
            std::string& value = (*values)[e.tag];
            value.resize(e.length);
            if (!file_.read(value.data(), e.length)) return false;
            go_to(begin);
        }
        if (sequence) return walk_items(e.tag, at_ + e.length, false, true, depth + 1);
        go_to(at_ + e.length);
        return true;
    }
    bool walk_items(std::uint32_t tag, std::uint64_t end, bool delimited, bool of_elements, int depth) {
        for (std::size_t item = 0; at_ < end; ++item) {
            Element e;
            if (!read_element(e)) return false;
            if (e.tag == kSequenceEnd) return delimited && e.length == 0;
            if (e.tag != kItem) return false;
            if (e.length != kUndefined && e.length > end - at_) return false;
            DicomValues* const outer = destination_;
            destination_ = of_elements ? values_of_item(tag, depth, item) : nullptr;
            if (e.length == kUndefined) {
                if (!of_elements || !walk(end, true, depth)) return false;
            } else if (!of_elements) {
                go_to(at_ + e.length);
            } else if (!walk(at_ + e.length, false, depth)) {
                return false;
            }
            destination_ = outer;
        }
        return !delimited && at_ == end;
    }

    std::ifstream file_;
    std::uint64_t size_, at_ = 0;
    bool explicit_ = true, big_ = false;
    DicomHeader header_;
    DicomValues* destination_ = nullptr;  ///< destination for the elements of the current item
};

}  // namespace

const std::string* DicomHeader::find(std::uint32_t tag, std::optional<std::size_t> frame) const {
    if (frame && *frame < frames.size())
        if (const auto found = frames[*frame].find(tag); found != frames[*frame].end()) return &found->second;
    if (frame)
        if (const auto found = shared.find(tag); found != shared.end()) return &found->second;
    const auto found = values.find(tag);
    return found == values.end() ? nullptr : &found->second;
}

std::string DicomHeader::text(std::uint32_t tag, std::optional<std::size_t> frame) const {
    const std::string* const found = find(tag, frame);
    if (found == nullptr) return {};
    const std::string padding(" \0", 2);
    const std::size_t begin = found->find_first_not_of(padding), end = found->find_last_not_of(padding);
    return begin == std::string::npos ? "" : found->substr(begin, end + 1 - begin);
}

std::vector<double> DicomHeader::numbers(std::uint32_t tag, std::optional<std::size_t> frame) const {
    std::vector<double> list;
    std::string rest = text(tag, frame);
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

std::vector<double> DicomHeader::doubles(std::uint32_t tag, std::optional<std::size_t> frame) const {
    const std::string* const found = find(tag, frame);
    if (found == nullptr || found->size() % sizeof(double) != 0) return {};
    std::vector<double> list;
    for (std::size_t at = 0; at < found->size(); at += sizeof(double)) {
        std::array<char, sizeof(double)> bytes{};
        std::memcpy(bytes.data(), found->data() + at, bytes.size());
        if (big_endian) std::reverse(bytes.begin(), bytes.end());
        const auto value = std::bit_cast<double>(bytes);
        if (!std::isfinite(value)) return {};
        list.push_back(value);
    }
    return list;
}

std::optional<std::uint32_t> DicomHeader::integer(std::uint32_t tag, std::optional<std::size_t> frame) const {
    const std::string* const found = find(tag, frame);
    if (found == nullptr || (found->size() != 2 && found->size() != 4)) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t n = 0; n < found->size(); ++n)
        value = value << 8 | static_cast<unsigned char>((*found)[big_endian ? n : found->size() - 1 - n]);
    return value;
}

std::optional<DicomHeader> read_dicom_header(const std::string& path) {
    Walker walker(path);
    if (!walker.is_sound()) return std::nullopt;
    return walker.header();
}

bool is_dicom(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, kFirstDicomElement> begin{};
    file.read(begin.data(), begin.size());
    const auto bytes = static_cast<std::size_t>(file.gcount());
    if (has_dicom_marker({begin.data(), bytes})) return true;
    if (bytes < 12) return false;
    // Without "DICM", the file must begin with an element of group 0002 or 0008, with a known VR or a plausible length.
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(begin[at]); };
    const bool big = byte(0) == 0;
    const unsigned group = big ? byte(1) : byte(0), other = big ? byte(0) : byte(1);
    const unsigned element = big ? byte(2) * 256U + byte(3) : byte(3) * 256U + byte(2);
    if ((group != 2 && group != 8) || other != 0 || element > 0x60) return false;
    const std::string_view vr(begin.data() + 4, 2);
    if (is_one_of(vr, kShort) || is_long_vr(vr)) return true;
    return !big && byte(4) < 128 && byte(5) == 0 && byte(6) == 0 && byte(7) == 0;
}

}  // namespace covol::detail
