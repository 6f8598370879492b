#pragma once
#include <string>
#include <string_view>

namespace covol::serve {

/// 256 bits of the system's random source, as 64 hexadecimal digits. @throws Error Io.
[[nodiscard]] std::string random_secret();

/// Whether the texts are equal. The running time depends only on their lengths, so it does not reveal how much of a
/// wrong value is correct.
[[nodiscard]] bool is_same_secret(std::string_view secret, std::string_view guess);

}  // namespace covol::serve
