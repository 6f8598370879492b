#include "cli/option_names.h"

#include <CLI/CLI.hpp>
#include <map>

#include "covol/option_names.h"

namespace covol::tool {
namespace {

/// Of every field that the library's messages name (tests/lint/flags_test.py looks for them here).
const std::map<std::string, std::string> kFlags{
    {"channel", "--channel"},
    {"channels", "--points-channels"},
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
    {"outside", "--outside"},
    {"rho", "--rho"},
    {"roi", "--roi"},
    {"scale", "--points-scale"},
    {"space", "--points-space"},
    {"spacing", "--spacing"},
    {"start", "--init"},
    {"tag_distance", "--tag-distance"},
    {"thickness", "--contour-thickness"},
    {"voxel_size", "--voxel-size"},
};

/// Choices are enumerators there, and words in lower case here.
std::string value_of(const NamedOption& option) {
    return option.value == "IndexOne" ? "index1" : CLI::detail::to_lower(option.value);
}

std::string spell(const NamedOption& option) {
    const auto flag = kFlags.find(option.field);
    if (flag == kFlags.end()) return "`" + option.field + (option.value.empty() ? "" : " = " + option.value) + "`";
    return option.value.empty() ? flag->second : flag->second + " " + value_of(option);
}

}  // namespace

std::string with_flags(const std::string& message) { return replace_names(message, spell); }

}  // namespace covol::tool
