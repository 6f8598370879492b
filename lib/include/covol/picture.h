#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "covol/api.h"

namespace covol {

/// A picture with 8-bit RGB values, the top row first.
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

/// Writes the file completely or not at all. @throws Error Io.
COVOL_API void write_png(const std::string& path, const Picture& picture);

}  // namespace covol
