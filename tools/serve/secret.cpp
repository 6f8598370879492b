#include "serve/secret.h"

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "covol/error.h"

namespace covol::serve {

std::string random_secret() {
    std::array<unsigned char, 32> bytes{};
    for (std::size_t filled = 0; filled < bytes.size();) {
        const ssize_t count = ::getrandom(bytes.data() + filled, bytes.size() - filled, 0);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) {
            throw Error(Errc::Io, std::string("no random numbers for a secret: ") + std::strerror(errno));
        }
        filled += std::size_t(count);
    }
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const unsigned char byte : bytes) {
        text += kDigits[byte >> 4];
        text += kDigits[byte & 15];
    }
    return text;
}

bool is_same_secret(std::string_view secret, std::string_view guess) {
    if (secret.size() != guess.size()) return false;
    // Volatile, because a compiler could otherwise end the loop at the first difference.
    volatile unsigned char difference = 0;
    for (std::size_t n = 0; n < secret.size(); ++n) {
        difference = static_cast<unsigned char>(difference | (secret[n] ^ guess[n]));
    }
    return difference == 0;
}

}  // namespace covol::serve
