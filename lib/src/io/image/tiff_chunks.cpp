// Reads parts of pages on demand, for large TIFFs that cannot be mapped into memory.
#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>

#include "io/image/tiff_pages.h"

namespace covol::detail {
namespace {

// Minimum size of a chunk in bytes, unless the page is smaller.
constexpr std::uint64_t kMinBytes = std::uint64_t(64) << 10;
constexpr std::size_t kMaxHandles = 64;  // maximum number of idle open files
// Maximum width and height in pixels of a chunk that is a part of a strip.
constexpr std::int32_t kBrick = 256;

/// A pool of open files, because a libtiff handle can be used by only one thread at a time.
class TiffHandles {
public:
    struct Handle {
        std::uint32_t file = 0;
        std::uint64_t page = 0;  ///< offset in the file of the directory that libtiff has read last; 0 if unknown
        std::unique_ptr<Tiff> tiff;
    };

    explicit TiffHandles(std::vector<std::string> files) : files_(std::move(files)) {}

    /// Returns a handle, preferably one that is already at the page.
    Handle take(std::uint32_t file, std::uint64_t page) {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            auto found = idle_.end();
            for (auto handle = idle_.begin(); handle != idle_.end(); ++handle)
                if (handle->file == file && (found == idle_.end() || handle->page == page)) found = handle;
            if (found != idle_.end()) {
                Handle taken = std::move(*found);
                idle_.erase(found);
                return taken;
            }
        }
        return {file, 0, open_for_reading(files_[file])};
    }

    void give_back(Handle handle) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (idle_.size() >= kMaxHandles) idle_.erase(idle_.begin());
        idle_.push_back(std::move(handle));
    }

    /// The offsets of the pages of a file, 0 for pages whose properties differ from `kind`. The pages of each file are
    /// listed only once.
    std::vector<std::uint64_t> pages(std::uint32_t file, const TiffPage& kind) {
        const std::lock_guard<std::mutex> lock(listing_);
        auto found = pages_.find(file);
        if (found == pages_.end()) {
            std::vector<std::uint64_t> offsets;
            for (const TiffPage& page : list_pages(files_[file], *open_for_reading(files_[file])))
                offsets.push_back(page.same_kind(kind) ? page.offset : 0);
            found = pages_.emplace(file, std::move(offsets)).first;
        }
        return found->second;
    }

private:
    std::vector<std::string> files_;
    std::mutex mutex_, listing_;
    std::vector<Handle> idle_;
    std::map<std::uint32_t, std::vector<std::uint64_t>> pages_;
};

class TiffChunks : public ChunkSource {
public:
    TiffChunks(const TiffFrame& frame, const Index3& chunk_size)
        : ChunkSource(frame.path, frame.type, frame.size, chunk_size), frame_(frame), handles_(frame.files) {
        if (frame.contiguous > 0) return;
        // All offsets are determined in advance. Otherwise libtiff would go through all previous directories for each
        // slice.
        std::uint32_t listed = std::numeric_limits<std::uint32_t>::max();
        std::vector<std::uint64_t> pages;
        for (const TiffStack::Plane& plane : frame.slices) {
            if (plane.file != listed) pages = handles_.pages(listed = plane.file, frame.kind);
            if (plane.page >= pages.size() || pages[plane.page] == 0) throw damaged(plane, "");
            offsets_.push_back(pages[plane.page]);
        }
    }

    [[nodiscard]] bool read(const Index3& chunk, void* out) const override {
        read_layer({chunk}, {out});
        return true;
    }

    /// Chunks of one slice are read together, because a strip is as wide as the page: it is then unpacked once for all
    /// chunks that it intersects.
    [[nodiscard]] bool in_layers() const noexcept override { return true; }

    void read_layer(const std::vector<Index3>& chunks, const std::vector<void*>& out) const override {
        const Index3& n = chunk_size();
        // Each range of neighbouring chunks in a row is read as one box, so that a strip is unpacked once for all of
        // them.
        for (std::size_t first = 0; first < chunks.size();) {
            std::size_t last = first + 1;
            while (last < chunks.size() && chunks[last][1] == chunks[first][1] &&
                   chunks[last][0] == chunks[last - 1][0] + 1)
                ++last;
            VoxelBox box;
            for (int a = 0; a < 3; ++a) {
                box.min[a] = chunks[first][a] * n[a];
                box.max[a] = std::min(chunks[last - 1][a] * n[a] + n[a], size()[a]) - 1;
            }
            const std::uint64_t width = pixel_bytes(type());
            std::vector<char> rows(voxel_count(box.size()) * width);
            read_box(box, rows.data());
            const auto row = std::uint64_t(box.size()[0]) * width;
            for (std::size_t c = first; c < last; ++c) {
                const std::int32_t x = chunks[c][0] * n[0] - box.min[0];
                const std::uint64_t columns = std::uint64_t(std::min(n[0], box.size()[0] - x));
                for (std::int32_t j = 0; j < box.size()[1]; ++j)
                    std::memcpy(static_cast<char*>(out[c]) + std::uint64_t(j) * n[0] * width,
                                rows.data() + std::uint64_t(j) * row + std::uint64_t(x) * width, columns * width);
            }
            first = last;
        }
    }

private:
    [[nodiscard]] Error damaged(const TiffStack::Plane& plane, const std::string& why) const {
        return read_error(
            Errc::InvalidInput, frame_.files[plane.file],
            "damaged or truncated at page " + std::to_string(plane.page) + (why.empty() ? "" : " (" + why + ")"));
    }

