#pragma once
#include <string>

namespace covol::tool {

/// The size as text: in MiB ("12 MiB"), or in GiB from 1 GiB on ("1.5 GiB").
[[nodiscard]] std::string bytes_text(double bytes);

}  // namespace covol::tool
