#pragma once
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace covol::detail {

/// The lines of a NRRD's or MetaImage's text header, for what ITK keeps to itself.
struct TextHeader {
    std::vector<std::string> lines;  ///< as written
    std::uint64_t end = 0;           ///< where the pixels begin, when they are in the same file

    explicit TextHeader(const std::string& path);
    /// What follows "key", one of ":", ":=" or "=", and blanks; empty when there is no such line. Keys are lower case.
    [[nodiscard]] std::string value(const std::string& key) const;
    /// The first of the keys that there is.
    [[nodiscard]] std::string value_of(std::initializer_list<const char*> keys) const;
    [[nodiscard]] bool has_value(const std::string& key, const std::string& wanted) const;
    /// The file with the pixels, as written; empty when they follow the header.
    [[nodiscard]] std::string data_file() const;
    /// Paths of all files with pixels that the header names: one, a list of them, or numbered ones. They need not be
    /// there.
    [[nodiscard]] std::vector<std::string> data_files() const;

private:
    std::string path_;
    std::vector<std::string> listed_;  ///< behind "LIST"
};

/// A named pipe would be waited for. @throws Error Io where one of them is there and no regular file.
void require_regular_files(const std::string& path, const std::vector<std::string>& files);

}  // namespace covol::detail
