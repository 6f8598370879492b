#include "io/pixels/chunk_cache.h"

#include <utility>

namespace covol::detail {
namespace {

std::uint64_t chunk_bytes(const ChunkSource& source) {
    return voxel_count(source.chunk_size()) * pixel_bytes(source.type());
}

std::shared_ptr<char[]> memory_for(const ChunkSource& source) {
    return std::shared_ptr<char[]>(new char[chunk_bytes(source)]);
}

}  // namespace

std::size_t ChunkCache::Hash::operator()(const Key& key) const noexcept {
    std::size_t hash = std::hash<const void*>()(key.source);
    for (const std::int32_t n : key.chunk) hash = hash * 1000003U + std::size_t(n);
    return hash;
}

std::shared_ptr<ChunkCache::Slot> ChunkCache::slot_of(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(key);
    if (found != entries_.end()) {
        order_.splice(order_.begin(), order_, found->second.place);
        return found->second.slot;
    }
    order_.push_front(key);
    return entries_.emplace(key, Entry{std::make_shared<Slot>(), order_.begin(), 0}).first->second.slot;
}

ChunkCache::Chunk ChunkCache::fill_of(const ChunkSource& source) {
    const std::lock_guard lock(mutex_);
    Chunk& fill = fills_[&source];
    if (!fill) {
        const std::shared_ptr<char[]> voxels = memory_for(source);
        source.fill(voxels.get());
        fill = voxels;
    }
    return fill;
}

/// Adds the size of a chunk that was just decoded to the size of the cache, and evicts the least recently used chunks
/// if necessary.
void ChunkCache::count(const Key& key, std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    ++decoded_;
    const auto own = entries_.find(key);
    if (own == entries_.end()) return;  // The chunk has been evicted meanwhile, so only the caller holds it.
    own->second.bytes = bytes;
    bytes_ += bytes;
    while (bytes_ > max_bytes_ && order_.size() > 1) {
        const auto last = entries_.find(order_.back());
        if (last == own) break;
        bytes_ -= last->second.bytes;
        entries_.erase(last);
        order_.pop_back();
    }
}

ChunkCache::Chunk ChunkCache::get(const ChunkSource& source, const Index3& chunk) {
    const Key key{&source, chunk};
    const std::shared_ptr<Slot> slot = slot_of(key);
    const std::lock_guard lock(slot->mutex);
    if (slot->voxels) return slot->voxels;
    std::shared_ptr<char[]> voxels = memory_for(source);
    const bool is_there = source.read(chunk, voxels.get());
    if (is_there) require_finite(source, part_of(whole_box(source.size()), chunk, source.chunk_size()), voxels.get());
    slot->voxels = is_there ? Chunk(std::move(voxels)) : fill_of(source);
    count(key, is_there ? chunk_bytes(source) : 0);
    return slot->voxels;
}

std::uint64_t ChunkCache::bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
}

std::uint64_t ChunkCache::decoded() const {
    const std::lock_guard lock(mutex_);
    return decoded_;
}

}  // namespace covol::detail
