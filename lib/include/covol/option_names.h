#pragma once
#include <functional>
#include <string>

#include "covol/api.h"

namespace covol {

/// Formats the name of an option for the user. Error messages and log lines contain such names in backquotes, as in
/// `roi`, possibly with a value that would help, as in `delta = 0.5`. The names are those of the tables
/// (options_table.h).
/// @param value  empty if the message contains none
using SpellOption = std::function<std::string(const std::string& name, const std::string& value)>;

/// The message with each name, including its backquotes, replaced by the result of `spell`; several names in one pair
/// of backquotes, as in `points_space = index, points_order = zyx`, are formatted separately.
[[nodiscard]] COVOL_API std::string replace_names(const std::string& message, const SpellOption& spell);

}  // namespace covol
