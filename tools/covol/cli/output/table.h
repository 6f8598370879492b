#pragma once
#include <string>
#include <vector>

namespace covol::tool {

/// A table as CSV text: a header, then rows; fields are quoted if necessary (RFC 4180, but lines end with \n).
class Table {
public:
    explicit Table(const std::vector<std::string>& header);
    Table& row();  ///< begins the next row
    Table& operator<<(const std::string& field);
    Table& operator<<(const char* field) { return *this << std::string(field); }
    Table& operator<<(double number);  ///< adds an empty field if the number is not finite
    Table& operator<<(int number) { return *this << std::to_string(number); }
    /// Adds the rows of another table, which must have an empty header.
    Table& add_rows(const Table& other);
    [[nodiscard]] std::string text() const { return text_ + "\n"; }

private:
    std::string text_;
    bool first_ = true;
};

/// Rows of cells as lines of text: the first column is left-aligned, the others are right-aligned.
[[nodiscard]] std::vector<std::string> aligned(const std::vector<std::vector<std::string>>& rows);

}  // namespace covol::tool
