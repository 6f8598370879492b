#pragma once
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "covol/api.h"
#include "covol/error.h"
#include "covol/fwd.h"

// Each struct of options is followed by a table of its fields, kOptions<Struct>: a tuple of Option, of Part for a
// nested struct, and of Rule for constraints that the range of one field cannot express. Validation, the command line
// and its help, Python's keyword arguments, reports and messages are generated from this table.
namespace covol {

enum class Unit {
    One,
    Length,  ///< world units; users may also give voxels, as in "3vx"
    Volume,  ///< world units^3; users give the edge length of a cube of this volume
    Voxels
};

/// The section of the help that lists an option, in the order of the help; None: the option is not listed, because only
/// callers of the library can set it.
enum class Group {
    Input,
    Marks,
    ReadingMarks,
    Clouds,
    Output,
    MeshFiles,
    Picture,
    Start,
    Domain,
    Edges,
    Flow,
    Numerics,
    Help,
    None
};

/// The jobs for which an option is offered.
enum class Offered {
    Always,
    WithImage,    ///< not for points alone
    PointsAlone,  ///< not for jobs with an image
    SingleStep    ///< only for commands that run this step alone, such as `covol evolve`
};

/// Finite numbers between two limits.
struct Range {
    double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
    bool above_min = false, below_max = false;  ///< whether the limit itself is excluded
    Unit unit = Unit::One;

    [[nodiscard]] COVOL_API bool holds(double value) const;
    /// The range for messages: "> 0", "16 to 2048".
    [[nodiscard]] COVOL_API std::string text() const;
    /// @throws Error InvalidOptions "name: expected > 0, got -1".
    COVOL_API void require(const std::string& name, double value) const;
};
[[nodiscard]] constexpr Range at_least(double min) { return {min}; }
[[nodiscard]] constexpr Range between(double min, double max) { return {min, max}; }
[[nodiscard]] constexpr Range counted_in(Unit unit, Range range) {
    range.unit = unit;
    return range;
}
inline constexpr Range kPositive{0, std::numeric_limits<double>::infinity(), true},
    kNotNegative = at_least(0), kFraction = between(0, 1), kBetween0And1{0, 1, true, true},
    kLength = counted_in(Unit::Length, kNotNegative), kPositiveLength = counted_in(Unit::Length, kPositive),
    kAnyLength = counted_in(Unit::Length, {}), kVolume = counted_in(Unit::Volume, kNotNegative);

/// The names of an enumeration's values as the user gives them, in the order of the values; null: it has no such names.
template <typename Enum>
inline constexpr auto kWords = nullptr;
template <typename Enum>
concept HasWords = std::is_enum_v<Enum> && !std::is_same_v<decltype(kWords<Enum>), const std::nullptr_t>;
template <HasWords Enum>
[[nodiscard]] constexpr const char* to_string(Enum value) {
    return kWords<Enum>[std::size_t(value)];
}

struct Place {
    Group group = Group::None;
    Offered offered = Offered::Always;
    constexpr Place() = default;
    constexpr Place(Group group_, Offered offered_ = Offered::Always) : group(group_), offered(offered_) {}
};
[[nodiscard]] constexpr Place with_image(Group group) { return {group, Offered::WithImage}; }
[[nodiscard]] constexpr Place points_alone(Group group) { return {group, Offered::PointsAlone}; }
[[nodiscard]] constexpr Place single_step(Group group) { return {group, Offered::SingleStep}; }

/// The description of an option, except for its type.
struct OptionInfo {
    const char* name;  ///< the name in messages and Python's keyword; with dashes, the flag of the command line
    Range range{};     ///< allowed range of a number, or of each number in a list
    Place place{};
    const char* text = "";             ///< one line of help; names of options in backquotes
    const char* automatic = "";        ///< description of the automatic choice, unless the default is a plain value
    const char* automatic_alone = "";  ///< the automatic choice of a command that runs the step alone, if it differs
};

template <typename Struct, typename Value>
struct Option : OptionInfo {
    Value Struct::*field;

