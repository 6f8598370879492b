#include "io/chunked/zarr_chunks.h"

#include <openvdb/math/Half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>

namespace covol::detail {
namespace {

/// Where a chunk lies in its shard.
struct ShardEntry {
    std::uint64_t begin = 0, bytes = 0;
};
using ShardIndex = std::vector<ShardEntry>;

/// The indices of the shards that were read last.
class ShardIndices {
public:
    explicit ShardIndices(const ZarrArray& array) : shards_(array.shards), count_(1) {
        for (const std::uint64_t n : shards_.counts) count_ *= n;
    }

    [[nodiscard]] std::shared_ptr<const ShardIndex> of(const std::string& path, const StoreFile& file) const {
        {
            const std::lock_guard lock(mutex_);
            if (const auto found = indices_.find(path); found != indices_.end()) return found->second;
        }
        std::shared_ptr<const ShardIndex> index = read(path, file);
        const std::lock_guard lock(mutex_);
        if (indices_.size() >= std::max<std::uint64_t>(1, kMostEntries / count_)) indices_.clear();
        indices_[path] = index;
        return index;
    }

private:
    static constexpr std::uint64_t kMostEntries = std::uint64_t(1) << 22;  ///< 64 MiB

    [[nodiscard]] std::shared_ptr<const ShardIndex> read(const std::string& path, const StoreFile& file) const {
        const std::uint64_t bytes = count_ * sizeof(ShardEntry) + (shards_.index_has_checksum ? 4 : 0);
        if (file.size() < bytes)
            throw read_error(Errc::InvalidInput, path,
                             "truncated: expected a shard with an index of " + std::to_string(bytes) + " bytes, got " +
                                 std::to_string(file.size()));
        Bytes stored = file.read(shards_.index_at_end ? file.size() - bytes : 0, bytes);
        if (shards_.index_has_checksum) take_crc32c(path, "the shard's index", stored);
        constexpr bool kBig = std::endian::native == std::endian::big;
        if (shards_.index_is_big_endian != kBig) swap_bytes(stored.data(), 2 * count_, sizeof(std::uint64_t));
        auto index = std::make_shared<ShardIndex>(count_);
        std::memcpy(index->data(), stored.data(), stored.size());
        return index;
    }

    const ZarrShards shards_;
    std::uint64_t count_;
    mutable std::mutex mutex_;
    mutable std::map<std::string, std::shared_ptr<const ShardIndex>> indices_;
};

/// Elements as they are stored, to pixels, `step` elements apart.
void convert_row(const ZarrArray& array, const char* from, std::uint64_t step, std::uint64_t count, char* to) {
    const std::uint64_t width = array.stored_bytes();
    if (step == 1 && !array.half) {
        std::memcpy(to, from, count * width);
    } else if (!array.half) {
        for (std::uint64_t n = 0; n < count; ++n) std::memcpy(to + n * width, from + n * step * width, width);
    } else {
        for (std::uint64_t n = 0; n < count; ++n) {
            std::uint16_t bits = 0;
            std::memcpy(&bits, from + n * step * width, width);
            if (array.swap) bits = static_cast<std::uint16_t>(bits << 8U | bits >> 8U);
            openvdb::math::internal::half value;
            value.setBits(bits);
            const auto pixel = float(value);
            std::memcpy(to + n * sizeof(pixel), &pixel, sizeof(pixel));
        }
        return;
    }
    if (array.swap) swap_bytes(to, count, width);
}

Index3 chunk_size_of(const ZarrArray& array, const ZarrAxes& axes) {
    Index3 size;
    for (int a = 0; a < 3; ++a) size[a] = static_cast<std::int32_t>(array.chunk[axes.space[a]]);
    return size;
}

class ZarrChunks : public ChunkSource {
public:
    ZarrChunks(const ZarrArray& array, const ZarrAxes& axes, const Index3& size, std::uint64_t channel,
               std::uint64_t frame)
        : ChunkSource(array.folder, array.type, size, chunk_size_of(array, axes)),
          array_(array),
          axes_(axes),
          place_(array.shape.size(), 0),
          indices_(array) {
        const auto choose = [&](const std::optional<std::size_t>& d, std::uint64_t number) {
            if (!d) return;
            place_[*d] = number / array_.chunk[*d];
            first_ += number % array_.chunk[*d] * array_.strides[*d];
        };
        choose(axes.channel, channel);
        choose(axes.frame, frame);
    }

