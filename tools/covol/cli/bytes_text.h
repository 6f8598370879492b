#pragma once
#include <string>

namespace covol::tool {

/// "12 MiB", from 1 GiB on "1.5 GiB": in the units of --memory-limit.
[[nodiscard]] std::string bytes_text(double bytes);

}  // namespace covol::tool
