#pragma once
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "io/pixels/chunks.h"

namespace covol::detail {

/// The most recently used chunks of one or several sources, up to a total size. Thread-safe: if two threads request the
/// same chunk, it is decoded once.
class ChunkCache {
public:
    /// The voxels of a chunk, as read by ChunkSource::read(). They remain valid after the cache has evicted the chunk.
    using Chunk = std::shared_ptr<const char[]>;

    /// @param max_bytes  maximum size in bytes of all chunks together; a chunk that is larger than this is kept until
    /// the next one is decoded
    explicit ChunkCache(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

    /// @param source  has to outlive the cache
    /// @throws as ChunkSource::read(), and Error InvalidInput at a value that is NaN or infinite.
    [[nodiscard]] Chunk get(const ChunkSource& source, const Index3& chunk);

    [[nodiscard]] std::uint64_t bytes() const;  ///< size of all chunks in the cache
    [[nodiscard]] std::uint64_t max_bytes() const noexcept { return max_bytes_; }
    [[nodiscard]] std::uint64_t decoded()
        const;  ///< number of chunks decoded so far; a chunk that was evicted counts again

private:
    struct Key {
        const ChunkSource* source = nullptr;
        Index3 chunk{0, 0, 0};
        friend bool operator==(const Key&, const Key&) = default;
    };
    struct Hash {
        [[nodiscard]] std::size_t operator()(const Key& key) const noexcept;
    };
    /// A chunk. The mutex is locked while the chunk is decoded, so that other threads wait for it.
    struct Slot {
        std::mutex mutex;
        Chunk voxels;
    };
    struct Entry {
        std::shared_ptr<Slot> slot;
        std::list<Key>::iterator place;
        std::uint64_t bytes = 0;
    };

    [[nodiscard]] std::shared_ptr<Slot> slot_of(const Key& key);
    [[nodiscard]] Chunk fill_of(const ChunkSource& source);
    void count(const Key& key, std::uint64_t bytes);

    const std::uint64_t max_bytes_;
    mutable std::mutex mutex_;
    std::list<Key> order_;  ///< most recently used first
    std::unordered_map<Key, Entry, Hash> entries_;
    /// A chunk of fill values for each source, which represents all its missing chunks.
    std::unordered_map<const ChunkSource*, Chunk> fills_;
    std::uint64_t bytes_ = 0, decoded_ = 0;
};

}  // namespace covol::detail
