#include "io/image/nrrd_space.h"

#include <array>
#include <cmath>
#include <optional>
#include <sstream>

#include "base/text.h"

namespace covol::detail {
namespace {

/// Parses "(1,0,0) (0,1,0) none": for each axis a vector, or nothing if the header states "none". The list is empty if
/// the text cannot be parsed.
std::vector<std::optional<Vec3>> read_vectors(std::string_view text) {
    std::vector<std::optional<Vec3>> vectors;
    while (!(text = trim(text)).empty()) {
        if (text.front() != '(') {
            vectors.emplace_back();
            (void)next_word(text);
            continue;
        }
        const std::size_t end = text.find(')');
        if (end == std::string_view::npos) return {};
        std::string_view inside = text.substr(1, end - 1);
        text.remove_prefix(end + 1);
        Vec3 vector{};
        for (std::size_t n = 0; n < 3; ++n) {
            const std::size_t comma = inside.find(',');
            if ((comma == std::string_view::npos) != (n == 2)) return {};
            const auto value = to_number(trim(inside.substr(0, comma)));
            if (!value || !std::isfinite(*value)) return {};
            vector[n] = *value;
            inside.remove_prefix(n < 2 ? comma + 1 : inside.size());
        }
        vectors.emplace_back(vector);
    }
    return vectors;
}

/// Parses a list of units such as `"um" "um" "mm"`.
std::vector<std::string> read_units(const std::string& text) {
    std::vector<std::string> units;
    if (text.find('"') == std::string::npos) {
        std::istringstream words(text);
        for (std::string word; words >> word;) units.push_back(normal_unit(word));
        return units;
    }
    for (std::size_t begin = text.find('"'); begin != std::string::npos;) {
        const std::size_t end = text.find('"', begin + 1);
        if (end == std::string::npos) return units;
        units.push_back(normal_unit(text.substr(begin + 1, end - begin - 1)));
        begin = text.find('"', end + 1);
    }
    return units;
}

/// Factors, 1 or -1, that convert coordinates of the header's space to LPS; 1 for spaces that are not anatomical.
Vec3 to_lps(const std::string& space) {
    Vec3 sign{1, 1, 1};
    std::string letters;
    std::istringstream words(lower(space));
    for (std::string word; std::getline(words, word, '-');)
        if (word != "time" && !word.empty()) letters += word.front();
    const std::string abbreviation = lower(space);
    if (abbreviation.size() <= 4 && abbreviation.find('-') == std::string::npos) letters = abbreviation.substr(0, 3);
    constexpr std::array<std::string_view, 3> kAlong{"lr", "pa", "si"};
    if (letters.size() != 3) return sign;
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t at = kAlong[a].find(letters[a]);
        if (at == std::string_view::npos) return {1, 1, 1};
        sign[a] = at == 0 ? 1 : -1;
    }
    return sign;
}

/// The indices of the header's axes that are the image's axes i, j and k.
std::vector<std::size_t> space_axes(const TextHeader& header, const std::vector<std::optional<Vec3>>& directions) {
    std::vector<std::size_t> axes;
    std::istringstream words(lower(header.value("kinds")));
    std::vector<std::string> kinds;
    for (std::string word; words >> word;) kinds.push_back(word);
    for (std::size_t n = 0; n < directions.size(); ++n)
        if (directions[n]) axes.push_back(n);
    for (std::size_t n = 0; directions.empty() && n < kinds.size(); ++n)
        if (kinds[n] == "domain" || kinds[n] == "space") axes.push_back(n);
    return axes.size() == 3 ? axes : std::vector<std::size_t>{0, 1, 2};
}

/// The unit of each axis, as a multiple of the unit of the first axis: 1 if the axis has no unit of its own, 0 if one
/// of the two units is not a known unit of length.
Vec3 unit_factors(const std::array<std::string, 3>& units) {
    Vec3 factors{1, 1, 1};
    const double first = unit_in_metres(units[0]);
    for (std::size_t a = 1; a < 3; ++a) {
        if (units[a].empty() || units[a] == units[0]) continue;
        const double own = unit_in_metres(units[a]);
        factors[a] = own > 0 && first > 0 ? own / first : 0;
    }
    return factors;
}

}  // namespace

void restore_nrrd_space(const std::string& path, const TextHeader& header, ImageInfo& info, const RunContext& run) {
    ImageGeometry& g = info.geometry;
    const std::vector<std::optional<Vec3>> directions = read_vectors(header.value("space directions"));
    const std::vector<std::size_t> axes = space_axes(header, directions);
    const std::vector<std::string> of_space = read_units(header.value("space units")),
                                   of_axes = read_units(header.value("units"));
    std::array<std::string, 3> units;
    for (std::size_t a = 0; a < 3; ++a) {
        if (!of_space.empty())
            units[a] = of_space[std::min(a, of_space.size() - 1)];
        else if (axes[a] < of_axes.size())
            units[a] = of_axes[axes[a]];
    }
    if (!of_space.empty() || !of_axes.empty()) g.unit = units[0];
    const Vec3 factors = unit_factors(units);
    // Whether an axis's unit cannot be converted to the unit of the first axis: for each world axis if there are "space
    // units", otherwise for each image axis.
    std::array<bool, 3> unknown{};
    for (std::size_t a = 0; a < 3; ++a) {
        unknown[a] = factors[a] == 0;
        if (unknown[a])
            run.warn(path + ": expected units of length, got " + quote(units[a]) + " for axis " +
                     std::to_string(a + 1) + " beside " + quote(units[0]) +
                     ": its spacing is not known; set it with `spacing = sx,sy,sz`");
    }

    bool complete = directions.size() > axes[2];
    for (const std::size_t axis : axes) complete = complete && directions[axis].has_value();
    if (!complete) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (unknown[a]) info.spacing_known[a] = false;
            if (unknown[a]) continue;
            g.spacing[a] *= factors[a];
            g.origin[a] *= factors[a];
        }
        return;
    }
    const Vec3 sign = to_lps(header.value("space"));
    const std::vector<std::optional<Vec3>> origin = read_vectors(header.value("space origin"));
    for (std::size_t w = 0; w < 3; ++w) {
        const double factor = sign[w] * (unknown[w] ? 1 : factors[w]);
        g.origin[w] = origin.size() == 1 && origin[0] ? factor * (*origin[0])[w] : 0;
    }
    for (std::size_t a = 0; a < 3; ++a) {
        Vec3 step = *directions[axes[a]];
        double square = 0;
        for (std::size_t w = 0; w < 3; ++w) {
            step[w] *= sign[w] * (unknown[w] ? 1 : factors[w]);
            if (unknown[w] && step[w] != 0) info.spacing_known[a] = false;
            square += step[w] * step[w];
        }
        g.spacing[a] = std::sqrt(square);
        for (std::size_t w = 0; w < 3; ++w) g.direction[w][a] = step[w] / g.spacing[a];
    }
}

}  // namespace covol::detail
