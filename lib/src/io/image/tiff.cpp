#include "io/image/tiff.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include "io/image/tiff_handle.h"
#include "io/image/tiff_stack.h"

namespace covol::detail {
namespace {

struct Page {
    std::uint64_t offset = 0;  ///< of the directory in the file
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 0, format = 0, samples = 0;

    [[nodiscard]] bool same_kind(const Page& o) const {
        return width == o.width && height == o.height && bits == o.bits && format == o.format && samples == o.samples;
    }
    [[nodiscard]] std::string to_text() const {
        return std::to_string(width) + " x " + std::to_string(height) + " with " + std::to_string(samples) +
               " sample(s) of " + std::to_string(bits) + " bits";
    }
    [[nodiscard]] std::uint64_t row_bytes() const { return std::uint64_t(width) * samples * (bits / 8); }
    [[nodiscard]] std::uint64_t bytes() const { return row_bytes() * height; }
};

Page current_page(const Tiff& tiff) {
    Page page;
    page.offset = TIFFCurrentDirOffset(tiff.get());
    page.width = tiff.tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0);
    page.height = tiff.tag<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
    page.bits = tiff.tag<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1);
    page.format = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    if (page.format == SAMPLEFORMAT_VOID) page.format = SAMPLEFORMAT_UINT;
    page.samples = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
    return page;
}

PixelType pixel_type(const std::string& path, const Page& page) {
    if (page.format == SAMPLEFORMAT_UINT) {
        if (page.bits == 8) return PixelType::UInt8;
        if (page.bits == 16) return PixelType::UInt16;
        if (page.bits == 32) return PixelType::UInt32;
    } else if (page.format == SAMPLEFORMAT_INT) {
        if (page.bits == 8) return PixelType::Int8;
        if (page.bits == 16) return PixelType::Int16;
        if (page.bits == 32) return PixelType::Int32;
    } else if (page.format == SAMPLEFORMAT_IEEEFP) {
        if (page.bits == 32) return PixelType::Float;
        if (page.bits == 64) return PixelType::Double;
    }
    throw read_error(Errc::Unsupported, path,
                     "expected values of 8, 16 or 32 bits, float or double, got " + std::to_string(page.bits) +
                         " bits in sample format " + std::to_string(page.format));
}

/// Opens a file for reading; libtiff's own allocations are bound by the file's size.
std::unique_ptr<Tiff> open_for_reading(const std::string& path) {
    constexpr std::uint64_t kLeastLimit = std::uint64_t(1) << 28;
    std::error_code status;
    const std::uint64_t bytes = std::filesystem::file_size(path, status);
    if (status) throw read_error(Errc::Io, path, "no such file");
    auto tiff = std::make_unique<Tiff>(path, "r", std::max(kLeastLimit, 4 * bytes));
    if (tiff->get() == nullptr)
        throw tiff->error(Errc::InvalidInput, "read_image: " + path + ": not a usable TIFF file");
    return tiff;
}

/// All full-resolution pages, which must be of one kind.
std::vector<Page> list_pages(const std::string& path, const Tiff& tiff) {
    constexpr std::uint32_t kReduced = FILETYPE_REDUCEDIMAGE;
    std::vector<Page> pages;
    for (bool more = true; more;) {
        if ((tiff.tag<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0) & kReduced) == 0 || pages.empty()) {
            const Page page = current_page(tiff);
            if (!pages.empty() && !page.same_kind(pages.front()))
                throw read_error(Errc::Unsupported, path,
                                 "expected pages of one kind, got page 0 of " + pages.front().to_text() + " and page " +
                                     std::to_string(pages.size()) + " of " + page.to_text());
            pages.push_back(page);
        }
        if (TIFFLastDirectory(tiff.get()) != 0) break;
        more = TIFFReadDirectory(tiff.get()) == 1;
        if (!more)
            throw tiff.error(Errc::InvalidInput, "read_image: " + path + ": damaged or truncated after page " +
                                                     std::to_string(pages.size() - 1));
    }
    return pages;
}

