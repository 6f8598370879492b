#include "io/dicom/dicom_tree.h"

#include <algorithm>

#include "covol/error.h"
#include "files/dicom_class.h"
#include "io/dicom/dicom_elements.h"

namespace covol::detail {
namespace {

constexpr std::uint32_t kTransferSyntaxTag = 0x00020010;
constexpr std::uint32_t kItemTag = 0xFFFEE000, kItemEndTag = 0xFFFEE00D, kSequenceEndTag = 0xFFFEE0DD;
constexpr std::uint32_t kNoLength = 0xFFFFFFFF;
constexpr int kDeepestItem = 16;

std::string_view without_padding(std::string_view text) {
    constexpr std::string_view kPadding(" \0", 2);
    const std::size_t begin = text.find_first_not_of(kPadding), end = text.find_last_not_of(kPadding);
    return begin == std::string_view::npos ? std::string_view() : text.substr(begin, end + 1 - begin);
}

class TreeParser {
public:
    TreeParser(const std::string& path, std::string_view bytes, const std::vector<std::uint32_t>& wanted)
        : path_(path), bytes_(bytes), wanted_(wanted) {}

    DicomTree parse() {
        const bool is_marked = bytes_.size() > kFirstDicomElement && has_dicom_marker(bytes_);
        at_ = is_marked ? kFirstDicomElement : 0;
        std::string_view syntax;
        while (at_ + 2 <= bytes_.size() && number<std::uint16_t>(at_) == 2) {
            const Head head = read_head(true);
            const std::string_view value = take(head.length);
            if (head.tag == kTransferSyntaxTag) syntax = without_padding(value);
        }
        bool with_vr = syntax != "1.2.840.10008.1.2";
        if (syntax.empty() && at_ + 6 <= bytes_.size()) with_vr = bytes_[at_ + 4] >= 'A' && bytes_[at_ + 4] <= 'Z';
        if (syntax == "1.2.840.10008.1.2.2" || syntax == "1.2.840.10008.1.2.1.99")
            throw Error(Errc::Unsupported,
                        path_ + ": this DICOM file is " + (syntax.ends_with("99") ? "deflated" : "big-endian") +
                            "; write it again in Explicit VR Little Endian, for example with dcmconv +te");
        DicomTree tree;
        elements(tree, bytes_.size(), with_vr, false, 0);
        return tree;
    }

private:
    struct Head {
        std::uint32_t tag = 0, length = 0;
        std::string_view vr;
    };

    [[noreturn]] void damaged(const std::string& what) const {
        throw Error(Errc::InvalidInput,
                    path_ + ": damaged, truncated, or not a DICOM file: byte " + std::to_string(at_) + ": " + what);
    }
    template <typename T>
    [[nodiscard]] T number(std::size_t at) const {
        if (at > bytes_.size() || bytes_.size() - at < sizeof(T)) damaged("the file ends within an element");
        T value = 0;
        for (std::size_t n = 0; n < sizeof(T); ++n)
            value = T(value | T(T(static_cast<unsigned char>(bytes_[at + n])) << (8 * n)));
        return value;
    }
    template <typename T>
    T next() {
        const T value = number<T>(at_);
        at_ += sizeof(T);
        return value;
    }
    std::string_view take(std::uint32_t length) {
        if (length > bytes_.size() - at_)
            damaged("an element of " + std::to_string(length) + " bytes ends beyond the file");
        const std::string_view value = bytes_.substr(at_, length);
        at_ += length;
        return value;
    }
    Head read_head(bool with_vr) {
        Head head;
        const auto group = next<std::uint16_t>(), element = next<std::uint16_t>();
        head.tag = std::uint32_t(group) << 16 | element;
        if (!with_vr || group == 0xFFFE) {
            head.length = next<std::uint32_t>();
            return head;
        }
        head.vr = take(2);
        if (!std::all_of(head.vr.begin(), head.vr.end(), [](char c) { return c >= 'A' && c <= 'Z'; }))
            damaged("expected two capital letters, the type of an element's value (VR)");
        if (is_long_vr(head.vr)) {
            at_ += 2;
            head.length = next<std::uint32_t>();
        } else {
            head.length = next<std::uint16_t>();
        }
        return head;
    }
    /// Reads elements up to `end`, or up to the delimiter of an item.
    void elements(DicomTree& tree, std::size_t end, bool with_vr, bool up_to_mark, int depth) {
        if (depth > kDeepestItem) damaged("sequences are nested more than 16 deep");
        while (at_ < end) {
            const Head head = read_head(with_vr);
            if (head.tag == kItemEndTag && up_to_mark) return;
            if (at_ > end) damaged("an element begins beyond the end of its item");
            const bool is_wanted = std::find(wanted_.begin(), wanted_.end(), head.tag) != wanted_.end();
            const bool is_sequence = head.vr == "SQ" || head.length == kNoLength || (head.vr.empty() && is_wanted);
            if (head.length != kNoLength && head.length > end - at_)
                damaged("an element ends beyond the end of its item");
            if (!is_sequence) {
                tree.values[head.tag] = take(head.length);
            } else if (head.length != kNoLength && !is_wanted) {
                (void)take(head.length);
            } else {
                // A value of unknown VR and undefined length is encoded with implicit VR: PS3.5 6.2.2.
                std::vector<DicomTree> items = read_items(end, head, with_vr && head.vr != "UN", depth + 1);
                if (is_wanted) tree.sequences[head.tag] = std::move(items);
            }
        }
        if (up_to_mark) damaged("an item has no end");
    }
    std::vector<DicomTree> read_items(std::size_t outer, const Head& sequence, bool with_vr, int depth) {
        const bool up_to_mark = sequence.length == kNoLength;
        const std::size_t end = up_to_mark ? outer : at_ + sequence.length;
        std::vector<DicomTree> items;
        while (at_ < end) {
            const Head head = read_head(with_vr);
            if (head.tag == kSequenceEndTag && up_to_mark) return items;
            if (at_ > end) damaged("an item begins beyond the end of its sequence");
            if (head.tag != kItemTag) damaged("expected an item of a sequence");
            const bool has_mark = head.length == kNoLength;
            if (!has_mark && head.length > end - at_) damaged("an item ends beyond the end of its sequence");
            elements(items.emplace_back(), has_mark ? end : at_ + head.length, with_vr, has_mark, depth);
        }
        if (up_to_mark) damaged("a sequence has no end");
        return items;
    }

    const std::string& path_;
    const std::string_view bytes_;
    const std::vector<std::uint32_t>& wanted_;
    std::size_t at_ = 0;
};

}  // namespace

std::string_view DicomTree::text(std::uint32_t tag) const {
    const auto found = values.find(tag);
    return found == values.end() ? std::string_view() : without_padding(found->second);
}

const std::vector<DicomTree>& DicomTree::items(std::uint32_t tag) const {
    static const std::vector<DicomTree> none;
    const auto found = sequences.find(tag);
    return found == sequences.end() ? none : found->second;
}

DicomTree parse_dicom(const std::string& path, std::string_view bytes, const std::vector<std::uint32_t>& wanted) {
    return TreeParser(path, bytes, wanted).parse();
}

}  // namespace covol::detail
