#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "covol/api.h"
#include "covol/image.h"
#include "covol/run.h"

namespace covol {

namespace detail {
class ChunkCache;
class ChunkSource;
}  // namespace detail

/// An image for viewing parts at any magnification, with the coarser levels of its file if it has a pyramid.
///
/// For large images in chunks, only requested chunks are decoded, and the most recently used ones are kept, up to a
/// memory limit. Image, in contrast, keeps all chunks that it has decoded, which suits computations but not the viewing
/// of images larger than the memory.
class ImageLevels {
public:
    struct Level {
        Index3 size{0, 0, 0};    ///< voxels along i, j, k
        Index3 factor{1, 1, 1};  ///< voxels of the finest level that one voxel of this level spans, >= 1
    };
    /// The chunks of a level, and its geometry in the file.
    struct Source {
        ImageGeometry geometry;
        std::shared_ptr<const detail::ChunkSource> chunks;
    };
    /// Statistics of the cache of decoded chunks.
    struct CacheUse {
        std::uint64_t bytes = 0, max_bytes = 0;  ///< size of the chunks that are kept, and its limit
        std::uint64_t decoded = 0;               ///< number of chunks decoded so far
    };

    /// An image that is held in memory, without coarser levels.
    COVOL_API explicit ImageLevels(Image image);
    /// @param sources  from the finest level to the coarsest; the first contains the voxels of `image` itself. A level
    ///     is skipped if its voxels do not span a whole number of voxels of the finest level along each axis.
    /// @param max_bytes  maximum size of the decoded chunks that are kept
    COVOL_API ImageLevels(Image image, const std::vector<Source>& sources, std::uint64_t max_bytes);

    [[nodiscard]] const Image& image() const noexcept { return image_; }
    [[nodiscard]] const std::vector<Level>& levels() const noexcept { return levels_; }  ///< the finest first
    [[nodiscard]] COVOL_API bool is_in_chunks() const noexcept;
    /// Size of a level's chunks along i, j, k in voxels; 0 for an image that is held in memory.
    [[nodiscard]] COVOL_API Index3 chunk_size(std::size_t level) const;
    /// The coarsest level that suffices for pixels that are `step` voxels of the finest level wide: the coarsest one
    /// for which `step` is a multiple of Level::factor along each axis. @param step  >= 1
    [[nodiscard]] COVOL_API std::size_t level_for(int step) const;
    /// Copies the values of a box of a level's voxels to `out`, i fastest; the box's chunks are decoded in parallel.
    /// @pre the box lies in the level. @throws Error as Image::copy(); Cancelled.
    COVOL_API void copy(std::size_t level, const VoxelBox& box, float* out, const RunContext& run = {}) const;

    /// Minimum and maximum. For an image in chunks: the limits of the pixel type if it is an 8-bit or 16-bit integer,
    /// otherwise those of the voxels that percentiles() uses. For an image that is held in memory: Image::range().
    [[nodiscard]] COVOL_API std::array<double, 2> range(const RunContext& run = {}) const;
    /// Intensities below which the fractions `low` and `high` of the voxels lie: of the coarsest level, or, if that is
    /// large, of some parts of it.
    [[nodiscard]] COVOL_API std::array<double, 2> percentiles(double low, double high,
                                                              const RunContext& run = {}) const;
    [[nodiscard]] COVOL_API CacheUse cache() const;

private:
    [[nodiscard]] std::vector<float> overview(const RunContext& run) const;

    Image image_;
    std::vector<Level> levels_;
    std::vector<std::shared_ptr<const detail::ChunkSource>> sources_;  // by level; empty: image_ is held in memory
    std::shared_ptr<detail::ChunkCache> cache_;
};

/// Returns the image with the coarser levels of its file `image.path()`; without them if it is held in memory.
/// @param options  the options with which `image` was read
/// @param max_bytes  maximum size of the decoded chunks that are kept
/// @throws Error as read_image(). A coarser level that is damaged is skipped with a warning.
[[nodiscard]] COVOL_API ImageLevels open_image_levels(const Image& image, const ReadImageOptions& options,
                                                      std::uint64_t max_bytes, const RunContext& run = {});

}  // namespace covol
