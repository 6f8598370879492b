#include "detail/dicom_check.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
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

bool is_one_of(const std::string& vr, const auto& list) { return std::find(std::begin(list), std::end(list), vr) != std::end(list); }

struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string vr;
};

class Walker {
public:
    explicit Walker(const std::string& path) : file_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {}

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
        return at_ < size_ && walk(size_, false, 0);
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
    /// The elements up to `end`, or up to an item's end.
    bool walk(std::uint64_t end, bool in_item, int depth) {
        if (depth > kDeepest) return false;
        for (std::uint32_t last = 0; at_ < end;) {
            Element e;
            if (!read_element(e)) return false;
            if (e.tag == kItemEnd) return in_item && e.length == 0;
            if (e.tag <= last || e.tag >> 16 < 4 || e.tag >> 16 == 0xFFFE) return false;
            last = e.tag;
            if (!walk_value(e, end, depth)) return false;
        }
        return !in_item && at_ == end;
    }
    bool walk_value(const Element& e, std::uint64_t end, int depth) {
        const bool sequence = e.vr == "SQ" || (e.length == kUndefined && e.tag != kPixelData);
        if (e.length == kUndefined) return walk_items(end, true, sequence, depth + 1);
        if (e.length > end - at_ || e.length % 2 != 0) return false;
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
};

}  // namespace

bool is_sound_dicom(const std::string& path) { return Walker(path).is_sound(); }

}  // namespace covol::detail
