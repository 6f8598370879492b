#pragma once
#include <string>

#include "covol/options_table.h"

namespace covol::tool {

/// The flag of an option of the library: "--tag-distance" for "tag_distance".
[[nodiscard]] std::string flag_of(const std::string& name);

/// A message of the library with option names replaced by flags: "`tag_distance = 3`" becomes "--tag-distance 3".
[[nodiscard]] std::string with_flags(const std::string& message);

/// Like require_valid(), but the message names the flag of the first invalid option: "--edge-contrast: expected ...".
/// @throws Error InvalidOptions.
template <typename Options>
void require_valid_flags(const Options& options) {
    const std::string why = why_invalid(options), name = why.substr(0, why.find(':'));
    if (!why.empty())
        throw Error(Errc::InvalidOptions, flag_of(name) + why.substr(name.size(), why.find('\n') - name.size()), name);
}

}  // namespace covol::tool
