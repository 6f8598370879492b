#include "jobs/name_tag.h"

#include <charconv>
#include <filesystem>
#include <string_view>

#include "cli/options/arguments.h"
#include "covol/file_kind.h"

namespace covol::tool {
namespace {

bool parse_int(std::string_view text, int& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && value >= 0;
}

/// The placeholder {frame}, {frame:03} or {frame:03d} in a path: its position, and the minimum number of digits.
struct Placeholder {
    std::size_t begin = std::string::npos, length = 0;
    int digits = 0;
};

Placeholder find_placeholder(const std::string& path) {
    Placeholder found;
    const std::size_t begin = path.find("{frame");
    const std::size_t end = begin == std::string::npos ? begin : path.find('}', begin);
    if (end == std::string::npos) return found;
    std::string width = path.substr(begin + 6, end - begin - 6);
    if (!width.empty()) {
        if (width.back() == 'd') width.pop_back();
        if (width.size() < 2 || width[0] != ':' || !parse_int(std::string_view(width).substr(1), found.digits) ||
            found.digits > 9)
            throw UsageError(path + ": expected {frame} or {frame:03d}, got " + path.substr(begin, end - begin + 1));
    }
    found.begin = begin;
    found.length = end - begin + 1;
    return found;
}

}  // namespace

std::string padded(int number, int digits) {
    std::string text = std::to_string(number);
    if (int(text.size()) < digits) text.insert(0, std::size_t(digits) - text.size(), '0');
    return text;
}

namespace {

/// A path that is split before its ending: "out" and ".nii.gz" for "out.nii.gz".
struct SplitPath {
    std::string before, ending;
};

SplitPath split_ending(std::string path) {
    // A shell's completion adds a slash to the name of a folder, such as a.zarr/.
    while (path.size() > 1 && path.back() == '/') path.pop_back();
    const std::size_t end = path.size() - long_ending(path).size();
    return {path.substr(0, end), path.substr(end)};
}

}  // namespace

std::string with_suffix(const std::string& path, const std::string& suffix) {
    const SplitPath split = split_ending(path);
    return split.before + suffix + split.ending;
}

std::string with_ending(const std::string& path, const std::string& ending) {
    return split_ending(path).before + ending;
}

bool has_frame_pattern(const std::string& path) { return find_placeholder(path).begin != std::string::npos; }

std::string with_frame(const std::string& pattern, int frame) {
    const Placeholder found = find_placeholder(pattern);
    std::string path = pattern;
    if (found.begin != std::string::npos) path.replace(found.begin, found.length, padded(frame, found.digits));
    return path;
}

std::string NameTag::operator()(const std::string& path) const {
    if (path.empty()) return path;
    return frame && has_frame_pattern(path) ? with_frame(path, *frame) : with_suffix(path, suffix);
}

}  // namespace covol::tool
