#pragma once
#include <array>
#include <optional>
#include <string>

#include "covol/api.h"
#include "covol/image_levels.h"
#include "covol/mesh.h"
#include "covol/run.h"

// What a page in a browser asks a program for, piece by piece. docs/mark_protocol.md has the bytes.
namespace covol {

/// What a page wants to see of an image.
struct SliceRequest {
    int axis = 2;  ///< 0, 1, 2: perpendicular to i, j, k; the other two are, in their order, right and down
    int at = 0;    ///< voxel along that axis
    int step = 1;  ///< voxels along an edge of a pixel, >= 1
    /// Pixels: first and number to the right and down. What lies beyond the slice is left out.
    struct Part {
        int x = 0, y = 0, width = 0, height = 0;
    };
    std::optional<Part> part;  ///< none: the whole slice
};

/// A slice of an image for a browser.
struct PageSlice {
    int width = 0, height = 0;
    int factor = 1;  ///< voxels along the longest edge of those that it was made from: above 1 a coarser level's
    /// A zlib stream (RFC 1950) of 16-bit numbers, the low byte first, row by row: 0 is range[0] and 65535 range[1].
    std::string bytes;
};

/// Of a slice every voxel, or means of step x step of them; at the end of a row or column of what is left. Of an image
/// with coarser levels the coarsest one that suffices is looked at: its slice is that of thicker voxels.
/// @param range  values beyond it are cut off
/// @throws Error InvalidOptions (it lies outside of the image); what reading the image throws; Cancelled.
[[nodiscard]] COVOL_API PageSlice make_page_slice(const ImageLevels& image, const SliceRequest& wanted,
                                                  const std::array<double, 2>& range, const RunContext& run = {});

/// A picture of any plane, in voxels of the image.
struct ObliqueRequest {
    Vec3 first{0, 0, 0};                 ///< the first pixel's middle
    Vec3 right{0, 0, 0}, down{0, 0, 0};  ///< from a pixel to its neighbours
    int count = 0;                       ///< pixels along each side, 1 to 1024
};

/// As make_page_slice(), sampled trilinearly; what lies outside of the image is 0.
/// @throws Error InvalidOptions (a number that is not finite, too many pixels); what reading the image throws;
/// Cancelled.
[[nodiscard]] COVOL_API PageSlice make_oblique_slice(const ImageLevels& image, const ObliqueRequest& wanted,
                                                     const std::array<double, 2>& range, const RunContext& run = {});

/// A mesh for a browser: a zlib stream of the counts of vertices and triangles (32 bits each), the box (six floats),
/// the lengths of what follows (32 bits each), and the vertices and corners as mesh_codec.h codes them.
[[nodiscard]] COVOL_API std::string make_page_mesh(const TriangleMesh& mesh);

}  // namespace covol
