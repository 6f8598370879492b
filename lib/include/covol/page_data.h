#pragma once
#include <array>
#include <optional>
#include <string>

#include "covol/api.h"
#include "covol/image_levels.h"
#include "covol/mesh.h"
#include "covol/run.h"

// Data that a page in a browser requests piece by piece from a program. docs/mark_protocol.md specifies the bytes.
namespace covol {

/// The part of an image that a page requests.
struct SliceRequest {
    int axis = 2;  ///< 0, 1, 2: perpendicular to i, j, k; the other two axes are, in their order, right and down
    int at = 0;    ///< voxel along that axis
    int step = 1;  ///< voxels along an edge of a pixel, >= 1
    /// Pixels: first and number to the right and down. Parts beyond the slice are omitted.
    struct Part {
        int x = 0, y = 0, width = 0, height = 0;
    };
    std::optional<Part> part;  ///< none: the whole slice
};

/// A slice of an image for a browser.
struct PageSlice {
    int width = 0, height = 0;
    /// voxels along the longest edge of those that it was made from: above 1 it is from a coarser level
    int factor = 1;
    /// A zlib stream (RFC 1950) of 16-bit numbers, the low byte first, row by row: 0 is range[0] and 65535 range[1].
    std::string bytes;
};

/// Every voxel of a slice, or means of step x step voxels, of fewer at the end of a row or column. For an image with
/// coarser levels the coarsest one that suffices is used: its slice is that of thicker voxels.
/// @param range  values beyond it are clamped
/// @throws Error InvalidOptions (outside of the image); whatever reading the image throws; Cancelled.
[[nodiscard]] COVOL_API PageSlice make_page_slice(const ImageLevels& image, const SliceRequest& wanted,
                                                  const std::array<double, 2>& range, const RunContext& run = {});

/// A picture of an arbitrary plane, in voxels of the image.
struct ObliqueRequest {
    Vec3 first{0, 0, 0};                 ///< centre of the first pixel
    Vec3 right{0, 0, 0}, down{0, 0, 0};  ///< from a pixel to its neighbours
    int count = 0;                       ///< pixels along each side, 1 to 1024
};

/// As make_page_slice(), sampled trilinearly; pixels outside of the image are 0.
/// @throws Error InvalidOptions (a number that is not finite, too many pixels); whatever reading the image throws;
///     Cancelled.
[[nodiscard]] COVOL_API PageSlice make_oblique_slice(const ImageLevels& image, const ObliqueRequest& wanted,
                                                     const std::array<double, 2>& range, const RunContext& run = {});

/// A mesh for a browser: a zlib stream of the counts of vertices and triangles (32 bits each), the box (six floats),
/// the lengths of what follows (32 bits each), and the vertices and corners encoded as in mesh_codec.h.
[[nodiscard]] COVOL_API std::string make_page_mesh(const TriangleMesh& mesh);

}  // namespace covol
