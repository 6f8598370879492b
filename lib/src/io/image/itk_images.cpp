// Formats whose headers ITK reads: NRRD, MetaImage, HDF5.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <optional>
#include <sstream>
#include <vector>

#include "base/file.h"
#include "base/text.h"
#include "io/hdf5/hdf5_file.h"
#include "io/image/image_formats.h"
#include "io/image/nrrd_space.h"
#include "io/image/text_header.h"
#include "io/modules/reader.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

/// Sets the unit, spacing_known, and the list of used header fields in `info`.
void read_text_header(const TextHeader& header, ImageInfo& info) {
    std::string unit = header.value_of({"distanceunits", "unit"});
    if (!unit.empty() && unit.front() == '"') unit = unit.substr(1, unit.find('"', 1) - 1);
    info.geometry.unit = normal_unit(unit);
    const bool known = !header.value_of({"spacings", "space directions", "elementspacing", "elementsize"}).empty();
    info.spacing_known = {known, known, known};
    for (const char* key : {"type",
                            "elementtype",
                            "sizes",
                            "dimsize",
                            "elementnumberofchannels",
                            "kinds",
                            "spacings",
                            "space directions",
                            "elementspacing",
                            "elementsize",
                            "space origin",
                            "offset",
                            "position",
                            "origin",
                            "space",
                            "transformmatrix",
                            "orientation",
                            "rotation",
                            "space units",
                            "units",
                            "distanceunits",
                            "unit",
                            "encoding",
                            "compresseddata",
                            "data file",
                            "datafile",
                            "elementdatafile"})
        if (const std::string found = header.value(key); !found.empty()) info.fields.emplace_back(key, found);
}

/// Position of the pixels of a MetaImage. Empty for variants that are left to ITK: ASCII pixels, one file for each
/// slice, a header in the data file.
std::optional<PixelPlace> meta_pixels(const std::string& path, const TextHeader& header, PixelType type) {
    const std::string file = header.data_file();
    if (header.has_value("binarydata", "false") || !header.value("headersize").empty()) return std::nullopt;
    if (header.has_value("elementdatafile", "list") || file.find('%') != std::string::npos) return std::nullopt;
    PixelPlace place;
    place.path = file.empty() ? path : (fs::path(path).parent_path() / file).string();
    place.file_offset = file.empty() ? header.end : 0;
    place.packed = header.has_value("compresseddata", "true");
    const bool big =
        header.has_value("binarydatabyteordermsb", "true") || header.has_value("elementbyteordermsb", "true");
    place.swap = big == (std::endian::native == std::endian::little) && pixel_bytes(type) > 1;
    place.type = type;
    return place;
}

/// Position of the pixels of a NRRD. Empty for variants that are left to ITK: pixels as text or packed by bzip2,
/// several data files, lines or bytes to be skipped, channels that are not the first axis.
std::optional<PixelPlace> nrrd_pixels(const std::string& path, const TextHeader& header, PixelType type, int channels) {
    const std::string file = header.data_file(), encoding = lower(header.value("encoding"));
    PixelPlace place;
    place.packed = encoding == "gzip" || encoding == "gz";
    if (!place.packed && encoding != "raw") return std::nullopt;
    if (lower(file).rfind("list", 0) == 0 || file.find('%') != std::string::npos || file.find(' ') != std::string::npos)
        return std::nullopt;
    if (!header.value_of({"line skip", "lineskip", "byte skip", "byteskip"}).empty()) return std::nullopt;
    if (channels > 1 &&
        (header.value("kinds").empty() || header.has_value("kinds", "domain") || header.has_value("kinds", "space")))
        return std::nullopt;
    place.path = file.empty() ? path : (fs::path(path).parent_path() / file).string();
    place.file_offset = file.empty() ? header.end : 0;
    place.swap =
        header.has_value("endian", "big") == (std::endian::native == std::endian::little) && pixel_bytes(type) > 1;
    place.type = type;
    return place;
}

/// Rejects headers without the required fields, for which the MetaIO library would print messages on std::cerr.
void require_meta_header(const TextHeader& header, const std::string& unusable) {
    for (const char* key : {"ndims", "dimsize", "elementtype", "elementdatafile"})
        if (header.value(key).empty()) throw Error(Errc::InvalidInput, unusable + " (no " + key + " in its header)");
    // MetaIO would allocate arrays of any length that NDims states.
    const std::string dimensions = header.value("ndims");
    if (dimensions.size() > 2 || dimensions.find_first_not_of("0123456789") != std::string::npos ||
        std::stoi(dimensions) < 1 || std::stoi(dimensions) > 10)
        throw Error(Errc::InvalidInput, unusable + " (expected 1 to 10 as NDims, got " + dimensions + ")");
}

