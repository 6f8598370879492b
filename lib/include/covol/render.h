#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/run.h"

namespace covol {

/// 8-bit RGB, rows from the top.
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

struct RenderOptions {
    int width = 1200, height = 800;
    int slices = 3;  ///< slice panels beside the shaded surface, spread over the structure; 0: none
    [[nodiscard]] COVOL_API std::string why_invalid() const;
};

/// The shaded surface (OpenVDB's ray tracer), and slices of the image with the surface's outline and the points.
[[nodiscard]] COVOL_API Picture render(const FloatGrid& surface, const Image& image, const std::vector<Vec3>& points,
                                       const RenderOptions& options = {}, const RunContext& run = {});
/// The shaded surface from two sides.
[[nodiscard]] COVOL_API Picture render(const FloatGrid& surface, const RenderOptions& options = {},
                                       const RunContext& run = {});

/// Whole or not at all. @throws Error Io.
COVOL_API void write_png(const std::string& path, const Picture& picture);

}  // namespace covol
