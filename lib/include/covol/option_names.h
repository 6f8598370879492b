#pragma once
#include <functional>
#include <string>

#include "covol/api.h"

namespace covol {

/// How an option is shown that messages of errors and logs name in backquotes, `roi`, or with a value that would help,
/// `delta = 0.5`. Names are those of the tables (options_table.h). @param value  empty where the message gives none
using SpellOption = std::function<std::string(const std::string& name, const std::string& value)>;

/// The message with each of them, its backquotes included, as `spell` writes it; several in one pair, as in
/// `points_space = index, points_order = zyx`, stand side by side.
[[nodiscard]] COVOL_API std::string replace_names(const std::string& message, const SpellOption& spell);

}  // namespace covol
