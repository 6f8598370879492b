#include "cli/options/arguments.h"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <vector>

#include "covol/error.h"

namespace covol::tool {
namespace {

[[noreturn]] void bad_text(const std::string& flag, const std::string& expected, const std::string& text) {
    throw UsageError(flag + ": expected " + expected + ", got '" + text + "'", flag);
}

/// The number at the beginning of `text`; `rest` gets the text after it. `whole`, of which `text` is a part, is shown
/// in the message if there is no number.
double leading_number(const std::string& flag, const std::string& expected, const std::string& text, std::string& rest,
                      const std::string& whole) {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, value);
    if (error != std::errc()) bad_text(flag, expected, whole);
    if (!std::isfinite(value))
        throw Error(Errc::InvalidOptions, flag + ": expected a finite number, got '" + text + "'", flag);
    rest.assign(stop, end);
    return value;
}

std::vector<double> numbers(const std::string& flag, const std::string& expected, const std::string& text,
                            std::size_t count) {
    std::vector<double> values;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t comma = std::min(text.find(',', begin), text.size());
        std::string item = text.substr(begin, comma - begin);
        item.erase(0, item.find_first_not_of(" \t"));
        item.erase(item.find_last_not_of(" \t") + 1);
        std::string rest;
        values.push_back(leading_number(flag, expected, item, rest, text));
        if (!rest.empty()) bad_text(flag, expected, text);
        begin = comma + 1;
    }
    if (values.size() != count) bad_text(flag, expected, text);
    return values;
}

WorldBox to_box(const std::string& flag, const std::vector<double>& v) {
    WorldBox box{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    for (int a = 0; a < 3; ++a)
        if (!(box.max[a] > box.min[a]))
            throw Error(Errc::InvalidOptions, flag + ": expected x0,y0,z0 below x1,y1,z1 along each axis", flag);
    return box;
}

}  // namespace

Length parse_length(const std::string& flag, const std::string& text) {
    const std::string expected = "a length in world units, or in voxels as 3vx";
    std::string rest;
    Length length{leading_number(flag, expected, text, rest, text), rest == "vx", true};
    if (!rest.empty() && rest != "vx") bad_text(flag, expected, text);
    if (length.value < 0) throw Error(Errc::InvalidOptions, flag + ": expected a length >= 0, got " + text, flag);
    return length;
}

double parse_number(const std::string& flag, const std::string& text) {
    const std::string expected = "a number";
    std::string rest;
    const double value = leading_number(flag, expected, text, rest, text);
    if (!rest.empty()) bad_text(flag, expected, text);
    return value;
}

Vec3 parse_vec3(const std::string& flag, const std::string& text) {
    const std::vector<double> v = numbers(flag, "x,y,z", text, 3);
    return {v[0], v[1], v[2]};
}

WorldBox parse_box(const std::string& flag, const std::string& text) {
    return to_box(flag, numbers(flag, "x0,y0,z0,x1,y1,z1", text, 6));
}

StartChoice parse_start(const std::string& flag, const std::string& text) {
    const std::size_t colon = text.find(':');
    const std::string kind = text.substr(0, colon);
    const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
    if (colon == std::string::npos) {
        if (kind == "auto") return {AutoStart{}, ""};
        if (kind == "guess") return {GuessStart{}, ""};
        if (kind == "cloud") return {CloudStart{}, ""};
        if (kind == "tag") return {TagStart{}, ""};
    }
    if (kind == "sphere") {
        const std::vector<double> v = numbers(flag, "sphere:x,y,z,r", rest, 4);
        if (!(v[3] > 0))
            throw Error(Errc::InvalidOptions, flag + ": expected a radius > 0, got " + std::to_string(v[3]), flag);
        return {SphereStart{{v[0], v[1], v[2]}, v[3]}, ""};
    }
    if (kind == "box") return {BoxStart{to_box(flag, numbers(flag, "box:x0,y0,z0,x1,y1,z1", rest, 6))}, ""};
    if (!rest.empty()) {
        if (kind == "mesh") return {MeshStart{}, rest};
        if (kind == "mask") return {MaskStart{}, rest};
        if (kind == "vdb") return {LevelSetStart{}, rest};
    }
    bad_text(flag, "auto, guess, cloud, tag, sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1, mesh:FILE, mask:FILE or vdb:FILE",
             text);
}

FrameChoice parse_frames(const std::string& flag, const std::string& text) {
    FrameChoice choice;
    choice.given = true;
    choice.all = text == "all";
    if (choice.all) return choice;
    const auto number = [&](std::string_view digits) {
        int value = -1;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        const bool whole = error == std::errc() && end == digits.data() + digits.size();
        if (!whole || value < 0) bad_text(flag, "all, a number from 0, or a range such as 0-9", text);
        return value;
    };
    const std::size_t dash = text.find('-');
    choice.first = number(std::string_view(text).substr(0, dash));
    choice.last = dash == std::string::npos ? choice.first : number(std::string_view(text).substr(dash + 1));
    if (choice.last < choice.first) bad_text(flag, "an ascending range", text);
    return choice;
}

Named split_name(const std::string& text) {
    const std::size_t at = text.find('=');
    // A path may contain '=', too: NAME= is assumed only if NAME has no slash and the whole text is no existing path.
    std::error_code status;
    const bool has_name =
        at != std::string::npos && at > 0 && text.find('/') >= at && !std::filesystem::exists(text, status);
    return has_name ? Named{text.substr(0, at), text.substr(at + 1)} : Named{"", text};
}

std::uint64_t parse_bytes(const std::string& flag, const std::string& text) {
    const std::string expected = "a size such as 8G or 512M";
    std::string rest;
    double value = leading_number(flag, expected, text, rest, text);
    if (rest.size() == 2 && (rest[1] == 'B' || rest[1] == 'b')) rest.pop_back();
    const std::string units = "kmgt";
    if (!rest.empty()) {
        const std::size_t power = units.find(static_cast<char>(std::tolower(static_cast<unsigned char>(rest[0]))));
        if (rest.size() != 1 || power == std::string::npos) bad_text(flag, expected, text);
        value *= std::pow(1024.0, static_cast<double>(power + 1));
    }
    if (!(value >= 1) || value > 1e18)
        throw Error(Errc::InvalidOptions, flag + ": expected " + expected + ", got " + text);
    return static_cast<std::uint64_t>(value);
}

std::array<int, 2> parse_size(const std::string& flag, const std::string& text) {
    std::array<int, 2> size{};
    const char* end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, size[0]);
    if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') bad_text(flag, "WIDTHxHEIGHT", text);
    const auto second = std::from_chars(first.ptr + 1, end, size[1]);
    if (second.ec != std::errc() || second.ptr != end) bad_text(flag, "WIDTHxHEIGHT", text);
    return size;
}

}  // namespace covol::tool
