#include "cli/option_names.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "covol/option_names.h"

namespace covol::tool {
namespace {

/// Of every field that the library's messages name (tests/lint/flags_test.py looks for them here).
const std::map<std::string, std::string> kFlags{
    {"channel", "--channel"},
    {"channels", "--points-channels"},
    {"checkpoint", "--checkpoint"},
    {"checkpoint_every", "--checkpoint-every"},
    {"contours", "--contours"},
    {"correct_level_shift", "--correct-level-shift"},
    {"delta", "--delta"},
    {"frame", "--frame"},
    {"inside", "--inside"},
    {"lattice_origin", "--lattice-origin"},
    {"max_steps", "--max-steps"},
    {"min_component_volume", "--min-component"},
    {"model", "--model"},
    {"order", "--points-order"},
    {"outlier_factor", "--remove-outliers"},
    {"outside", "--outside"},
    {"resume", "--resume"},
    {"rho", "--rho"},
    {"roi", "--roi"},
    {"scale", "--points-scale"},
    {"space", "--points-space"},
    {"spacing", "--spacing"},
    {"start", "--init"},
    {"tag_distance", "--tag-distance"},
    {"tau", "--tau"},
    {"thickness", "--contour-thickness"},
    {"voxel_size", "--voxel-size"},
};

}  // namespace

std::string value_of(const NamedOption& option) {
    if (option.value == "IndexOne") return "index1";
    std::string word = option.value;
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    return word;
}

namespace {

std::string spell(const NamedOption& option) {
    const std::string flag = flag_of(option.field);
    if (flag.empty()) return "`" + option.field + (option.value.empty() ? "" : " = " + option.value) + "`";
    return option.value.empty() ? flag : flag + " " + value_of(option);
}

}  // namespace

std::string flag_of(const std::string& field) {
    const auto flag = kFlags.find(field);
    return flag != kFlags.end() ? flag->second : "";
}

std::string with_flags(const std::string& message) { return replace_names(message, spell); }

}  // namespace covol::tool
