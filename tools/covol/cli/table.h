#pragma once
#include <string>
#include <vector>

namespace covol::tool {

/// A table as CSV text: a header, then rows; fields are quoted where they must be (RFC 4180, but lines end in \n).
class Table {
public:
    explicit Table(const std::vector<std::string>& header);
    Table& row();  ///< begins the next row
    Table& operator<<(const std::string& field);
    Table& operator<<(const char* field) { return *this << std::string(field); }
    Table& operator<<(double number);  ///< nothing for one that is not finite
    Table& operator<<(int number) { return *this << std::to_string(number); }
    /// Those of another table, whose header is empty.
    Table& add_rows(const Table& other);
    [[nodiscard]] std::string text() const { return text_ + "\n"; }

private:
    std::string text_;
    bool first_ = true;
};

/// Rows of words as lines for people: the first column at its left, the others at their right.
[[nodiscard]] std::vector<std::string> aligned(const std::vector<std::vector<std::string>>& rows);

}  // namespace covol::tool
