#include "io/image/text_header.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/text.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFiles = 100000;

/// Expands a pattern, first, last and step, such as "slice%03d.raw 1 12 1", to the names of all files. The numbers are
/// formatted as by printf() with %d, with an optional width and leading zeros.
std::vector<std::string> numbered_files(const std::string& text) {
    std::vector<std::string> names;
    // The last % is used, because names may contain this character and blanks.
    const std::size_t percent = text.rfind('%'), letter = text.find('d', percent), blank = text.find(' ', letter);
    if (letter == std::string::npos || blank == std::string::npos) return names;
    const std::string width = text.substr(percent + 1, letter - percent - 1);
    if (width.size() > 2 || width.find_first_not_of("0123456789") != std::string::npos) return names;
    const char fill = width.starts_with('0') ? '0' : ' ';
    const std::size_t digits = width.empty() ? 0 : std::stoul(width);
    const std::size_t end = text.find(' ', blank + 1) == blank + 1 ? text.find_first_not_of(' ', blank) - 1 : blank;
    std::istringstream numbers(text.substr(end));
    std::int64_t first = 0, last = -1, step = 1;
    if (!(numbers >> first >> last)) return names;
    if (!(numbers >> step) || step == 0) step = last < first ? -1 : 1;
    for (std::int64_t n = first; (step > 0 ? n <= last : n >= last) && names.size() < kMaxFiles; n += step) {
        std::string number = std::to_string(n);
        if (number.size() < digits) number.insert(0, digits - number.size(), fill);
        names.push_back(text.substr(0, percent) + number + text.substr(letter + 1, blank - letter - 1));
    }
    return names;
}

}  // namespace

TextHeader::TextHeader(const std::string& path) : path_(path) {
    constexpr std::size_t kMax = 1000;
    std::ifstream file(path, std::ios::binary);
    std::string line;
    bool list = false;
    while (lines.size() < kMax && std::getline(file, line) && !line.empty() && line != "\r") {
        lines.push_back(line);
        const std::string small = lower(line);
        const bool is_meta = small.starts_with("elementdatafile");
        if (is_meta || small.starts_with("data file") || small.starts_with("datafile"))
            list = lower(data_file()).starts_with("list");
        if (list || is_meta) break;
    }
    if (file) end = static_cast<std::uint64_t>(file.tellg());
    while (list && listed_.size() < kMaxFiles && std::getline(file, line))
        if (const std::string name(trim(line)); !name.empty()) listed_.push_back(name);
}

std::string TextHeader::value(const std::string& key) const {
    for (const std::string& line : lines) {
        if (lower(line.substr(0, key.size())) != key) continue;
        const std::size_t separator = line.find_first_not_of(' ', key.size());
        if (separator == std::string::npos || (line[separator] != ':' && line[separator] != '=')) continue;
        const std::size_t begin = line.find_first_not_of(":= ", separator);
        const std::size_t last = line.find_last_not_of(" \r");
        return begin == std::string::npos ? "" : line.substr(begin, last + 1 - begin);
    }
    return {};
}

std::string TextHeader::value_of(std::initializer_list<const char*> keys) const {
    for (const char* key : keys)
        if (std::string found = value(key); !found.empty()) return found;
    return {};
}

bool TextHeader::has_value(const std::string& key, const std::string& wanted) const {
    return lower(value(key)).starts_with(wanted);
}

std::string TextHeader::data_file() const {
    const std::string name = value_of({"data file", "datafile", "elementdatafile"});
    return lower(name) == "local" ? "" : name;
}

std::vector<std::string> TextHeader::data_files() const {
    const std::string name = data_file();
    std::vector<std::string> names = listed_;
    if (names.empty() && name.find('%') != std::string::npos) names = numbered_files(name);
    if (names.empty() && !name.empty()) names = {name};
    for (std::string& one : names) one = (fs::path(path_).parent_path() / one).string();
    return names;
}

void require_regular_files(const std::string& path, const std::vector<std::string>& files) {
    std::error_code status;
    for (const std::string& file : files)
        if (fs::exists(file, status) && !fs::is_regular_file(file, status))
            throw read_error(Errc::Io, path, "its data file " + file + " is not a regular file");
}

}  // namespace covol::detail
