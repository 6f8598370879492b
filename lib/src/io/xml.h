#pragma once
#include <map>
#include <string>

// A parser for the subset of XML that the headers of images use.
namespace covol::detail {

struct XmlTag {
    std::string name;  ///< without the prefix of a namespace
    bool closing = false;
    bool empty = false;  ///< as in <a/>: no closing tag follows
    std::map<std::string, std::string> attributes;

    [[nodiscard]] std::string value(const std::string& key) const {
        const auto found = attributes.find(key);
        return found == attributes.end() ? "" : found->second;
    }
};

/// Iterates over the tags of an XML text. Comments and declarations are skipped; next() returns false at the end of the
/// text and at a syntax error.
class XmlTags {
public:
    /// @param text  has to outlive this object
    explicit XmlTags(const std::string& text) : text_(text) {}

    bool next(XmlTag& tag);
    /// The text between the current tag and the next one.
    [[nodiscard]] std::string text() const;

private:
    void skip_spaces();
    std::string word();
    bool read(XmlTag& tag);

    const std::string& text_;
    std::size_t at_ = 0;
};

}  // namespace covol::detail
