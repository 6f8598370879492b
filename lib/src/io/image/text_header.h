#pragma once
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace covol::detail {

/// The lines of the text header of NRRD or MetaImage, for fields that ITK does not expose.
struct TextHeader {
    std::vector<std::string> lines;  ///< the lines as they are in the file
    std::uint64_t end = 0;           ///< position in bytes of the pixels, if they follow the header in the same file

    explicit TextHeader(const std::string& path);
    /// The text after "key:", "key:=" or "key =" and blanks; empty if there is no such line. `key` is in lower case.
    [[nodiscard]] std::string value(const std::string& key) const;
    /// The value of the first key in the list that has a value; empty if none of the keys has one.
    [[nodiscard]] std::string value_of(std::initializer_list<const char*> keys) const;
    [[nodiscard]] bool has_value(const std::string& key, const std::string& wanted) const;
    /// The name of the file with the pixels, as written; empty if the pixels follow the header.
    [[nodiscard]] std::string data_file() const;
    /// Paths of all files with pixels that the header names: one, a list, or numbered files. The files need not exist.
    [[nodiscard]] std::vector<std::string> data_files() const;

private:
    std::string path_;
    std::vector<std::string> listed_;  ///< the names of files in the lines after "LIST"
};

/// Rejects everything but regular files, because reading from a named pipe, for example, would wait for a writer.
/// @throws Error Io if one of the files exists but is not a regular file.
void require_regular_files(const std::string& path, const std::vector<std::string>& files);

}  // namespace covol::detail
