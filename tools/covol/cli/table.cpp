#include "cli/table.h"

#include <array>
#include <charconv>
#include <cmath>

namespace covol::tool {

Table::Table(const std::vector<std::string>& header) {
    for (const std::string& name : header) *this << name;
}

Table& Table::row() {
    text_ += '\n';
    first_ = true;
    return *this;
}

Table& Table::operator<<(const std::string& field) {
    if (!first_) text_ += ',';
    first_ = false;
    if (field.find_first_of(",\"\n\r") == std::string::npos) {
        text_ += field;
        return *this;
    }
    text_ += '"';
    for (const char c : field) {
        if (c == '"') text_ += '"';
        text_ += c;
    }
    text_ += '"';
    return *this;
}

Table& Table::operator<<(double number) {
    if (!std::isfinite(number)) return *this << std::string();
    std::array<char, 32> digits;
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), number, std::chars_format::general, 7).ptr;
    return *this << std::string(digits.data(), end);
}

}  // namespace covol::tool