/// Images whose pixels ITK reads. They are read as a whole in the program covol-reader, because ITK's readers of text
/// and of lists of files crash on damaged files. HDF5 images of three dimensions are read in boxes, by `reader`.
class ItkFile : public ImageFile {
public:
    ItkFile(std::string path, std::string unusable, ImageInfo info, std::vector<std::uint64_t> size,
            std::unique_ptr<ItkReader> reader, std::uint64_t file_bytes)
        : path_(std::move(path)),
          unusable_(std::move(unusable)),
          size_(std::move(size)),
          reader_(std::move(reader)),
          file_bytes_(file_bytes) {
        info_ = std::move(info);
    }

    ~ItkFile() override {
        std::optional<Hdf5Lock> lock;
        if (reader_) lock.emplace();
        reader_ = nullptr;  // closes an HDF5 file, for which the lock has to be held
    }
    ItkFile(const ItkFile&) = delete;
    ItkFile& operator=(const ItkFile&) = delete;

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        std::vector<std::uint64_t> size = size_, begin(size.size(), 0);
        VoxelBox box = whole_box(info_.geometry.size);
        if (reader_ && size.size() == 3) {
            box = request.box;
            for (std::size_t a = 0; a < 3; ++a) {
                begin[a] = std::uint64_t(box.min[a]);
                size[a] = std::uint64_t(box.size()[a]);
            }
        }
        const auto channels = std::uint64_t(info_.channels);
        const std::uint64_t frame = voxel_count(box.size()) * channels;
        const std::uint64_t pixels_of_all = frame * std::uint64_t(info_.frames);
        std::shared_ptr<void> data = allocate_pixels(path_, pixels_of_all, info_.type, file_bytes_);
        const auto count = std::accumulate(size.begin(), size.end(), std::uint64_t(1), std::multiplies<>());
        if (count != voxel_count(box.size()) * std::uint64_t(info_.frames)) throw Error(Errc::InvalidInput, unusable_);
        if (reader_) {
            const Hdf5Lock lock;
            reader_->read(begin, size, data.get());
        } else {
            const std::vector<Piece> all{{path_, unusable_, 0, pixels_of_all * pixel_bytes(info_.type)}};
            const auto decoded = std::make_shared<DecodedPixels>(ReaderTask::ItkPixels, all, run);
            data = {decoded, decoded->of(0)};
        }
        Pixels pixels;
        pixels.stride = dense_strides(box.size());
        std::uint64_t first = request.frame * frame + request.channel;
        for (int a = 0; a < 3; ++a) {
            pixels.stride[a] *= std::int64_t(channels);
            first += std::uint64_t(pixels.stride[a]) * std::uint64_t(request.box.min[a] - box.min[a]);
        }
        pixels.data = {data, static_cast<char*>(data.get()) + first * pixel_bytes(info_.type)};
        return pixels;
    }

private:
    std::string path_, unusable_;
    std::vector<std::uint64_t> size_;  // in pixels, along all dimensions
    std::unique_ptr<ItkReader> reader_;
    std::uint64_t file_bytes_;
};

/// Size, spacing, origin and direction of the first three dimensions. @throws Error InvalidInput if the image is not
/// 3D.
ImageGeometry itk_geometry(const std::string& path, const ItkHeader& header) {
    std::uint64_t size[3] = {1, 1, 1};
    for (std::size_t a = 0; a < std::min<std::size_t>(3, header.size.size()); ++a) size[a] = header.size[a];
    ImageGeometry geometry;
    geometry.size = require_3d(path, size);
    for (std::size_t a = 0; a < 3; ++a) {
        geometry.spacing[a] = header.spacing[a];
        geometry.origin[a] = header.origin[a];
        const std::vector<double>& axis = header.axes[a];
        for (std::size_t b = 0; b < 3; ++b) geometry.direction[b][a] = b < axis.size() ? axis[b] : 0;
    }
    return geometry;
}

