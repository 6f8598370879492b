#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// 8-bit RGB, rows from the top.
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

/// Whole or not at all. @throws Error Io.
COVOL_API void write_png(const std::string& path, const Picture& picture);

}  // namespace covol
