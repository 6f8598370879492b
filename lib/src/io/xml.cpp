#include "io/xml.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace covol::detail {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::string decode_entities(const std::string& text) {
    static constexpr std::pair<const char*, const char*> kEntities[] = {
        {"amp;", "&"},         {"lt;", "<"},          {"gt;", ">"},          {"quot;", "\""},
        {"apos;", "'"},        {"#181;", "\xC2\xB5"}, {"#xB5;", "\xC2\xB5"}, {"#xb5;", "\xC2\xB5"},
        {"#956;", "\xCE\xBC"}, {"#197;", "\xC3\x85"}};
    std::string out;
    for (std::size_t at = 0; at < text.size(); ++at) {
        out += text[at];
        if (text[at] != '&') continue;
        for (const auto& [name, meaning] : kEntities) {
            const std::string_view entity(name);
            if (text.compare(at + 1, entity.size(), entity) != 0) continue;
            out.back() = meaning[0];
            out += meaning + 1;
            at += entity.size();
            break;
        }
    }
    return out;
}

}  // namespace

bool XmlTags::next(XmlTag& tag) {
    while ((at_ = text_.find('<', at_)) != std::string::npos) {
        if (text_.compare(at_, 4, "<!--") == 0) {
            at_ = text_.find("-->", at_);
            if (at_ == std::string::npos) return false;
            continue;
        }
        ++at_;
        if (at_ < text_.size() && (text_[at_] == '?' || text_[at_] == '!')) continue;
        return read(tag);
    }
    return false;
}

std::string XmlTags::text() const {
    // at_ is the position of the last character of the tag.
    const std::size_t begin = at_ < text_.size() ? at_ + 1 : at_;
    return decode_entities(text_.substr(begin, std::min(text_.find('<', begin), text_.size()) - begin));
}

void XmlTags::skip_spaces() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
}

std::string XmlTags::word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_]) && text_[at_] != '=' && text_[at_] != '>' && text_[at_] != '/')
        ++at_;
    const std::string name = text_.substr(begin, at_ - begin);
    return name.substr(name.rfind(':') == std::string::npos ? 0 : name.rfind(':') + 1);
}

bool XmlTags::read(XmlTag& tag) {
    tag = {};
    if (at_ < text_.size() && text_[at_] == '/') {
        tag.closing = true;
        ++at_;
    }
    tag.name = word();
    for (;;) {
        skip_spaces();
        if (at_ >= text_.size() || text_[at_] == '>') return at_ < text_.size();
        if (text_[at_] == '/') {
            tag.empty = true;
            ++at_;
            continue;
        }
        const std::string key = word();
        skip_spaces();
        if (key.empty() || at_ >= text_.size() || text_[at_] != '=') return false;
        ++at_;
        skip_spaces();
        const char quote = at_ < text_.size() ? text_[at_] : '\0';
        const std::size_t end = quote == '"' || quote == '\'' ? text_.find(quote, at_ + 1) : std::string::npos;
        if (end == std::string::npos) return false;
        tag.attributes[key] = decode_entities(text_.substr(at_ + 1, end - at_ - 1));
        at_ = end + 1;
    }
}

}  // namespace covol::detail
