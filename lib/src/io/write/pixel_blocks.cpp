#include "io/write/pixel_blocks.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

#include "covol/error.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

/// Sets `out` to the packed bytes. @param runs  whether zlib searches only for runs of equal bytes (Z_RLE). For labels
/// of one byte, this is 2.3 times as fast as its default strategy, and the result is a third smaller
void deflate_into(std::string& out, const std::string& bytes, BlockPacking packing, bool runs) {
    constexpr int kWindow = 15, kMemory = 9, kLevel = 6;
    z_stream stream{};
    if (deflateInit2(&stream, kLevel, Z_DEFLATED, packing == BlockPacking::Zlib ? kWindow : -kWindow, kMemory,
                     runs ? Z_RLE : Z_DEFAULT_STRATEGY) != Z_OK)
        throw Error(Errc::Io, "zlib could not be initialised");
    const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, deflateEnd);
    constexpr std::uint64_t kFlush = 64;
    out.resize(deflateBound(&stream, bytes.size()) + kFlush);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    const bool whole = packing == BlockPacking::Zlib;
    const int status = deflate(&stream, whole ? Z_FINISH : Z_SYNC_FLUSH);
    if (status != (whole ? Z_STREAM_END : Z_OK) || stream.avail_in != 0 || stream.avail_out == 0)
        throw Error(Errc::Io, "zlib could not compress the voxels");
    out.resize(stream.total_out);
}

}  // namespace

void fill_value(PixelType type, double value, std::uint64_t count, void* out) {
    with_pixel_type(type, [&](auto pixel) {
        using T = decltype(pixel);
        std::fill_n(static_cast<T*>(out), count, static_cast<T>(value));
    });
}

void pad_rows(const Index3& size, const Index3& stored, std::uint64_t width, char* values) {
    if (size == stored) return;
    const std::uint64_t from = std::uint64_t(size[0]) * width, to = std::uint64_t(stored[0]) * width;
    const auto row = [&](std::uint64_t length, int rows, int j, int k) {
        return values + (std::uint64_t(k) * std::uint64_t(rows) + std::uint64_t(j)) * length;
    };
    // The last row is moved first, because each row moves towards the end, where it must not overwrite rows that have
    // not been moved yet.
    for (int k = size[2] - 1; k >= 0; --k)
        for (int j = stored[1] - 1; j >= 0; --j) {
            const bool has_voxels = j < size[1];
            char* out = row(to, stored[1], j, k);
            if (has_voxels) std::memmove(out, row(from, size[1], j, k), from);
            std::memset(out + (has_voxels ? from : 0), 0, has_voxels ? to - from : to);
        }
}

PackedBlock BlockPacker::packed(const std::string& bytes) const {
    PackedBlock block;
    block.unpacked = bytes.size();
    const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
    if (packing_ == BlockPacking::None) {
        block.bytes = bytes;
        return block;
    }
    if (packing_ == BlockPacking::Gzip)
        block.check = static_cast<std::uint32_t>(crc32_z(crc32_z(0, nullptr, 0), data, bytes.size()));
    if (packing_ == BlockPacking::Adler)
        block.check = static_cast<std::uint32_t>(adler32_z(adler32_z(0, nullptr, 0), data, bytes.size()));
    deflate_into(block.bytes, bytes, packing_, source_.is_labels() && pixel_bytes(source_.type()) == 1);
    return block;
}

BlockPacker::Shared BlockPacker::pack(const BlockPlace& place) {
    const std::uint64_t width = pixel_bytes(source_.type());
    const std::uint64_t bytes = voxel_count(place.stored) * width;
    if (const std::optional<double> value = source_.uniform(place.box);
        value && (*value == 0 || place.stored == place.box.size())) {
        source_.wrote(place.box, nullptr, *value);
        const auto key = std::make_pair(*value, bytes);
        {
            const std::lock_guard guard(lock_);
            if (const auto known = uniform_.find(key); known != uniform_.end()) return known->second;
        }
        std::string values(bytes, '\0');
        if (*value != 0) fill_value(source_.type(), *value, voxel_count(place.stored), values.data());
        PackedBlock block = packed(values);
        block.is_zero = *value == 0;
        const auto shared = std::make_shared<const PackedBlock>(std::move(block));
        const std::lock_guard guard(lock_);
        return uniform_.emplace(key, shared).first->second;
    }
    std::string values(bytes, '\0');
    const Index3 size = place.box.size();
    source_.fill(place.box, values.data());
    source_.wrote(place.box, values.data(), 0);
    pad_rows(size, place.stored, width, values.data());
    return std::make_shared<const PackedBlock>(packed(values));
}

void BlockPacker::pack_all(std::uint64_t count, const std::function<BlockPlace(std::uint64_t)>& place,
                           const std::function<void(std::uint64_t, const PackedBlock&)>& take, const RunContext& run) {
    // Number of blocks that are packed in parallel before they are written. A limit is needed because all of them are
    // in memory.
    constexpr std::uint64_t kAtOnce = 64;
    std::vector<Shared> blocks(std::min(count, kAtOnce));
    for (std::uint64_t first = 0; first < count; first += kAtOnce) {
        run.check();
        run.report("write", double(first) / double(count));
        const std::uint64_t some = std::min(kAtOnce, count - first);
        tbb::parallel_for(std::uint64_t(0), some, [&](std::uint64_t n) { blocks[n] = pack(place(first + n)); });
        for (std::uint64_t n = 0; n < some; ++n) {
            take(first + n, *blocks[n]);
            blocks[n].reset();
        }
    }
    run.report("write", 1);
}

}  // namespace covol::detail
