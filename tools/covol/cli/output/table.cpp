#include "cli/output/table.h"

#include <algorithm>
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

Table& Table::add_rows(const Table& other) {
    text_ += other.text_;
    return *this;
}

std::vector<std::string> aligned(const std::vector<std::vector<std::string>>& rows) {
    std::vector<std::size_t> widths;
    for (const auto& row : rows) {
        widths.resize(std::max(widths.size(), row.size()));
        for (std::size_t n = 0; n < row.size(); ++n) widths[n] = std::max(widths[n], row[n].size());
    }
    std::vector<std::string> lines;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t n = 0; n < row.size(); ++n) {
            const std::string blanks(widths[n] - row[n].size(), ' ');
            line += n == 0 ? row[n] + blanks : "  " + blanks + row[n];
        }
        lines.push_back(line);
    }
    return lines;
}

}  // namespace covol::tool
