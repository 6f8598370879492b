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

/// An image that is viewed in pieces at any zoom: with the coarser levels of its file, if it has a pyramid.
///
/// Of large images in chunks only those that are requested are decoded, and the most recently used ones are kept, up to
/// a limit. Image keeps all of them, which is right for computations, but not for a person who scrolls through a
/// terabyte.
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
        std::uint64_t bytes = 0, max_bytes = 0;  ///< that are kept; the limit
        std::uint64_t decoded = 0;               ///< chunks so far
    };

    /// The image as it is held in memory, without coarser levels.
    COVOL_API explicit ImageLevels(Image image);
    /// @param sources  from the finest level to the coarsest; the first contains the voxels of `image` itself. A level
    ///     is skipped if its voxels do not span a whole number of voxels of the finest level along each axis.
    /// @param max_bytes  limit of decoded chunks that are kept
    COVOL_API ImageLevels(Image image, const std::vector<Source>& sources, std::uint64_t max_bytes);

    [[nodiscard]] const Image& image() const noexcept { return image_; }
    [[nodiscard]] const std::vector<Level>& levels() const noexcept { return levels_; }  ///< the finest first
    [[nodiscard]] COVOL_API bool is_in_chunks() const noexcept;
    /// Voxels of a level's chunks; 0 for an image that is held in memory.
    [[nodiscard]] COVOL_API Index3 chunk_size(std::size_t level) const;
    /// The coarsest level that suffices if `step` voxels of the finest level make one pixel: `step` is a multiple of
    /// its factors. @param step  >= 1
    [[nodiscard]] COVOL_API std::size_t level_for(int step) const;
    /// The values of a box of a level's voxels, i fastest; its chunks are decoded in parallel.
    /// @pre the box lies in the level. @throws Error as Image::copy(); Cancelled.
    COVOL_API void copy(std::size_t level, const VoxelBox& box, float* out, const RunContext& run = {}) const;

    /// Minimum and maximum. For an image in chunks: of the pixel type if that is an 8-bit or 16-bit integer, otherwise
    /// of the voxels that percentiles() uses. For an image that is held in memory: Image::range().
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
    std::vector<std::shared_ptr<const detail::ChunkSource>> sources_;  // of the levels; empty: image_ is held in memory
    std::shared_ptr<detail::ChunkCache> cache_;
};

/// The image of `image.path()`, with its coarser levels.
/// @param options  those with which it was read
/// @param max_bytes  limit of decoded chunks that are kept
/// @throws Error as read_image(). A coarser level that is damaged is skipped with a warning.
[[nodiscard]] COVOL_API ImageLevels open_image_levels(const Image& image, const ReadImageOptions& options,
                                                      std::uint64_t max_bytes, const RunContext& run = {});

}  // namespace covol
