#include "io/image/tiff_pages.h"

#include <algorithm>
#include <cstring>
#include <filesystem>

namespace covol::detail {
namespace {

/// Reads a part of one plane: the columns and rows of `box`, one sample of each pixel.
class PageReader {
public:
    PageReader(const Tiff& tiff, const TiffPage& page, const VoxelBox& box, std::uint64_t sample)
        : tiff_(tiff), page_(page), box_(box), bytes_(page.bits / 8) {
        const bool planar = tiff.tag<std::uint16_t>(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
        samples_ = planar ? 1 : page.samples;
        plane_ = planar ? sample : 0;
        sample_ = planar ? 0 : sample;
        tiled_ = TIFFIsTiled(tiff.get()) != 0;
        width_ = tiled_ ? tiff.tag<std::uint32_t>(TIFFTAG_TILEWIDTH, 0) : page.width;
        height_ = tiled_ ? tiff.tag<std::uint32_t>(TIFFTAG_TILELENGTH, 0)
                         : std::min(tiff.tag<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, page.height), page.height);
    }

    /// Returns false if the page is damaged or truncated.
    bool read(char* out) {
        // A tile may be larger than the page. If it exceeds the page by more than this number of pixels, the file is
        // damaged.
        constexpr std::uint64_t kSlack = 65536;
        if (width_ == 0 || height_ == 0 || width_ > page_.width + kSlack || height_ > page_.height + kSlack)
            return false;
        const std::uint64_t block_bytes = width_ * height_ * samples_ * bytes_;
        const tmsize_t reported = tiled_ ? TIFFTileSize(tiff_.get()) : TIFFStripSize(tiff_.get());
        if (reported < 0 || std::uint64_t(reported) != block_bytes || block_bytes > max_in_file()) return false;
        block_.resize(block_bytes);
        const auto first_x = std::uint64_t(box_.min[0]), first_y = std::uint64_t(box_.min[1]);
        for (std::uint64_t y = first_y / height_ * height_; y <= std::uint64_t(box_.max[1]); y += height_)
            for (std::uint64_t x = first_x / width_ * width_; x <= std::uint64_t(box_.max[0]); x += width_) {
                if (!decode(x, y)) return false;
                copy(x, y, out);
            }
        return true;
    }

private:
    /// Upper bound for the number of unpacked bytes of the whole file, computed from its size. Larger blocks are
    /// rejected before memory is allocated.
    [[nodiscard]] std::uint64_t max_in_file() const {
        // Maximum number of unpacked bytes for each byte of the file, by zstd; other codecs have lower ratios.
        constexpr std::uint64_t kMaxOfByte = 32768;
        const std::uint64_t bytes = TIFFGetSizeProc(tiff_.get())(TIFFClientdata(tiff_.get()));
        const bool packed = tiff_.tag<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) != COMPRESSION_NONE;
        return packed ? kMaxOfByte * bytes : bytes;
    }

    bool decode(std::uint64_t x, std::uint64_t y) {
        const auto column = static_cast<std::uint32_t>(x), row = static_cast<std::uint32_t>(y);
        const auto plane = static_cast<std::uint16_t>(plane_);
        if (tiled_) {
            const std::uint32_t tile = TIFFComputeTile(tiff_.get(), column, row, 0, plane);
            const auto want = static_cast<tmsize_t>(block_.size());
            return TIFFReadEncodedTile(tiff_.get(), tile, block_.data(), want) == want;
        }
        const std::uint64_t rows = std::min<std::uint64_t>(height_, page_.height - y);
        const auto want = static_cast<tmsize_t>(rows * width_ * samples_ * bytes_);
        return TIFFReadEncodedStrip(tiff_.get(), TIFFComputeStrip(tiff_.get(), row, plane), block_.data(), want) ==
               want;
    }

