#include "io/pixels/packed_chunks.h"

#include <algorithm>
#include <vector>

#include "io/pixels/inflate.h"

namespace covol::detail {
namespace {

// Maximum size of a chunk in voxels. It has few slices because reading a chunk decompresses each of its slices, up to
// the last row of the chunk, as a whole.
constexpr Index3 kMaxChunk{64, 64, 16};

class PackedChunks : public ChunkSource {
public:
    PackedChunks(const std::string& path, PixelPlace place, const PackedFrame& frame, const RunContext& run)
        : ChunkSource(path, frame.type, frame.size, packed_chunk_size(frame.size)),
          place_(std::move(place)),
          frame_(frame),
          row_bytes_(std::uint64_t(frame.size[0]) * frame.components * place_.stored_bytes()),
          slice_bytes_(row_bytes_ * std::uint64_t(frame.size[1])),
          index_(place_.path, place_.file_offset, frame.begin + slice_bytes_ * std::uint64_t(frame.size[2]),
                 frame.is_last, run) {}

    [[nodiscard]] bool read(const Index3& chunk, void* out) const override {
        read_layer({chunk}, {out});
        return true;
    }

    [[nodiscard]] bool in_layers() const noexcept override { return true; }

    void read_layer(const std::vector<Index3>& chunks, const std::vector<void*>& out) const override {
        const auto by_row = [](const Index3& a, const Index3& b) { return a[1] < b[1]; };
        const auto [low, high] = std::minmax_element(chunks.begin(), chunks.end(), by_row);
        const Index3 &n = chunk_size(), &size = this->size();
        const std::int32_t first_row = (*low)[1] * n[1], rows = std::min((*high)[1] * n[1] + n[1], size[1]) - first_row;
        const std::int32_t first_slice = chunks.front()[2] * n[2], slices = std::min(n[2], size[2] - first_slice);
        const std::uint64_t width = place_.stored_bytes(), out_width = pixel_bytes(type());
        std::vector<char> stored(std::uint64_t(rows) * row_bytes_);
        IndexedInflater stream(
            index_, frame_.begin + std::uint64_t(first_slice) * slice_bytes_ + std::uint64_t(first_row) * row_bytes_);
        for (std::int32_t k = 0; k < slices; ++k) {
            if (!(k == 0 || stream.skip(slice_bytes_ - stored.size())) || !stream.read(stored.data(), stored.size()))
                throw read_error(Errc::InvalidInput, path(), "damaged or truncated");
            if (place_.swap) swap_bytes(stored.data(), stored.size() / width, width);
            for (std::size_t c = 0; c < chunks.size(); ++c) {
                const std::int32_t x = chunks[c][0] * n[0], y = chunks[c][1] * n[1];
                const std::uint64_t columns = std::uint64_t(std::min(n[0], size[0] - x));
                for (std::int32_t j = 0; j < std::min(n[1], size[1] - y); ++j) {
                    const char* from = stored.data() + std::uint64_t(y - first_row + j) * row_bytes_ +
                                       (std::uint64_t(x) * frame_.components + frame_.channel) * width;
                    char* to = static_cast<char*>(out[c]) + (std::uint64_t(k) * n[1] + j) * n[0] * out_width;
                    convert_pixels(place_, from, frame_.components, columns, type(), to);
                }
            }
        }
    }

private:
    PixelPlace place_;
    PackedFrame frame_;
    std::uint64_t row_bytes_, slice_bytes_;
    InflateIndex index_;
};

}  // namespace

Index3 packed_chunk_size(const Index3& size) {
    return {std::min(size[0], kMaxChunk[0]), std::min(size[1], kMaxChunk[1]), std::min(size[2], kMaxChunk[2])};
}

std::shared_ptr<const ChunkSource> packed_chunks(const std::string& path, const PixelPlace& place,
                                                 const PackedFrame& frame, const RunContext& run) {
    return std::make_shared<PackedChunks>(path, place, frame, run);
}

}  // namespace covol::detail
