#include "io/image/tiff.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include "io/image/tiff_handle.h"
#include "io/image/tiff_pages.h"
#include "io/image/tiff_stack.h"

namespace covol::detail {
namespace {

PixelType pixel_type(const std::string& path, const TiffPage& page) {
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

/// Position in bytes of the pixels of a page; empty if they are compressed, in tiles, not contiguous, or of several
/// samples.
std::optional<std::uint64_t> pixels_in_one_piece(const Tiff& tiff, const TiffPage& page) {
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

class TiffFile : public ImageFile {
public:
    TiffFile(const std::string& path, const std::string& axes, const RunContext& run)
        : path_(path), tiff_(open_for_reading(path)) {
        TiffFacts facts;
        facts.path = path;
        facts.description = tiff_->text(TIFFTAG_IMAGEDESCRIPTION);
        facts.resolution = {tiff_->tag(TIFFTAG_XRESOLUTION, 0.0F), tiff_->tag(TIFFTAG_YRESOLUTION, 0.0F)};
        facts.resolution_unit = tiff_->tag<std::uint16_t>(TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
        facts.count_pages = [](const std::string& other) { return list_pages(other, *open_for_reading(other)).size(); };
        kind_ = current_page(*tiff_);
        info_.type = pixel_type(path, kind_);
        if (kind_.samples < 1 || kind_.bytes() > std::uint64_t(1) << 40)
            throw read_error(
                Errc::InvalidInput, path,
                "expected pages of at most 1 TiB with 1 sample or more, but the header claims " + kind_.to_text());
        run.check();
        find_single_directory(facts.description);
        if (contiguous_ == 0) pages_ = list_pages(path, *tiff_);
        facts.pages = contiguous_ > 0 ? imagej_images(facts.description) : pages_.size();
        stack_ = describe_tiff(facts);
        std::vector<std::string> files = stack_.files;
        files.insert(files.end(), stack_.descriptions.begin(), stack_.descriptions.end());
        refer_to(std::move(files));
        fill_info(axes);
        for (const std::string& warning : stack_.warnings)
            run.warn(path + ": " + warning + "; set it with `spacing = sx,sy,sz`");
    }

    [[nodiscard]] std::uint64_t bytes_to_hold(const PixelRequest& request) const override {
        const std::uint64_t bytes = ImageFile::bytes_to_hold(request);
        return may_map(request) || is_worth_mapping(bytes) ? 0 : bytes;
    }

    [[nodiscard]] std::shared_ptr<const ChunkSource> chunk_source(const PixelRequest& request) const override {
        return chunks_of(request);
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        if (may_map(request))
            if (std::optional<Pixels> mapped = map(request)) return *mapped;
        if (is_worth_mapping(ImageFile::bytes_to_hold(request)))
            return read_chunks(chunks_of(request), request.box, run);
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
    /// Recognizes stacks over 4 GB as ImageJ writes them: a single directory, and the pixels of the other slices
    /// directly after those of the first slice.
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

    /// Rejects files with several channels or time points of a single slice, because they are often mislabelled slices.
    void require_slices() const {
        if (stack_.slices > 1 || stack_.channels * stack_.frames < 2) return;
        std::string there = plane_axes(stack_), list, axes = there;
        for (const char axis : there)
            list += (list.empty() ? "" : " and ") + std::to_string(axis == 'C' ? stack_.channels : stack_.frames) +
                    (axis == 'C' ? " channels" : " time points");
        std::replace(axes.begin(), axes.end(), stack_.channels > stack_.frames ? 'C' : 'T', 'Z');
        throw read_error(Errc::InvalidInput, path_,
                         "expected a 3D image, got " + std::to_string(kind_.width) + " x " +
                             std::to_string(kind_.height) + " x 1 with " + list + "; if these are slices, give " +
                             path_ + ":" + axes + "YX, which reads them as slices");
    }

    void fill_info(const std::string& axes) {
        const bool colour = kind_.samples > 1;
        // In colour images, the samples of a pixel are the channels, which OME counts in SizeC. Another number of
        // channels would mean several colour images, which are not supported.
        if (colour && stack_.channels > 1 && stack_.channels != kind_.samples)
            throw read_error(Errc::Unsupported, path_, "expected one sample for each pixel of a channel, got several");
        if (colour && stack_.channels == kind_.samples && stack_.slices * stack_.frames != pages_.size())
            throw read_error(Errc::Unsupported, path_, "expected one sample for each pixel of a channel, got several");
        if (colour) stack_.channels = 1;
        rename_axes(path_, axes, stack_);
        info_.channels = static_cast<int>(colour ? kind_.samples : stack_.channels);
        if (colour && kind_.samples == 3) stack_.channel_names = {"red", "green", "blue"};
        info_.frames = static_cast<int>(stack_.frames);
        info_.format = stack_.format;
        info_.axis_order = (colour ? "SXY" : "XY") + stack_.order;
        info_.channel_names = stack_.channel_names;
        info_.fields = stack_.fields;
        require_slices();
        ImageGeometry& geometry = info_.geometry;
        geometry.size = require_3d(path_, {kind_.width, kind_.height, stack_.slices});
        geometry.unit = stack_.unit;
        geometry.origin = stack_.origin;
        for (std::size_t a = 0; a < 3; ++a) {
            info_.spacing_known[a] = stack_.spacing[a] > 0;
            if (info_.spacing_known[a]) geometry.spacing[a] = stack_.spacing[a];
        }
        PixelRequest all;
        all.box = whole_box(geometry.size);
        if (!may_map(all) && is_worth_mapping(ImageFile::bytes_to_hold(all)))
            info_.chunk_size = tiff_chunk_size(*tiff_, frame_of_kind());
    }

    /// The properties that all channels and frames have in common; `slices` and `sample`, which differ, are not set.
    [[nodiscard]] TiffFrame frame_of_kind() const {
        TiffFrame frame;
        frame.path = path_;
        frame.type = info_.type;
        frame.size = info_.geometry.size;
        frame.kind = kind_;
        frame.files = stack_.files;
        frame.contiguous = contiguous_;
        frame.swapped = TIFFIsByteSwapped(tiff_->get()) != 0;
        return frame;
    }

    [[nodiscard]] TiffStack::Plane plane(const PixelRequest& request, std::int32_t k) const {
        const std::uint64_t channel = kind_.samples > 1 ? 0 : request.channel;
        const TiffStack::Plane plane = stack_.plane(std::uint64_t(k), channel, request.frame);
        if (plane.page == TiffStack::Plane::kNone)
            throw read_error(Errc::InvalidInput, path_, "its OME-XML names no page for slice " + std::to_string(k));
        return plane;
    }

    [[nodiscard]] std::shared_ptr<const ChunkSource> chunks_of(const PixelRequest& request) const {
        TiffFrame frame = frame_of_kind();
        frame.sample = kind_.samples > 1 ? request.channel : 0;
        for (std::int32_t k = 0; k < frame.size[2]; ++k) frame.slices.push_back(plane(request, k));
        return tiff_chunks(frame, tiff_chunk_size(*tiff_, frame));
    }

    [[nodiscard]] Error damaged(const TiffStack::Plane& plane) const {
        return tiff_->error(Errc::InvalidInput,
                            stack_.files[plane.file] + ": damaged or truncated at page " + std::to_string(plane.page));
    }

    /// Opens the file with this index, unless it is the file that is open already.
    void switch_file(std::uint32_t file) {
        if (file == open_) return;
        tiff_ = open_for_reading(stack_.files[file]);
        pages_ = list_pages(stack_.files[file], *tiff_);
        open_ = file;
    }

    void read_page(const TiffStack::Plane& plane, const PixelRequest& request, char* out) {
        switch_file(plane.file);
        if (plane.page >= pages_.size() || !pages_[plane.page].same_kind(kind_)) throw damaged(plane);
        const TiffPage& page = pages_[plane.page];
        if (TIFFSetSubDirectory(tiff_->get(), page.offset) != 1 || !current_page(*tiff_).same_kind(page))
            throw damaged(plane);
        if (!read_page_part(*tiff_, page, request.box, kind_.samples > 1 ? request.channel : 0, out))
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

    /// Whether map() may succeed: the box is large, and the pixels are in one file, in this machine's byte order, with
    /// one sample each, and uncompressed according to the first page.
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

    /// Maps the slices of the box into memory; empty if they are not evenly spaced in the file.
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
            return std::nullopt;  // if the file is truncated, read() reports the missing slice
        const auto slab = map_file(path_, begins.front(), bytes);
        const char* first = static_cast<const char*>(slab.get()) + std::uint64_t(box.min[1]) * kind_.row_bytes() +
                            std::uint64_t(box.min[0]) * width;
        return Pixels{{slab, first}, {1, std::int64_t(kind_.width), std::int64_t(step / width)}, true};
    }

    std::string path_;
    std::unique_ptr<Tiff> tiff_;
    std::uint32_t open_ = 0;        ///< index in stack_.files of the file that is open as tiff_
    TiffPage kind_;                 ///< properties of the first page, which all other pages must have, too
    std::vector<TiffPage> pages_;   ///< pages of the open file; empty if the stack has a single directory
    std::uint64_t contiguous_ = 0;  ///< position of the pixels in a stack with a single directory
    TiffStack stack_;
};

}  // namespace

std::unique_ptr<ImageFile> open_tiff(const std::string& path, const std::string& axes, const RunContext& run) {
    return std::make_unique<TiffFile>(path, axes, run);
}

}  // namespace covol::detail
