#include "io/chunked/zarr_chunks.h"

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

/// Position and size of a chunk in the file of its shard, in bytes. Both are 2^64 - 1 if the shard lacks the chunk.
struct ShardEntry {
    std::uint64_t begin = 0, bytes = 0;
};
using ShardIndex = std::vector<ShardEntry>;

/// Keeps the index (one ShardEntry for each chunk) of each shard that was read. If the indices would exceed
/// kMaxEntries, all of them are removed.
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
        if (indices_.size() >= std::max<std::uint64_t>(1, kMaxEntries / count_)) indices_.clear();
        indices_[path] = index;
        return index;
    }

private:
    /// Maximum number of ShardEntry objects that are kept; this number of them occupies 64 MiB.
    static constexpr std::uint64_t kMaxEntries = std::uint64_t(1) << 22;

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

class ZarrChunks : public ArrayChunks {
public:
    ZarrChunks(const ZarrArray& array, const ArrayAxes& axes, const Index3& size, std::uint64_t channel,
               std::uint64_t frame)
        : ArrayChunks(array.folder, array, axes, size, channel, frame), array_(array), indices_(array) {}

protected:
    [[nodiscard]] std::optional<Bytes> elements(const std::vector<std::uint64_t>& place) const override {
        std::string path;
        std::optional<Bytes> packed = array_.shards.counts.empty() ? read_file(place, path) : read_shard(place, path);
        if (packed) return unpack(path, array_.codecs, std::move(*packed), array_.chunk_bytes());
        check_missing(path);
        return std::nullopt;
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
        std::uint64_t number = 0;  // index of the chunk within the shard; the last dimension varies fastest
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
            throw read_error(Errc::InvalidInput, path,
                             "damaged or truncated: according to its index, chunk " + std::to_string(number) +
                                 " lies beyond its end");
        check_packed(path, entry.bytes);
        return file->read(entry.begin, entry.bytes);
    }

    void check_packed(const std::string& path, std::uint64_t bytes) const {
        const std::uint64_t expected = array_.chunk_bytes();
        const std::uint64_t maximum = array_.codecs.empty() ? expected : max_packed_bytes(expected);
        if (bytes > maximum)
            throw read_error(Errc::InvalidInput, path,
                             "expected a chunk of " + std::to_string(expected) + " bytes, got " +
                                 std::to_string(bytes) + (array_.codecs.empty() ? "" : " compressed ones"));
    }

    /// Checks that the voxels of a missing chunk can be set to the fill value. @throws Error Io if the array itself no
    /// longer exists, InvalidInput if the fill value is not finite.
    void check_missing(const std::string& path) const {
        std::error_code status;
        if (!std::filesystem::exists(array_.metadata, status))
            throw read_error(Errc::Io, path, "the store was removed: " + array_.metadata + " no longer exists");
        if (!std::isfinite(array_.fill))
            throw read_error(Errc::InvalidInput, path,
                             "expected finite values, got a chunk that is missing and a fill_value that is not finite");
    }

    const ZarrArray array_;
    ShardIndices indices_;
};

}  // namespace

std::shared_ptr<const ChunkSource> zarr_chunks(const ZarrArray& array, const ArrayAxes& axes, const Index3& size,
                                               std::uint64_t channel, std::uint64_t frame) {
    return std::make_shared<ZarrChunks>(array, axes, size, channel, frame);
}

}  // namespace covol::detail