/// Where the pixels of an unpacked page lie when they lie in one piece.
std::optional<std::uint64_t> pixels_in_one_piece(const Tiff& tiff, const Page& page) {
    if (tiff.tag<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) != COMPRESSION_NONE) return std::nullopt;
    if (tiff.tag<std::uint16_t>(TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) != FILLORDER_MSB2LSB) return std::nullopt;
    if (TIFFIsTiled(tiff.get()) != 0 || page.samples != 1) return std::nullopt;
    const std::uint64_t rows =
        std::min<std::uint64_t>(tiff.tag<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, page.height), page.height);
    const std::uint64_t first = TIFFGetStrileOffset(tiff.get(), 0);
    for (std::uint64_t strip = 1; rows > 0 && strip * rows < page.height; ++strip)
        if (TIFFGetStrileOffset(tiff.get(), static_cast<std::uint32_t>(strip)) !=
            first + strip * rows * page.row_bytes())
            return std::nullopt;
    return rows > 0 && first > 0 ? std::optional(first) : std::nullopt;
}

/// One plane's part: the columns and rows of `box`, one sample of each pixel.
class PageReader {
public:
    PageReader(const Tiff& tiff, const Page& page, const VoxelBox& box, std::uint64_t sample)
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

    /// False when the page is damaged or truncated.
    bool read(char* out) {
        // A tile may be larger than the page, but not absurdly so.
        constexpr std::uint64_t kSlack = 65536;
        if (width_ == 0 || height_ == 0 || width_ > page_.width + kSlack || height_ > page_.height + kSlack)
            return false;
        const std::uint64_t block_bytes = width_ * height_ * samples_ * bytes_;
        const tmsize_t told = tiled_ ? TIFFTileSize(tiff_.get()) : TIFFStripSize(tiff_.get());
        if (told < 0 || std::uint64_t(told) != block_bytes) return false;
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

    /// The part of the block at (x, y) that lies in the box.
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
    const Page& page_;
    const VoxelBox& box_;
    std::uint64_t bytes_, samples_ = 1, plane_ = 0, sample_ = 0, width_ = 0, height_ = 0;
    bool tiled_ = false;
    std::vector<char> block_;
};

class TiffFile : public ImageFile {
public:
    TiffFile(const std::string& path, const RunContext& run) : path_(path), tiff_(open_for_reading(path)) {
        TiffFacts facts;
        facts.path = path;
        facts.description = tiff_->text(TIFFTAG_IMAGEDESCRIPTION);
        facts.resolution = {tiff_->tag(TIFFTAG_XRESOLUTION, 0.0F), tiff_->tag(TIFFTAG_YRESOLUTION, 0.0F)};
        facts.resolution_unit = tiff_->tag<std::uint16_t>(TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
        facts.count_pages = [](const std::string& other) { return list_pages(other, *open_for_reading(other)).size(); };
        kind_ = current_page(*tiff_);
        info_.type = pixel_type(path, kind_);
        if (kind_.samples < 1 || kind_.bytes() > std::uint64_t(1) << 40)
            throw read_error(Errc::InvalidInput, path, "the header claims pages of " + kind_.to_text());
        run.check();
        find_single_directory(facts.description);
        if (contiguous_ == 0) pages_ = list_pages(path, *tiff_);
        facts.pages = contiguous_ > 0 ? imagej_images(facts.description) : pages_.size();
        stack_ = describe_tiff(facts);
        fill_info();
    }

    [[nodiscard]] std::uint64_t bytes_to_hold(const PixelRequest& request) const override {
        return may_map(request) ? 0 : ImageFile::bytes_to_hold(request);
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        if (may_map(request))
            if (std::optional<Pixels> mapped = map(request)) return *mapped;
        const Index3 n = request.box.size();
        const std::uint64_t page_bytes = std::uint64_t(n[0]) * std::uint64_t(n[1]) * pixel_bytes(info_.type);
        std::uint64_t file_bytes = 0;
        for (const std::string& file : stack_.files) {
            std::error_code status;
            const std::uint64_t bytes = std::filesystem::file_size(file, status);
            if (!status) file_bytes += bytes;
        }
        const std::shared_ptr<void> data = allocate_pixels(path_, voxel_count(n), info_.type, file_bytes);
        auto* out = static_cast<char*>(data.get());
        for (std::int32_t k = request.box.min[2]; k <= request.box.max[2]; ++k, out += page_bytes) {
            run.check();
            if (contiguous_ > 0)
                read_contiguous(plane(request, k).page, request, out);
            else
                read_page(plane(request, k), request, out);
        }
        return {data, dense_strides(n), false};
    }

private:
    /// ImageJ writes stacks over 4 GB with a single directory, and the other slices' pixels right behind the first's.
    void find_single_directory(const std::string& description) {
        const std::uint64_t images = imagej_images(description);
        if (images < 2 || TIFFLastDirectory(tiff_->get()) == 0) return;
        const auto begin = pixels_in_one_piece(*tiff_, kind_);
        const std::uint64_t file_bytes = std::filesystem::file_size(path_);
        if (!begin || kind_.bytes() == 0) return;
        if (*begin > file_bytes || images > (file_bytes - *begin) / kind_.bytes())
            throw read_error(Errc::InvalidInput, path_,
                             "its description claims " + std::to_string(images) + " slices, which a file of " +
                                 std::to_string(file_bytes) + " bytes cannot hold; it is truncated");
        contiguous_ = *begin;
    }

    void fill_info() {
        const bool colour = kind_.samples > 1;
        // Colour: the samples are the channels; OME counts them in SizeC too.
        if (colour && stack_.channels > 1 && stack_.channels != kind_.samples)
            throw read_error(Errc::Unsupported, path_, "channels of several samples each");
        if (colour && stack_.channels == kind_.samples && stack_.slices * stack_.frames != pages_.size())
            throw read_error(Errc::Unsupported, path_, "channels of several samples each");
        info_.channels = static_cast<int>(colour ? kind_.samples : stack_.channels);
        if (colour) stack_.channels = 1;
        if (colour && kind_.samples == 3) stack_.channel_names = {"red", "green", "blue"};
        info_.frames = static_cast<int>(stack_.frames);
        info_.format = stack_.format;
        info_.axis_order = (colour ? "SXY" : "XY") + stack_.order;
        info_.channel_names = stack_.channel_names;
        info_.fields = stack_.fields;
        ImageGeometry& geometry = info_.geometry;
        geometry.size = require_3d(path_, {kind_.width, kind_.height, stack_.slices});
        geometry.unit = stack_.unit;
        geometry.origin = stack_.origin;
        for (std::size_t a = 0; a < 3; ++a) {
            info_.spacing_known[a] = stack_.spacing[a] > 0;
            if (info_.spacing_known[a]) geometry.spacing[a] = stack_.spacing[a];
        }
    }

    [[nodiscard]] TiffStack::Plane plane(const PixelRequest& request, std::int32_t k) const {
        const std::uint64_t channel = kind_.samples > 1 ? 0 : request.channel;
        const TiffStack::Plane plane = stack_.plane(std::uint64_t(k), channel, request.frame);
        if (plane.page == TiffStack::Plane::kNone)
            throw read_error(Errc::InvalidInput, path_, "its OME-XML names no page for slice " + std::to_string(k));
        return plane;
    }

    [[nodiscard]] Error damaged(const TiffStack::Plane& plane) const {
        return tiff_->error(Errc::InvalidInput, "read_image: " + stack_.files[plane.file] +
                                                    ": damaged or truncated at page " + std::to_string(plane.page));
    }

    /// Makes `file` the open one.
    void turn_to(std::uint32_t file) {
        if (file == open_) return;
        tiff_ = open_for_reading(stack_.files[file]);
        pages_ = list_pages(stack_.files[file], *tiff_);
        open_ = file;
    }

    void read_page(const TiffStack::Plane& plane, const PixelRequest& request, char* out) {
        turn_to(plane.file);
        if (plane.page >= pages_.size() || !pages_[plane.page].same_kind(kind_)) throw damaged(plane);
        const Page& page = pages_[plane.page];
        if (TIFFSetSubDirectory(tiff_->get(), page.offset) != 1 || !current_page(*tiff_).same_kind(page))
            throw damaged(plane);
        if (!PageReader(*tiff_, page, request.box, kind_.samples > 1 ? request.channel : 0).read(out))
            throw damaged(plane);
    }

    void read_contiguous(std::uint64_t number, const PixelRequest& request, char* out) const {
        const VoxelBox& box = request.box;
        const std::uint64_t width = pixel_bytes(info_.type), row = std::uint64_t(box.size()[0]) * width;
        std::ifstream raw(path_, std::ios::binary);
        for (std::int32_t j = box.min[1]; j <= box.max[1]; ++j, out += row) {
            raw.seekg(static_cast<std::streamoff>(contiguous_ + number * kind_.bytes() +
                                                  std::uint64_t(j) * kind_.row_bytes() +
                                                  std::uint64_t(box.min[0]) * width));
            if (!raw.read(out, static_cast<std::streamsize>(row)))
                throw damaged({0, static_cast<std::uint32_t>(number)});
            if (TIFFIsByteSwapped(tiff_->get()) != 0) swap_bytes(out, row / width, width);
        }
    }

    /// Large, in one file, and unpacked as far as the first page tells.
    [[nodiscard]] bool may_map(const PixelRequest& request) const {
        return is_worth_mapping(std::uint64_t(request.box.size()[2]) * kind_.bytes()) && stack_.files.size() == 1 &&
               kind_.samples == 1 && TIFFIsByteSwapped(tiff_->get()) == 0 &&
               (contiguous_ > 0 ||
                tiff_->tag<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE);
    }

    [[nodiscard]] std::optional<std::uint64_t> pixels_of(const TiffStack::Plane& plane) const {
        if (contiguous_ > 0) return contiguous_ + plane.page * kind_.bytes();
        if (plane.page >= pages_.size() || TIFFSetSubDirectory(tiff_->get(), pages_[plane.page].offset) != 1)
            throw damaged(plane);
        return pixels_in_one_piece(*tiff_, kind_);
    }

    /// Only where the slices lie at even distances in the file.
    [[nodiscard]] std::optional<Pixels> map(const PixelRequest& request) const {
        const VoxelBox& box = request.box;
        const std::uint64_t width = pixel_bytes(info_.type);
        std::vector<std::uint64_t> begins;
        for (std::int32_t k = box.min[2]; k <= box.max[2]; ++k) {
            const auto begin = pixels_of(plane(request, k));
            if (!begin || *begin % width != 0) return std::nullopt;
            begins.push_back(*begin);
        }
        const std::uint64_t step = begins.size() > 1 ? begins[1] - begins[0] : kind_.bytes();
        for (std::size_t n = 1; n < begins.size(); ++n)
            if (begins[n] < begins[n - 1] || begins[n] - begins[n - 1] != step) return std::nullopt;
        const std::uint64_t bytes = begins.back() + kind_.bytes() - begins.front();
        if (begins.back() + kind_.bytes() > std::filesystem::file_size(path_))
            return std::nullopt;  // read() says where
        const auto slab = map_file(path_, begins.front(), bytes);
        const char* first = static_cast<const char*>(slab.get()) + std::uint64_t(box.min[1]) * kind_.row_bytes() +
                            std::uint64_t(box.min[0]) * width;
        return Pixels{{slab, first}, {1, std::int64_t(kind_.width), std::int64_t(step / width)}, true};
    }

    std::string path_;
    std::unique_ptr<Tiff> tiff_;
    std::uint32_t open_ = 0;        ///< which of stack_.files tiff_ is
    Page kind_;                     ///< the first page; all others are alike
    std::vector<Page> pages_;       ///< of the open file; empty for a single directory
    std::uint64_t contiguous_ = 0;  ///< where the pixels begin of a stack with a single directory
    TiffStack stack_;
};

}  // namespace

std::unique_ptr<ImageFile> open_tiff(const std::string& path, const RunContext& run) {
    return std::make_unique<TiffFile>(path, run);
}

}  // namespace covol::detail
