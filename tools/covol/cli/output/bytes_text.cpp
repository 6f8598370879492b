#include "cli/output/bytes_text.h"

#include <cstdio>

namespace covol::tool {

std::string bytes_text(double bytes) {
    constexpr double kMebibyte = 1 << 20, kGibibyte = 1 << 30;
    char text[32];
    if (bytes < kGibibyte)
        std::snprintf(text, sizeof text, "%.0f MiB", bytes / kMebibyte);
    else
        std::snprintf(text, sizeof text, "%.1f GiB", bytes / kGibibyte);
    return text;
}

}  // namespace covol::tool
