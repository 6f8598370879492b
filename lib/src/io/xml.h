#pragma once
#include <map>
#include <string>

// As much of XML as the headers of images need.
namespace covol::detail {

struct XmlTag {
    std::string name;  ///< without a namespace
    bool closing = false;
    std::map<std::string, std::string> attributes;

    [[nodiscard]] std::string value(const std::string& key) const {
        const auto found = attributes.find(key);
        return found == attributes.end() ? "" : found->second;
    }
};

/// Goes through the tags of an XML text; comments and declarations are passed over. Whatever is no XML ends it.
class XmlTags {
public:
    /// @param text  has to outlive this
    explicit XmlTags(const std::string& text) : text_(text) {}

    bool next(XmlTag& tag);
    /// What stands between the last tag and the one behind it.
    [[nodiscard]] std::string text() const;

private:
    void skip_spaces();
    std::string word();
    bool read(XmlTag& tag);

    const std::string& text_;
    std::size_t at_ = 0;
};

}  // namespace covol::detail
