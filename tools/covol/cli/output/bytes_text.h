#pragma once
#include <string>

namespace covol::tool {

/// "12 MiB", and from 1 GiB "1.5 GiB": the units of --memory-limit.
[[nodiscard]] std::string bytes_text(double bytes);

}  // namespace covol::tool
