#pragma once
#include <array>
#include <optional>
#include <string>

#include "covol/api.h"
#include "covol/image_levels.h"
#include "covol/mesh.h"
#include "covol/run.h"

// Data that a page in a browser requests in parts. docs/mark_protocol.md specifies the bytes.
namespace covol {

/// The part of an image that a page requests.
struct SliceRequest {
    /// 0, 1, 2: perpendicular to i, j, k; of the other two axes, the first points right and the second down
    int axis = 2;
    int at = 0;    ///< index of the voxel along that axis
    int step = 1;  ///< width of a pixel in voxels, >= 1
    /// A rectangle in pixels: its first pixel, width and height. Pixels beyond the slice are omitted.
    struct Part {
        int x = 0, y = 0, width = 0, height = 0;
    };
    std::optional<Part> part;  ///< none: the whole slice
};

/// A slice of an image for a browser.
struct PageSlice {
    int width = 0, height = 0;
    /// Longest edge of the voxels from which the slice was made, in voxels of the image; above 1 if these voxels belong
    /// to a coarser level of the image.
    int factor = 1;
    /// A zlib stream (RFC 1950) of 16-bit numbers, the low byte first, row by row: 0 stands for range[0] and 65535 for
    /// range[1], where `range` is the argument of make_page_slice() or make_oblique_slice().
    std::string bytes;
};

/// Makes a slice whose pixels are voxels or means of step x step voxels, of fewer voxels at the end of a row or column.
/// For an image with coarser levels, the slice is made from the coarsest level that suffices, whose voxels are also
/// thicker along the axis.
/// @param range  values beyond it are clamped
/// @throws Error InvalidOptions (outside of the image); whatever reading the image throws; Cancelled.
[[nodiscard]] COVOL_API PageSlice make_page_slice(const ImageLevels& image, const SliceRequest& wanted,
                                                  const std::array<double, 2>& range, const RunContext& run = {});

/// A square picture of an arbitrary plane; coordinates in voxels of the image.
struct ObliqueRequest {
    Vec3 first{0, 0, 0};                 ///< centre of the first pixel
    Vec3 right{0, 0, 0}, down{0, 0, 0};  ///< steps from a pixel to its right and lower neighbours
    int count = 0;                       ///< pixels along each side, 1 to 1024
};

/// Makes a slice in an oblique plane, sampled trilinearly; pixels outside of the image are 0.
/// @throws Error InvalidOptions (a number that is not finite, too many pixels); whatever reading the image throws;
///     Cancelled.
[[nodiscard]] COVOL_API PageSlice make_oblique_slice(const ImageLevels& image, const ObliqueRequest& wanted,
                                                     const std::array<double, 2>& range, const RunContext& run = {});

/// A mesh for a browser: a zlib stream of the counts of vertices and triangles (32 bits each), the box (six floats),
/// the lengths of what follows (32 bits each), and the vertices and corners encoded as in mesh_codec.h.
[[nodiscard]] COVOL_API std::string make_page_mesh(const TriangleMesh& mesh);

}  // namespace covol