    /// Reads a box within one slice.
    void read_box(const VoxelBox& box, char* out) const {
        const auto k = std::size_t(box.min[2]);
        const TiffStack::Plane& plane = frame_.slices[k];
        if (frame_.contiguous > 0) return read_contiguous(box, out);
        TiffHandles::Handle handle = handles_.take(plane.file, offsets_[k]);
        if (handle.page != offsets_[k]) {
            if (TIFFSetSubDirectory(handle.tiff->get(), offsets_[k]) != 1 ||
                !current_page(*handle.tiff).same_kind(frame_.kind))
                throw damaged(plane, handle.tiff->message());
            handle.page = offsets_[k];
        }
        if (!read_page_part(*handle.tiff, frame_.kind, box, frame_.sample, out))
            throw damaged(plane, handle.tiff->message());
        handles_.give_back(std::move(handle));
    }

    void read_contiguous(const VoxelBox& box, char* out) const {
        const TiffStack::Plane& plane = frame_.slices[std::size_t(box.min[2])];
        const std::uint64_t width = pixel_bytes(type()), row = std::uint64_t(box.size()[0]) * width;
        std::ifstream raw(frame_.files.front(), std::ios::binary);
        for (std::int32_t j = box.min[1]; j <= box.max[1]; ++j, out += row) {
            raw.seekg(static_cast<std::streamoff>(frame_.contiguous + plane.page * frame_.kind.bytes() +
                                                  std::uint64_t(j) * frame_.kind.row_bytes() +
                                                  std::uint64_t(box.min[0]) * width));
            if (!raw.read(out, static_cast<std::streamsize>(row))) throw damaged(plane, "");
            if (frame_.swapped) swap_bytes(out, row / width, width);
        }
    }

    TiffFrame frame_;
    mutable TiffHandles handles_;
    std::vector<std::uint64_t> offsets_;  ///< offset of the directory of each slice
};

}  // namespace

Index3 tiff_chunk_size(const Tiff& tiff, const TiffFrame& frame) {
    const bool tiled = frame.contiguous == 0 && TIFFIsTiled(tiff.get()) != 0;
    const auto up_to = [](std::uint64_t n, std::int32_t maximum) {
        return std::int32_t(std::clamp<std::uint64_t>(n, 1, std::uint64_t(maximum)));
    };
    const std::uint64_t width = pixel_bytes(frame.type);
    Index3 chunk{std::min(kBrick, frame.size[0]), std::min(kBrick, frame.size[1]), 1};
    if (tiled) {
        chunk[0] = up_to(tiff.tag<std::uint32_t>(TIFFTAG_TILEWIDTH, 0), frame.size[0]);
        chunk[1] = up_to(tiff.tag<std::uint32_t>(TIFFTAG_TILELENGTH, 0), frame.size[1]);
    } else if (frame.contiguous == 0) {
        // If strips are small, a chunk consists of several strips, so that it has about kMinBytes.
        const auto rows = std::uint64_t(
            up_to(tiff.tag<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, std::uint32_t(frame.size[1])), frame.size[1]));
        const std::uint64_t minimum = std::max<std::uint64_t>(kMinBytes / width / std::uint64_t(chunk[0]), 1);
        if (rows < minimum) chunk[1] = up_to((minimum + rows - 1) / rows * rows, frame.size[1]);
    }
    for (int a = 0; tiled && a < 2; ++a)
        while (voxel_count(chunk) * width < kMinBytes && chunk[a] < std::min(kBrick, frame.size[a]))
            chunk[a] = up_to(2 * std::uint64_t(chunk[a]), frame.size[a]);
    return chunk;
}

std::shared_ptr<const ChunkSource> tiff_chunks(const TiffFrame& frame, const Index3& chunk_size) {
    return std::make_shared<TiffChunks>(frame, chunk_size);
}

}  // namespace covol::detail
