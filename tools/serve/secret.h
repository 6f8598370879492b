#pragma once
#include <string>
#include <string_view>

namespace covol::serve {

/// 256 bits of the system's random source, as 64 hexadecimal digits. @throws Error Io.
[[nodiscard]] std::string random_secret();

/// Whether they are the same text. The time depends on their lengths alone, so a wrong guess does not tell how much of
/// it was right.
[[nodiscard]] bool is_same_secret(std::string_view secret, std::string_view guess);

}  // namespace covol::serve
