#pragma once
#include <functional>
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// How messages of errors and logs name fields of options: in backquotes, `roi`, or with a value that would help,
/// `delta = 0.5`, or several, `space = Index, order = ZYX`. A program whose users know the fields by other names, as
/// flags or as entries of a form, puts those there.
struct NamedOption {
    std::string field;  ///< of one of the structs of options
    std::string value;  ///< as in C++, an enumerator without its type; empty where the message gives none
};

/// All that the message names, in its order.
[[nodiscard]] COVOL_API std::vector<NamedOption> find_named_options(const std::string& message);

/// The message with each of them, its backquotes included, as `name` writes it; several in one pair stand side by side.
[[nodiscard]] COVOL_API std::string replace_names(const std::string& message,
                                                  const std::function<std::string(const NamedOption&)>& name);

}  // namespace covol
