#pragma once
#include <array>
#include <string>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/mesh.h"
#include "covol/run.h"

// What a page in a browser asks a program for, piece by piece. docs/mark_protocol.md has the bytes.
namespace covol {

/// A slice of an image for a browser.
struct PageSlice {
    int width = 0, height = 0;
    /// A zlib stream (RFC 1950) of 16-bit numbers, the low byte first, row by row: 0 is range[0] and 65535 range[1].
    std::string bytes;
};

/// Of a slice every voxel, or means of step x step of them; at the end of a row or column of what is left.
/// @param axis  0, 1, 2: perpendicular to i, j, k; the other two are, in their order, right and down
/// @param at  voxel along that axis, held; @param step  >= 1
/// @param range  values beyond it are cut off
/// @throws Error InvalidOptions; what reading the image throws.
[[nodiscard]] COVOL_API PageSlice make_page_slice(const Image& image, int axis, int at, int step,
                                                  const std::array<double, 2>& range, const RunContext& run = {});

/// A mesh for a browser: a zlib stream of the counts of vertices and triangles (32 bits each), the box (six floats),
/// the lengths of what follows (32 bits each), and the vertices and corners as mesh_codec.h codes them.
[[nodiscard]] COVOL_API std::string make_page_mesh(const TriangleMesh& mesh);

}  // namespace covol