    void read(const Index3& chunk, void* out) const override {
        std::vector<std::uint64_t> place = place_;
        for (int a = 0; a < 3; ++a) place[axes_.space[a]] = std::uint64_t(chunk[a]);
        std::string path;
        std::optional<Bytes> packed = array_.shards.counts.empty() ? read_file(place, path) : read_shard(place, path);
        if (!packed) return fill(path, out);
        const Bytes elements = unpack(path, array_.codecs, std::move(*packed), array_.chunk_bytes());
        gather(elements.data(), static_cast<char*>(out));
    }

private:
    [[nodiscard]] std::optional<Bytes> read_file(const std::vector<std::uint64_t>& place, std::string& path) const {
        path = array_.file_of(place);
        const std::optional<StoreFile> file = StoreFile::open(path);
        if (!file) return std::nullopt;
        check_packed(path, file->size());
        return file->read(0, file->size());
    }

    [[nodiscard]] std::optional<Bytes> read_shard(std::vector<std::uint64_t> place, std::string& path) const {
        std::uint64_t number = 0;  // in the shard, the last dimension fastest
        for (std::size_t d = 0; d < place.size(); ++d) {
            const std::uint64_t count = array_.shards.counts[d];
            number = number * count + place[d] % count;
            place[d] /= count;
        }
        path = array_.file_of(place);
        const std::optional<StoreFile> file = StoreFile::open(path);
        if (!file) return std::nullopt;
        const ShardEntry entry = (*indices_.of(path, *file))[number];
        constexpr std::uint64_t kMissing = std::numeric_limits<std::uint64_t>::max();
        if (entry.begin == kMissing && entry.bytes == kMissing) return std::nullopt;
        if (entry.begin > file->size() || entry.bytes > file->size() - entry.begin)
            throw read_error(
                Errc::InvalidInput, path,
                "damaged or truncated: its index says that chunk " + std::to_string(number) + " lies beyond its end");
        check_packed(path, entry.bytes);
        return file->read(entry.begin, entry.bytes);
    }

    void check_packed(const std::string& path, std::uint64_t bytes) const {
        const std::uint64_t expected = array_.chunk_bytes();
        const std::uint64_t most = array_.codecs.empty() ? expected : most_packed_bytes(expected);
        if (bytes > most)
            throw read_error(Errc::InvalidInput, path,
                             "expected a chunk of " + std::to_string(expected) + " bytes, got " +
                                 std::to_string(bytes) + (array_.codecs.empty() ? "" : " that are packed"));
    }

    /// A chunk that was never written has the fill value. One that cannot be found any more has none.
    void fill(const std::string& path, void* out) const {
        std::error_code status;
        if (!std::filesystem::exists(array_.metadata, status))
            throw read_error(Errc::Io, path, "the store is gone: " + array_.metadata + " is not there any more");
        if (!std::isfinite(array_.fill))
            throw read_error(Errc::InvalidInput, path,
                             "expected finite values, got a chunk that is missing and a fill_value that is not finite");
        with_pixel_type(array_.type, [&](auto pixel) {
            std::fill_n(static_cast<decltype(pixel)*>(out), voxel_count(chunk_size()),
                        static_cast<decltype(pixel)>(array_.fill));
        });
    }

    /// This channel and frame of a chunk, i fastest.
    void gather(const char* elements, char* out) const {
        const Index3& n = chunk_size();
        const std::uint64_t stored = array_.stored_bytes(), row = std::uint64_t(n[0]) * pixel_bytes(array_.type);
        std::array<std::uint64_t, 3> stride;
        for (int a = 0; a < 3; ++a) stride[a] = array_.strides[axes_.space[a]];
        for (std::int32_t k = 0; k < n[2]; ++k)
            for (std::int32_t j = 0; j < n[1]; ++j, out += row) {
                const std::uint64_t from = first_ + std::uint64_t(k) * stride[2] + std::uint64_t(j) * stride[1];
                convert_row(array_, elements + from * stored, stride[0], std::uint64_t(n[0]), out);
            }
    }

    const ZarrArray array_;
    const ZarrAxes axes_;
    std::vector<std::uint64_t> place_;  ///< of the channel and frame on the grid of chunks
    std::uint64_t first_ = 0;           ///< their first element in a chunk
    ShardIndices indices_;
};

}  // namespace

std::shared_ptr<const ChunkSource> zarr_chunks(const ZarrArray& array, const ZarrAxes& axes, const Index3& size,
                                               std::uint64_t channel, std::uint64_t frame) {
    return std::make_shared<ZarrChunks>(array, axes, size, channel, frame);
}

}  // namespace covol::detail
