#include "io/pixels/chunks.h"

#include <tbb/concurrent_unordered_map.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>

#include "limits/memory_budget.h"

namespace covol::detail {
namespace {

/// Copies the voxels of `part` from a chunk to `out`, which holds the voxels of `box`; both are stored i fastest.
void copy_part(const VoxelBox& part, const void* chunk, const Index3& chunk_size, const VoxelBox& box, void* out,
               std::uint64_t width) {
    const Index3 n = box.size();
    const std::uint64_t row = std::uint64_t(part.size()[0]) * width;
    for (std::int32_t k = part.min[2]; k <= part.max[2]; ++k)
        for (std::int32_t j = part.min[1]; j <= part.max[1]; ++j) {
            const std::uint64_t from =
                (std::uint64_t(k % chunk_size[2]) * chunk_size[1] + std::uint64_t(j % chunk_size[1])) * chunk_size[0] +
                std::uint64_t(part.min[0] % chunk_size[0]);
            const std::uint64_t to = (std::uint64_t(k - box.min[2]) * n[1] + std::uint64_t(j - box.min[1])) * n[0] +
                                     (part.min[0] - box.min[0]);
            std::memcpy(static_cast<char*>(out) + to * width, static_cast<const char*>(chunk) + from * width, row);
        }
}

}  // namespace

VoxelBox part_of(const VoxelBox& box, const Index3& chunk, const Index3& size) {
    VoxelBox part;
    for (int a = 0; a < 3; ++a) {
        const std::int64_t first = std::int64_t(chunk[a]) * size[a];
        part.min[a] = std::int32_t(std::max<std::int64_t>(box.min[a], first));
        part.max[a] = std::int32_t(std::min<std::int64_t>(box.max[a], first + size[a] - 1));
    }
    return part;
}

VoxelBox chunks_around(const VoxelBox& box, const Index3& chunk_size) {
    VoxelBox chunks;
    for (int a = 0; a < 3; ++a) {
        chunks.min[a] = box.min[a] / chunk_size[a];
        chunks.max[a] = box.max[a] / chunk_size[a];
    }
    return chunks;
}

void require_finite(const ChunkSource& source, const VoxelBox& box, const void* chunk) {
    with_pixel_type(source.type(), [&](auto pixel) {
        using T = decltype(pixel);
        if constexpr (std::is_floating_point_v<T>) {
            const Index3 &n = source.chunk_size(), held = box.size();
            for (std::int32_t k = 0; k < held[2]; ++k)
                for (std::int32_t j = 0; j < held[1]; ++j) {
                    const T* row = static_cast<const T*>(chunk) + (std::uint64_t(k) * n[1] + j) * n[0];
                    for (std::int32_t i = 0; i < held[0]; ++i)
                        if (!std::isfinite(row[i]))
                            throw not_finite(source.path(), {box.min[0] + i, box.min[1] + j, box.min[2] + k});
                }
        }
    });
}

ChunkSource::ChunkSource(std::string path, PixelType type, const Index3& size, const Index3& chunk_size)
    : path_(std::move(path)), type_(type), size_(size), chunk_size_(chunk_size) {
    std::uint64_t bytes = pixel_bytes(type);
    for (const std::int32_t n : chunk_size) {
        if (n < 1)
            throw read_error(Errc::InvalidInput, path_, "expected chunks of voxels, got " + size_text(chunk_size));
        bytes = bytes > kMaxChunkBytes ? bytes : bytes * std::uint64_t(n);
    }
    if (bytes > kMaxChunkBytes)
        throw read_error(Errc::Unsupported, path_,
                         "expected chunks of 1 GiB at most, got " + size_text(chunk_size) + " voxels of " +
                             std::to_string(pixel_bytes(type)) + " bytes; write it with smaller chunks");
}

void ChunkSource::read_layer(const std::vector<Index3>& chunks, const std::vector<void*>& out) const {
    for (std::size_t n = 0; n < chunks.size(); ++n) read_or_fill(chunks[n], out[n]);
}

void ChunkSource::read_or_fill(const Index3& chunk, void* out) const {
    if (!read(chunk, out)) fill(out);
}

void ChunkSource::fill(void* out) const {
    with_pixel_type(type_, [&](auto pixel) {
        std::fill_n(static_cast<decltype(pixel)*>(out), voxel_count(chunk_size_),
                    static_cast<decltype(pixel)>(fill_value()));
    });
}

struct ChunkedVoxels::Table {
    struct Entry {
        std::once_flag once;
        std::unique_ptr<char[]> own;   ///< null if the file has no such chunk
        const char* voxels = nullptr;  ///< points to `own`, or to fill values
        std::atomic<bool> is_there{false};
    };
    std::once_flag filled;
    std::unique_ptr<char[]> fill;
    tbb::concurrent_unordered_map<std::uint64_t, Entry> entries;
};

ChunkedVoxels::ChunkedVoxels(std::shared_ptr<const ChunkSource> source)
    : source_(std::move(source)), table_(std::make_unique<Table>()) {
    static std::atomic<std::uint64_t> next{1};
    serial_ = next++;
    for (int a = 0; a < 3; ++a) counts_[a] = (source_->size()[a] - 1) / source_->chunk_size()[a] + 1;
}

ChunkedVoxels::~ChunkedVoxels() = default;

std::uint64_t ChunkedVoxels::chunk_count() const noexcept { return voxel_count(counts_); }

std::uint64_t ChunkedVoxels::number_of(const Index3& c) const noexcept {
    return (std::uint64_t(c[2]) * counts_[1] + c[1]) * counts_[0] + c[0];
}

Index3 ChunkedVoxels::place_of(std::uint64_t number) const noexcept {
    const auto nx = std::uint64_t(counts_[0]), ny = std::uint64_t(counts_[1]);
    return {std::int32_t(number % nx), std::int32_t(number / nx % ny), std::int32_t(number / nx / ny)};
}

std::unique_ptr<char[]> ChunkedVoxels::chunk_memory() const {
    return std::unique_ptr<char[]>(new char[voxel_count(source_->chunk_size()) * pixel_bytes(source_->type())]);
}

bool ChunkedVoxels::is_there(std::uint64_t number) const {
    const auto entry = table_->entries.find(number);
    return entry != table_->entries.end() && entry->second.is_there;
}

void ChunkedVoxels::keep(std::uint64_t number, std::unique_ptr<char[]> voxels) const {
    Table::Entry& entry = table_->entries[number];
    std::call_once(entry.once, [&] {
        require_finite(*source_, box_of(number), voxels.get());
        entry.own = std::move(voxels);
        entry.voxels = entry.own.get();
        entry.is_there = true;
        ++reads_;
    });
}

const char* ChunkedVoxels::fill_chunk() const {
    std::call_once(table_->filled, [&] {
        table_->fill = chunk_memory();
        source_->fill(table_->fill.get());
    });
    return table_->fill.get();
}

const char* ChunkedVoxels::chunk(std::uint64_t number) const {
    Table::Entry& entry = table_->entries[number];
    std::call_once(entry.once, [&] {
        std::unique_ptr<char[]> voxels = chunk_memory();
        if (source_->read(place_of(number), voxels.get())) {
            require_finite(*source_, box_of(number), voxels.get());
            entry.own = std::move(voxels);
            entry.voxels = entry.own.get();
        } else {
            entry.voxels = fill_chunk();
        }
        entry.is_there = true;
        ++reads_;
    });
    return entry.voxels;
}

void ChunkedVoxels::load_together(const std::vector<std::uint64_t>& numbers) const {
    std::vector<Index3> places;
    std::vector<std::unique_ptr<char[]>> memory;
    std::vector<void*> out;
    for (const std::uint64_t number : numbers) {
        places.push_back(place_of(number));
        memory.push_back(chunk_memory());
        out.push_back(memory.back().get());
    }
    source_->read_layer(places, out);
    for (std::size_t n = 0; n < numbers.size(); ++n) keep(numbers[n], std::move(memory[n]));
}

void ChunkedVoxels::load(const std::vector<VoxelBox>& boxes, const RunContext& run) const {
    std::vector<std::uint64_t> missing;
    for (const VoxelBox& box : boxes) {
        const VoxelBox around = chunks_around(box, source_->chunk_size());
        for (std::int32_t k = around.min[2]; k <= around.max[2]; ++k)
            for (std::int32_t j = around.min[1]; j <= around.max[1]; ++j)
                for (std::int32_t i = around.min[0]; i <= around.max[0]; ++i) {
                    const std::uint64_t number = number_of({i, j, k});
                    // Most repetitions are skipped here, because consecutive boxes are often in the same chunk;
                    // std::unique() removes the others.
                    if ((missing.empty() || missing.back() != number) && !is_there(number)) missing.push_back(number);
                }
    }
    std::sort(missing.begin(), missing.end());
    missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
    require_memory(
        double(missing.size()) * double(voxel_count(source_->chunk_size())) * double(pixel_bytes(source_->type())),
        source_->path() + ": the requested part", "choose a part with `roi`", run);
    std::vector<std::vector<std::uint64_t>> groups;
    const std::uint64_t in_layer = std::uint64_t(counts_[0]) * counts_[1];
    for (const std::uint64_t number : missing) {
        const bool joins =
            source_->in_layers() && !groups.empty() && groups.back().back() / in_layer == number / in_layer;
        if (!joins) groups.emplace_back();
        groups.back().push_back(number);
    }
    // Groups (single chunks, or chunks of one layer) are decoded in batches, so that the calling thread can report the
    // progress after each batch.
    const auto batch = std::size_t(tbb::this_task_arena::max_concurrency()) * (source_->in_layers() ? 2 : 32);
    for (std::size_t first = 0; first < groups.size(); first += batch) {
        run.check();
        run.report("image", double(first) / double(groups.size()));
        tbb::parallel_for(first, std::min(first + batch, groups.size()), [&](std::size_t n) {
            if (run.cancelled()) return;
            if (source_->in_layers())
                load_together(groups[n]);
            else
                static_cast<void>(chunk(groups[n].front()));
        });
    }
    run.check();
}

VoxelBox ChunkedVoxels::box_of(std::uint64_t chunk) const noexcept {
    return part_of(whole_box(source_->size()), place_of(chunk), source_->chunk_size());
}

std::vector<std::uint64_t> ChunkedVoxels::read_chunks() const {
    std::vector<std::uint64_t> numbers;
    for (const auto& [number, entry] : table_->entries)
        if (entry.voxels) numbers.push_back(number);
    std::sort(numbers.begin(), numbers.end());
    return numbers;
}

void ChunkedVoxels::copy(const VoxelBox& box, void* out) const {
    const Index3& size = source_->chunk_size();
    const VoxelBox around = chunks_around(box, size);
    if (source_->in_layers() && around.min != around.max) load({box}, {});
    for (std::int32_t k = around.min[2]; k <= around.max[2]; ++k)
        for (std::int32_t j = around.min[1]; j <= around.max[1]; ++j)
            for (std::int32_t i = around.min[0]; i <= around.max[0]; ++i)
                copy_part(part_of(box, {i, j, k}, size), chunk(number_of({i, j, k})), size, box, out,
                          pixel_bytes(source_->type()));
}

double ChunkedVoxels::at(const Index3& voxel) const {
    // Each thread remembers the chunk of its last call, because loops request many voxels of the same chunk one after
    // another.
    struct Last {
        std::uint64_t serial = 0, number = 0;
        const void* voxels = nullptr;
    };
    thread_local Last last;
    const Index3& size = source_->chunk_size();
    const std::uint64_t number = number_of({voxel[0] / size[0], voxel[1] / size[1], voxel[2] / size[2]});
    if (last.serial != serial_ || last.number != number) last = {serial_, number, chunk(number)};
    const std::uint64_t n =
        (std::uint64_t(voxel[2] % size[2]) * size[1] + std::uint64_t(voxel[1] % size[1])) * size[0] +
        std::uint64_t(voxel[0] % size[0]);
    return with_pixel_type(source_->type(),
                           [&](auto pixel) { return double(static_cast<const decltype(pixel)*>(last.voxels)[n]); });
}

Pixels read_chunks(std::shared_ptr<const ChunkSource> source, const VoxelBox& box, const RunContext& run) {
    const Index3 size = source->chunk_size();
    const VoxelBox around = chunks_around(box, size);
    const Index3 n = around.size();
    const std::uint64_t width = pixel_bytes(source->type()), count = voxel_count(n);
    Pixels pixels;
    if (is_worth_mapping(voxel_count(box.size()) * width)) {
        pixels.chunks = std::make_shared<ChunkedVoxels>(std::move(source));
        pixels.chunk_count = {size, 0, pixels.chunks->chunk_count()};
        return pixels;
    }
    const std::shared_ptr<void> data = allocate_pixels(source->path(), voxel_count(box.size()), source->type(), 0);
    tbb::parallel_for(std::uint64_t(0), count, [&](std::uint64_t at) {
        if (run.cancelled()) return;
        const Index3 c{around.min[0] + std::int32_t(at % n[0]), around.min[1] + std::int32_t(at / n[0] % n[1]),
                       around.min[2] + std::int32_t(at / n[0] / n[1])};
        const std::unique_ptr<char[]> voxels(new char[voxel_count(size) * width]);
        source->read_or_fill(c, voxels.get());
        copy_part(part_of(box, c, size), voxels.get(), size, box, data.get(), width);
    });
    run.check();
    pixels.data = data;
    pixels.stride = dense_strides(box.size());
    pixels.chunk_count = {size, count, voxel_count(chunks_around(whole_box(source->size()), size).size())};
    return pixels;
}

std::uint64_t ChunkedFile::bytes_to_hold(const PixelRequest& request) const {
    const std::uint64_t bytes = ImageFile::bytes_to_hold(request);
    return is_worth_mapping(bytes) ? 0 : bytes;
}

}  // namespace covol::detail