    /// An option that is a number.
    constexpr Option(const char* name_, Value Struct::*field_, Range range_, Place place_, const char* text_,
                     const char* automatic_ = "", const char* alone = "")
        : OptionInfo{name_, range_, place_, text_, automatic_, alone}, field(field_) {}
    /// An option of another type.
    constexpr Option(const char* name_, Value Struct::*field_, Place place_, const char* text_,
                     const char* automatic_ = "", const char* alone = "")
        : OptionInfo{name_, {}, place_, text_, automatic_, alone}, field(field_) {}
    /// An option that only callers of the library can set.
    constexpr Option(const char* name_, Value Struct::*field_, Range range_ = {})
        : OptionInfo{name_, range_}, field(field_) {}
};

/// The options of a field that is itself a struct of options.
template <typename Struct, typename Inner>
struct Part {
    Inner Struct::*field;
};
template <typename Struct, typename Inner>
Part(Inner Struct::*) -> Part<Struct, Inner>;

template <typename Struct>
struct Rule {
    const char* name;  ///< name of the option that is reported if the rule is violated
    const char* expected;
    bool (*holds)(const Struct&);
};

template <typename Struct>
inline constexpr auto kOptions = nullptr;

/// Calls visit(const OptionInfo&, field) for each option, including the options of nested structs, in the tables'
/// order.
template <typename Options, typename Visit>
constexpr void for_each_option(Options& options, const Visit& visit) {
    const auto take = [&]<typename Row>(const Row& row) {
        if constexpr (std::is_base_of_v<OptionInfo, Row>)
            visit(static_cast<const OptionInfo&>(row), options.*row.field);
        else if constexpr (requires { row.field; })
            for_each_option(options.*row.field, visit);
    };
    std::apply([&](const auto&... row) { (take(row), ...); }, kOptions<std::remove_const_t<Options>>);
}

template <typename T>
inline constexpr bool kIsNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

/// For why_invalid(): appends a line "name: complaint" to `lines` unless the complaint is empty.
COVOL_API void add_complaint(std::string& lines, const char* name, const std::string& complaint);
/// Appends a line "name: expected RANGE, got VALUE" to `lines` if `value` is outside of the option's range.
COVOL_API void complain(std::string& lines, const OptionInfo& option, double value);

namespace detail {

template <typename Value>
void complain(std::string& lines, const OptionInfo& option, const Value& value) {
    if constexpr (requires { *value, value.has_value(); }) {
        if (value) complain(lines, option, *value);
    } else if constexpr (HasWords<Value>) {
        if (std::size_t(value) >= kWords<Value>.size())
            add_complaint(lines, option.name, "expected one of the values of its type");
    } else if constexpr (kIsNumber<Value>) {
        covol::complain(lines, option, double(value));
    } else if constexpr (requires { value[0] < value[0], value.size(); } && !std::is_same_v<Value, std::string>) {
        for (const auto& one : value) complain(lines, option, one);
    } else if constexpr (requires { value.min[0], value.max[0]; }) {  // a box
        for (std::size_t a = 0; a < value.min.size(); ++a)
            if (!(value.max[a] >= value.min[a]))
                add_complaint(lines, option.name, "expected min <= max along each axis");
    }
}

template <typename Options>
void complain_of(std::string& lines, const Options& options) {
    const auto check = [&]<typename Row>(const Row& row) {
        if constexpr (std::is_base_of_v<OptionInfo, Row>)
            complain(lines, row, options.*row.field);
        else if constexpr (requires { row.holds; })
            add_complaint(lines, row.name, row.holds(options) ? "" : std::string("expected ") + row.expected);
        else
            complain_of(lines, options.*row.field);
    };
    std::apply([&](const auto&... row) { (check(row), ...); }, kOptions<Options>);
}

}  // namespace detail

/// An empty text if the options are valid, else one line for each invalid field: "tau: expected > 0, got -1".
template <typename Options>
[[nodiscard]] std::string why_invalid(const Options& options) {
    std::string lines;
    detail::complain_of(lines, options);
    return lines;
}

/// @throws Error InvalidOptions, "function: tau: expected ...", if a field is invalid; Error::option() is the name of
/// the first invalid option.
template <typename Options>
void require_valid(const Options& options, const char* function) {
    const std::string why = why_invalid(options);
    if (!why.empty())
        throw Error(Errc::InvalidOptions, std::string(function) + ": " + why, why.substr(0, why.find(':')));
}

}  // namespace covol
