#pragma once
#include <functional>
#include <string>

#include "covol/api.h"

namespace covol {

/// Formats the name of an option, which messages of errors and logs contain in backquotes, `roi`, possibly with a value
/// that would help, `delta = 0.5`. Names are those of the tables (options_table.h).
/// @param value  empty if the message contains none
using SpellOption = std::function<std::string(const std::string& name, const std::string& value)>;

/// The message with each of them, including its backquotes, as formatted by `spell`; several in one pair of backquotes,
/// as in `points_space = index, points_order = zyx`, are formatted one after the other.
[[nodiscard]] COVOL_API std::string replace_names(const std::string& message, const SpellOption& spell);

}  // namespace covol