    /// Copies the part of the current block (a strip or a tile) that lies in the box. The first pixel of the block is
    /// at (x, y) in the page.
    void copy(std::uint64_t x, std::uint64_t y, char* out) const {
        const std::uint64_t x0 = std::max<std::uint64_t>(x, std::uint64_t(box_.min[0]));
        const std::uint64_t x1 = std::min<std::uint64_t>(x + width_, std::uint64_t(box_.max[0]) + 1);
        const std::uint64_t y0 = std::max<std::uint64_t>(y, std::uint64_t(box_.min[1]));
        const std::uint64_t y1 = std::min<std::uint64_t>(y + height_, std::uint64_t(box_.max[1]) + 1);
        const auto columns = std::uint64_t(box_.size()[0]);
        for (std::uint64_t row = y0; row < y1; ++row) {
            const char* from = block_.data() + (((row - y) * width_ + x0 - x) * samples_ + sample_) * bytes_;
            char* to = out + ((row - std::uint64_t(box_.min[1])) * columns + x0 - std::uint64_t(box_.min[0])) * bytes_;
            if (samples_ == 1)
                std::memcpy(to, from, (x1 - x0) * bytes_);
            else
                for (std::uint64_t n = 0; n < x1 - x0; ++n)
                    std::memcpy(to + n * bytes_, from + n * samples_ * bytes_, bytes_);
        }
    }

    const Tiff& tiff_;
    const TiffPage& page_;
    const VoxelBox& box_;
    std::uint64_t bytes_, samples_ = 1, plane_ = 0, sample_ = 0, width_ = 0, height_ = 0;
    bool tiled_ = false;
    std::vector<char> block_;
};

}  // namespace

TiffPage current_page(const Tiff& tiff) {
    TiffPage page;
    page.offset = TIFFCurrentDirOffset(tiff.get());
    page.width = tiff.tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0);
    page.height = tiff.tag<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
    page.bits = tiff.tag<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1);
    page.format = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    if (page.format == SAMPLEFORMAT_VOID) page.format = SAMPLEFORMAT_UINT;
    page.samples = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
    return page;
}

std::unique_ptr<Tiff> open_for_reading(const std::string& path) {
    constexpr std::uint64_t kMinLimit = std::uint64_t(1) << 28;
    std::error_code status;
    const std::uint64_t bytes = std::filesystem::file_size(path, status);
    if (status)
        throw read_error(Errc::Io, path, std::filesystem::exists(path) ? "is not a regular file" : "no such file");
    // "m" prevents libtiff from mapping the file: the mapped memory would keep compressed tiles in memory after they
    // are unpacked.
    auto tiff = std::make_unique<Tiff>(path, "rm", std::max(kMinLimit, 4 * bytes));
    if (tiff->get() == nullptr) throw tiff->error(Errc::InvalidInput, path + ": not a usable TIFF file");
    return tiff;
}

std::vector<TiffPage> list_pages(const std::string& path, const Tiff& tiff) {
    constexpr std::uint32_t kReduced = FILETYPE_REDUCEDIMAGE;
    std::vector<TiffPage> pages;
    for (bool more = true; more;) {
        if ((tiff.tag<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0) & kReduced) == 0 || pages.empty()) {
            const TiffPage page = current_page(tiff);
            if (!pages.empty() && !page.same_kind(pages.front()))
                throw read_error(Errc::Unsupported, path,
                                 "expected pages of one kind, got page 0 of " + pages.front().to_text() + " and page " +
                                     std::to_string(pages.size()) + " of " + page.to_text());
            pages.push_back(page);
        }
        if (TIFFLastDirectory(tiff.get()) != 0) break;
        more = TIFFReadDirectory(tiff.get()) == 1;
        if (!more)
            throw tiff.error(Errc::InvalidInput,
                             path + ": damaged or truncated after page " + std::to_string(pages.size() - 1));
    }
    return pages;
}

bool read_page_part(const Tiff& tiff, const TiffPage& page, const VoxelBox& box, std::uint64_t sample, char* out) {
    return PageReader(tiff, page, box, sample).read(out);
}

}  // namespace covol::detail