ItkHeader header_by_itk(const std::string& path, const std::string& unusable) {
    const auto found = read_headers(ReaderTask::ItkHeader, {{path, unusable}}, RunContext()).front();
    if (const Error* error = std::get_if<Error>(&found)) throw Error(*error);
    return std::get<ItkHeader>(found);
}

}  // namespace

OpenWithItk* itk_reader_of(const std::string& path) {
    const std::string end = extension(path);
    if (end == ".nrrd" || end == ".nhdr") return itk_module().open_nrrd;
    if (end == ".h5" || end == ".hdf5") return hdf5_module().open_itk;
    return itk_module().open_meta;
}

std::unique_ptr<ImageFile> open_either_hdf5(const Hdf5Name& name) {
    return is_itk_hdf5(name) ? open_itk(name.path, {}) : open_hdf5(name);
}

std::unique_ptr<ImageFile> open_itk(const std::string& path, const RunContext& run) {
    const std::string end = extension(path);
    const std::string unusable = path + ": damaged, truncated, or not a " + end + " file";
    const bool is_meta = end.rfind(".mh", 0) == 0;
    const bool is_nrrd = end == ".nrrd" || end == ".nhdr", is_hdf5 = !is_meta && !is_nrrd;
    std::optional<TextHeader> header;
    std::vector<std::string> files;
    if (is_nrrd || is_meta) {
        header.emplace(path);
        files = header->data_files();
        require_regular_files(path, files);
    }
    if (is_meta) require_meta_header(*header, unusable);
    std::optional<Hdf5Lock> lock;
    if (is_hdf5) lock.emplace();
    // ITK's readers abort or do not terminate if headers are inconsistent, so they run in the separate program. An HDF5
    // file is read in this process, because try_hdf5() has already read it in the separate program.
    std::unique_ptr<ItkReader> reader = is_hdf5 ? itk_reader_of(path)(path, unusable) : nullptr;
    const ItkHeader image = reader ? reader->header() : header_by_itk(path, unusable);

    ImageInfo info;
    info.type = image.type;
    info.geometry = itk_geometry(path, image);
    info.axis_order = image.size.size() > 3 ? "XYZT" : "XYZ";
    constexpr std::uint64_t kMax = std::uint64_t(1) << 20;
    std::uint64_t frames = 1;
    for (std::size_t a = 3; a < image.size.size(); ++a)
        if (__builtin_mul_overflow(frames, image.size[a], &frames)) frames = kMax + 1;
    const std::uint64_t channels = image.components;
    if (frames < 1 || frames > kMax || channels < 1 || channels > kMax)
        throw read_error(Errc::InvalidInput, path,
                         "expected 1 to 2^20 frames and channels, but the header claims " + std::to_string(frames) +
                             " frames and " + std::to_string(channels) + " channels");
    info.frames = static_cast<int>(frames);
    info.channels = static_cast<int>(channels);
    if (info.channels > 1) info.axis_order = "C" + info.axis_order;
    if (image.is_rgb) info.channel_names = {"red", "green", "blue"};

    std::optional<PixelPlace> place;
    if (is_hdf5) {
        info.format = "HDF5 (ITK's layout)";
        info.fields = {{"ITKImage/0", "Dimension, Spacing, Origin, Directions, VoxelData"}};
    } else {
        info.format = is_meta ? "MetaImage" : "NRRD";
        read_text_header(*header, info);
        if (is_nrrd) restore_nrrd_space(path, *header, info, run);
        place = is_meta ? meta_pixels(path, *header, info.type) : nrrd_pixels(path, *header, info.type, info.channels);
    }
    if (place) {
        std::unique_ptr<ImageFile> placed = open_placed(path, info, *place);
        placed->refer_to(files);
        return placed;
    }
    constexpr std::uint64_t kMaxPixels = std::uint64_t(1) << 48;
    if (std::uint64_t(info.channels) * std::uint64_t(info.frames) > kMaxPixels / voxel_count(info.geometry.size))
        throw read_error(Errc::InvalidInput, path,
                         "expected at most 2^48 values, but the header claims " + size_text(info.geometry.size) +
                             " voxels of " + std::to_string(info.channels) + " channels and " +
                             std::to_string(info.frames) + " frames");
    const bool detached = header && !header->data_file().empty();
    auto file = std::make_unique<ItkFile>(path, unusable, info, image.size, std::move(reader),
                                          detached ? 0 : fs::file_size(path));
    file->refer_to(files);
    return file;
}

}  // namespace covol::detail
