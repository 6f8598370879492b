#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/pixels/raw_image.h"

// Images that are stored in chunks, which are boxes of equal size that can be decoded separately: chunks of a Zarr
// store or an HDF5 dataset, tiles or strips of a TIFF.
namespace covol::detail {

/// One channel and frame of an image that is stored in chunks.
class ChunkSource {
public:
    ChunkSource(const ChunkSource&) = delete;
    ChunkSource& operator=(const ChunkSource&) = delete;
    virtual ~ChunkSource() = default;

    /// Decodes the chunk with these indices along i, j, k, counted from 0, into chunk_size() voxels, i fastest; the
    /// values beyond the end of the image are undefined. Thread-safe. @returns false if the file has no such chunk: its
    /// voxels are fill_value(), and `out` is unchanged. @throws Error InvalidInput (damaged), Io, Unsupported.
    [[nodiscard]] virtual bool read(const Index3& chunk, void* out) const = 0;
    /// The value of all voxels in chunks that the file does not have.
    [[nodiscard]] virtual double fill_value() const noexcept { return 0; }
    /// Like read(), but writes fill values if the file has no such chunk.
    void read_or_fill(const Index3& chunk, void* out) const;
    /// Sets the voxels of one chunk at `out` to fill_value().
    void fill(void* out) const;

    /// Whether decoding all chunks with the same k takes little longer than decoding one of them. ChunkedVoxels::load()
    /// then decodes them together.
    [[nodiscard]] virtual bool in_layers() const noexcept { return false; }
    /// Decodes chunks that have the same k: chunks[n] to out[n].
    virtual void read_layer(const std::vector<Index3>& chunks, const std::vector<void*>& out) const;

    [[nodiscard]] const std::string& path() const noexcept { return path_; }  ///< for messages
    [[nodiscard]] PixelType type() const noexcept { return type_; }
    [[nodiscard]] const Index3& size() const noexcept { return size_; }              ///< size of the image in voxels
    [[nodiscard]] const Index3& chunk_size() const noexcept { return chunk_size_; }  ///< voxels along i, j, k; >= 1

protected:
    /// @throws Error InvalidInput, Unsupported if chunks are larger than kMaxChunkBytes or have no voxels.
    ChunkSource(std::string path, PixelType type, const Index3& size, const Index3& chunk_size);

private:
    std::string path_;
    PixelType type_;
    Index3 size_, chunk_size_;
};

/// The intersection of `box` with a chunk; `size` is the size of a chunk.
[[nodiscard]] VoxelBox part_of(const VoxelBox& box, const Index3& chunk, const Index3& size);
/// The range of chunks that intersect the box.
[[nodiscard]] VoxelBox chunks_around(const VoxelBox& box, const Index3& chunk_size);
/// @param box  the part of the image that a chunk covers
/// @param chunk  the decoded voxels of this chunk
/// @throws Error InvalidInput at the first voxel of `box` that is NaN or infinite.
void require_finite(const ChunkSource& source, const VoxelBox& box, const void* chunk);

/// Maximum size of an unpacked chunk. The usual size is below 16 MiB; the codecs of Zarr cannot unpack more than 2 GiB.
constexpr std::uint64_t kMaxChunkBytes = std::uint64_t(1) << 30;

/// The chunks of a source. A chunk is decoded when its first voxel is requested, and is kept in memory. All chunks that
/// are missing in the file are represented by one chunk of fill values. Thread-safe.
class ChunkedVoxels {
public:
    explicit ChunkedVoxels(std::shared_ptr<const ChunkSource> source);
    ~ChunkedVoxels();
    ChunkedVoxels(const ChunkedVoxels&) = delete;
    ChunkedVoxels& operator=(const ChunkedVoxels&) = delete;

    [[nodiscard]] const ChunkSource& source() const noexcept { return *source_; }
    [[nodiscard]] std::uint64_t chunk_count() const noexcept;                   ///< number of chunks in the whole image
    [[nodiscard]] std::uint64_t read_count() const noexcept { return reads_; }  ///< number of chunks decoded so far

    /// Copies the values of `box`, i fastest, in the source's type. @throws as ChunkSource::read, and InvalidInput at a
    /// value that is NaN or infinite.
    void copy(const VoxelBox& box, void* out) const;
    [[nodiscard]] double at(const Index3& voxel) const;
    /// Decodes the chunks that intersect the boxes and are not decoded yet, in the file's order and in parallel.
    /// Without load(), at() and copy() have the same results, but decode one chunk after another. Reports the progress
    /// as "image".
    /// @throws as copy(), and Error Cancelled, InvalidOptions if the chunks need more than run.memory_budget.
    void load(const std::vector<VoxelBox>& boxes, const RunContext& run) const;
    /// The numbers of the chunks that were requested so far, ascending. The numbers depend only on the requests, not on
    /// the number of threads. This function must not be called while other threads decode chunks.
    [[nodiscard]] std::vector<std::uint64_t> read_chunks() const;
    /// The box of a chunk's voxels within the image.
    [[nodiscard]] VoxelBox box_of(std::uint64_t chunk) const noexcept;

private:
    struct Table;
    [[nodiscard]] std::uint64_t number_of(const Index3& chunk) const noexcept;
    [[nodiscard]] Index3 place_of(std::uint64_t number) const noexcept;
    [[nodiscard]] const char* chunk(std::uint64_t number) const;
    [[nodiscard]] const char* fill_chunk() const;
    [[nodiscard]] bool is_there(std::uint64_t number) const;
    void keep(std::uint64_t number, std::unique_ptr<char[]> voxels) const;
    [[nodiscard]] std::unique_ptr<char[]> chunk_memory() const;
    /// Decodes several chunks of one layer in one call of ChunkSource::read_layer().
    void load_together(const std::vector<std::uint64_t>& numbers) const;

    std::shared_ptr<const ChunkSource> source_;
    Index3 counts_;  ///< number of chunks along i, j, k
    std::uint64_t serial_;
    std::unique_ptr<Table> table_;
    mutable std::atomic<std::uint64_t> reads_{0};
};

/// The voxels of `box`. If is_worth_mapping() returns true for the size of the box, its chunks are decoded on demand;
/// the chunks of a smaller box are decoded immediately.
[[nodiscard]] Pixels read_chunks(std::shared_ptr<const ChunkSource> source, const VoxelBox& box, const RunContext& run);

/// An image file in a format that always stores images in chunks.
class ChunkedFile : public ImageFile {
public:
    [[nodiscard]] Pixels read(const PixelRequest& request, const RunContext& run) final {
        return read_chunks(chunks(request), request.box, run);
    }
    [[nodiscard]] std::uint64_t bytes_to_hold(const PixelRequest& request) const final;
    [[nodiscard]] std::shared_ptr<const ChunkSource> chunk_source(const PixelRequest& request) const final {
        return chunks(request);
    }

protected:
    /// The chunks of the request's channel and frame; its box is ignored.
    [[nodiscard]] virtual std::shared_ptr<const ChunkSource> chunks(const PixelRequest& request) const = 0;
};

}  // namespace covol::detail
