#include "covol/image.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/file.h"
#include "base/matrix.h"
#include "base/number.h"
#include "covol/error.h"
#include "covol/image_files.h"
#include "covol/vdb_io.h"
#include "io/chunked/zarr.h"
#include "io/hdf5/hdf5_image.h"
#include "io/image/image_formats.h"
#include "io/image/tiff.h"
#include "io/modules/reader.h"
#include "io/pixels/chunks.h"
#include "limits/memory_budget.h"
#include "limits/world_limits.h"

namespace covol {
namespace {

namespace fs = std::filesystem;
using detail::ImageFile;
using detail::PixelRequest;
using detail::read_error;

constexpr const char* kReadable =
    ".tif, .tiff, .nrrd, .nhdr, .nii, .nii.gz, .mha, .mhd, .mrc, .map, .h5, .ims, .npy, .dcm or .vdb, or a "
    "folder with a DICOM series or a Zarr store";

bool is_one_of(const std::string& text, std::initializer_list<const char*> list) {
    return std::any_of(list.begin(), list.end(), [&](const char* known) { return text == known; });
}

/// @throws Error Unsupported unless the axes are perpendicular and of length 1.
void check_direction(const std::string& where, const ImageGeometry& g) {
    constexpr double kTolerance = 1e-3;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) {
            double dot = 0;
            for (int c = 0; c < 3; ++c) dot += g.direction[c][a] * g.direction[c][b];
            if (!(std::abs(dot - (a == b ? 1.0 : 0.0)) <= kTolerance))
                throw Error(Errc::Unsupported,
                            where +
                                ": direction: expected perpendicular axes of length 1, got sheared or degenerate "
                                "ones; resample the image");
        }
}

/// @throws Error InvalidInput, Unsupported unless numbers hold the lattice well.
void check_geometry(const std::string& where, const ImageGeometry& g) {
    const auto refuse = [&](const char* what, const std::string& expected, double got, int axis, const char* advice) {
        throw Error(Errc::InvalidInput,
                    where + ": " + what + ": expected " + expected + ", got " + detail::number(got) + " along axis " +
                        std::to_string(axis) + "; " + advice,
                    what);
    };
    double finest = detail::kLargestLength;
    for (int a = 0; a < 3; ++a) {
        if (!(g.spacing[a] >= detail::kLeastLength && g.spacing[a] * g.size[a] <= detail::kLargestLength))
            refuse("spacing",
                   "from " + detail::number(detail::kLeastLength) + ", with " + std::to_string(g.size[a]) +
                       " voxels up to " + detail::number(detail::kLargestLength / g.size[a]),
                   g.spacing[a], a, "state it in another unit (`spacing`)");
        finest = std::min(finest, g.spacing[a]);
    }
    const double farthest = detail::farthest_origin(finest);
    for (int a = 0; a < 3; ++a)
        if (!(std::abs(g.origin[a]) <= farthest))
            refuse("origin", "within " + detail::number(farthest) + " of 0", g.origin[a], a,
                   "farther away voxels cannot be told apart well: move the image");
    check_direction(where, g);
}

/// The HDF5 library reads and writes outside its buffers where a file is damaged: what would be read of it is read by
/// the reading program first. It keeps objects of damaged headers, too, which this process then has not seen.
std::unique_ptr<ImageFile> open_tried_hdf5(const detail::Hdf5Name& name) {
    detail::try_hdf5(name.path, name.inside);
    return detail::open_either_hdf5(name);
}

std::unique_ptr<ImageFile> open_image(const std::string& given, const ReadImageOptions& options,
                                      const RunContext& run) {
    auto [path, grid] = split_grid_name(given);
    const std::optional<detail::Hdf5Name> hdf5 = detail::split_hdf5_name(given);
    if (hdf5) path = hdf5->path;
    std::error_code status;
    if (!fs::exists(path, status)) throw read_error(Errc::Io, path, "no such file");
    if (fs::is_directory(path, status) && detail::is_zarr(path))
        return detail::open_zarr(path, options.correct_level_shift, run);
    if (fs::is_directory(path, status)) return detail::open_dicom(path, run);
    if (!fs::is_regular_file(path, status) || !std::ifstream(path).good())
        throw read_error(Errc::Io, path, "cannot be opened");
    const std::string end = detail::extension(path);
    const bool marked = is_one_of(end, {".dcm", ".ima", ".dicom", ""}) && detail::is_dicom(path);
    const bool itk = is_one_of(end, {".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha", ".mhd"});
    const bool mrc = is_one_of(end, {".mrc", ".map", ".rec", ".st", ".ccp4", ".ali"});
    const bool tiff = is_one_of(end, {".tif", ".tiff", ".btf", ".tf8"});
    if (!marked && !itk && !mrc && !tiff && !hdf5 && end != ".npy" && end != ".vdb")
        throw read_error(Errc::Unsupported, path,
                         std::string("expected a name ending in ") + kReadable + ", got '" + end + "'");
    if (fs::file_size(path) == 0) throw read_error(Errc::InvalidInput, path, "the file is empty");
    if (marked) return detail::open_dicom(path, run);
    if (hdf5) return open_tried_hdf5(*hdf5);
    if (itk) return detail::open_itk(path);
    if (mrc) return detail::open_mrc(path);
    if (tiff) return detail::open_tiff(path, run);
    if (end == ".npy") return detail::open_npy(path);
    return detail::open_vdb_image(path, grid);
}

/// What is wrong with the spacing, and the option that mends it.
void warn_of_spacing(const std::string& path, const ImageInfo& info, const RunContext& run) {
    std::string axes;
    for (int a = 0; a < 3; ++a)
        if (!info.spacing_known[a]) axes += (axes.empty() ? "" : ", ") + std::string(1, "xyz"[a]);
    if (axes.empty()) return;
    run.warn(path + ": the file states no spacing along " + axes +
             ": 1 stands in for it, and lengths, volumes and shapes may be wrong; `spacing = sx,sy,sz` gives it");
}

/// The user's corrections, and the last checks.
ImageInfo corrected_info(const std::string& path, const ImageFile& file, const ReadImageOptions& options,
                         const RunContext& run) {
    ImageInfo info = file.info();
    if (options.spacing) {
        info.geometry.spacing = *options.spacing;
        info.spacing_known = {true, true, true};
    }
    for (int a = 0; a < 3; ++a)
        if (!info.spacing_known[a]) info.geometry.spacing[a] = 1;
    info.geometry.spacing_known = info.spacing_known[0] && info.spacing_known[1] && info.spacing_known[2];
    check_geometry("read_image: " + path, info.geometry);
    warn_of_spacing(path, info, run);
    return info;
}

/// The index along channels or frames that the caller chose, or the only one there is.
std::uint64_t choose(const std::string& path, const std::string& what, const std::optional<int>& wanted, int count,
                     const std::vector<std::string>& names) {
    if (!wanted && count == 1) return 0;
    if (wanted && *wanted < count) return std::uint64_t(*wanted);
    std::string list = "0 to " + std::to_string(count - 1);
    if (!names.empty()) {
        list.clear();
        for (std::size_t n = 0; n < names.size(); ++n)
            list += (n == 0 ? "" : ", ") + std::to_string(n) + (names[n].empty() ? "" : " (" + names[n] + ")");
    }
    const std::string choice = "; choose " + list + " with `" + what + "`";
    if (!wanted)
        throw read_error(Errc::Unsupported, path, "expected one " + what + ", got " + std::to_string(count) + choice,
                         what);
    throw read_error(Errc::InvalidOptions, path, what + " " + std::to_string(*wanted) + " does not exist" + choice,
                     what);
}

PixelRequest choose_pixels(const std::string& path, const ImageInfo& info, const ReadImageOptions& options) {
    PixelRequest request;
    request.channel = choose(path, "channel", options.channel, info.channels, info.channel_names);
    request.frame = choose(path, "frame", options.frame, info.frames, {});
    request.box = options.roi ? voxels_around(info.geometry, *options.roi) : detail::whole_box(info.geometry.size);
    return request;
}

}  // namespace

// ---------------------------------------------------------------------------------------------- geometry

Vec3 ImageGeometry::index_to_world(const Vec3& index) const {
    const Vec3 moved =
        detail::multiply(direction, {index[0] * spacing[0], index[1] * spacing[1], index[2] * spacing[2]});
    return {origin[0] + moved[0], origin[1] + moved[1], origin[2] + moved[2]};
}

Vec3 ImageGeometry::world_to_index(const Vec3& world) const {
    const Vec3 moved = detail::multiply(detail::inverse(direction),
                                        {world[0] - origin[0], world[1] - origin[1], world[2] - origin[2]});
    return {moved[0] / spacing[0], moved[1] / spacing[1], moved[2] / spacing[2]};
}

WorldBox ImageGeometry::world_box() const {
    std::vector<Vec3> corners;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index;
        for (int a = 0; a < 3; ++a) index[a] = (corner >> a & 1) != 0 ? size[a] - 0.5 : -0.5;
        corners.push_back(index_to_world(index));
    }
    return bounding_box(corners);
}

bool ImageGeometry::is_axis_aligned() const {
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            if (std::abs(direction[a][b] - (a == b ? 1.0 : 0.0)) > 1e-6) return false;
    return true;
}

bool VoxelBox::contains(const Index3& voxel) const {
    for (int a = 0; a < 3; ++a)
        if (voxel[a] < min[a] || voxel[a] > max[a]) return false;
    return true;
}

VoxelBox voxels_around(const ImageGeometry& geometry, const WorldBox& roi) {
    VoxelBox box;
    Vec3 lo{}, hi{};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 world;
        for (int a = 0; a < 3; ++a) world[a] = (corner >> a & 1) != 0 ? roi.max[a] : roi.min[a];
        const Vec3 index = geometry.world_to_index(world);
        for (int a = 0; a < 3; ++a) {
            lo[a] = corner == 0 ? index[a] : std::min(lo[a], index[a]);
            hi[a] = corner == 0 ? index[a] : std::max(hi[a], index[a]);
        }
    }
    for (int a = 0; a < 3; ++a) {
        const double last = geometry.size[a] - 1;
        if (!(lo[a] <= last + 0.5 && hi[a] >= -0.5)) {
            const auto text = [](const WorldBox& b) {
                std::string line;
                for (const Vec3& corner : {b.min, b.max})
                    for (int c = 0; c < 3; ++c) line += (line.empty() ? "" : ",") + std::to_string(corner[c]);
                return line;
            };
            throw Error(Errc::InvalidInput, "read_image: the roi " + text(roi) + " lies outside the image, which is " +
                                                text(geometry.world_box()));
        }
        box.min[a] = static_cast<std::int32_t>(std::clamp(std::floor(lo[a]) - 1, 0.0, last));
        box.max[a] = static_cast<std::int32_t>(std::clamp(std::ceil(hi[a]) + 1, 0.0, last));
    }
    return box;
}

ImageGeometry cropped(const ImageGeometry& geometry, const VoxelBox& box) {
    ImageGeometry part = geometry;
    part.size = box.size();
    part.origin = geometry.index_to_world({double(box.min[0]), double(box.min[1]), double(box.min[2])});
    return part;
}

// ---------------------------------------------------------------------------------------------- images

const char* to_string(PixelType type) {
    switch (type) {
        case PixelType::UInt8: return "uint8";
        case PixelType::Int8: return "int8";
        case PixelType::UInt16: return "uint16";
        case PixelType::Int16: return "int16";
        case PixelType::UInt32: return "uint32";
        case PixelType::Int32: return "int32";
        case PixelType::Float: return "float";
        case PixelType::Double: break;
    }
    return "double";
}

std::size_t bytes_of(PixelType type) {
    return detail::with_pixel_type(type, [](auto pixel) { return sizeof(pixel); });
}

double Image::at(int i, int j, int k) const {
    if (chunks_) return chunks_->at(in_file({{i, j, k}, {i, j, k}}).min);
    const std::int64_t n =
        stride_[0] * (i - held_.min[0]) + stride_[1] * (j - held_.min[1]) + stride_[2] * (k - held_.min[2]);
    return detail::with_pixel_type(
        type_, [&](auto pixel) { return double(static_cast<const decltype(pixel)*>(data_.get())[n]); });
}

VoxelBox Image::in_file(const VoxelBox& held) const {
    VoxelBox box;
    for (int a = 0; a < 3; ++a) {
        box.min[a] = held.min[a] - held_.min[a] + first_[a];
        box.max[a] = held.max[a] - held_.min[a] + first_[a];
    }
    return box;
}

void Image::copy(const VoxelBox& box, float* out) const {
    if (!chunks_) {
        for (int k = box.min[2]; k <= box.max[2]; ++k)
            for (int j = box.min[1]; j <= box.max[1]; ++j)
                for (int i = box.min[0]; i <= box.max[0]; ++i) *out++ = static_cast<float>(at(i, j, k));
        return;
    }
    detail::with_pixel_type(type_, [&](auto pixel) {
        std::vector<decltype(pixel)> values(detail::voxel_count(box.size()));
        chunks_->copy(in_file(box), values.data());
        std::transform(values.begin(), values.end(), out, [](auto value) { return static_cast<float>(value); });
    });
}

std::optional<ChunkCount> Image::chunks() const {
    std::optional<ChunkCount> count = chunk_count_;
    if (chunks_) count->read = chunks_->read_count();
    return count;
}

Image Image::cropped() const {
    Image part = *this;
    part.geometry_ = covol::cropped(geometry_, held_);
    part.held_ = detail::whole_box(part.geometry_.size);
    return part;
}

Image Image::placed(const ImageGeometry& geometry) const {
    if (geometry.size != geometry_.size)
        throw Error(Errc::InvalidInput, "placed: " + path_ + ": expected " + detail::size_text(geometry.size) +
                                            " voxels, got " + detail::size_text(geometry_.size));
    Image moved = *this;
    moved.geometry_ = geometry;
    return moved;
}

template <typename T>
Image Image::copy_of(const ImageGeometry& geometry, PixelType type, const T* values) {
    Image image;
    image.geometry_ = geometry;
    image.type_ = type;
    image.held_ = detail::whole_box(geometry.size);
    image.stride_ = detail::dense_strides(geometry.size);
    const std::shared_ptr<T[]> data(new T[detail::voxel_count(geometry.size)]);
    std::copy_n(values, detail::voxel_count(geometry.size), data.get());
    image.data_ = data;
    return image;
}

Image Image::from_values(const ImageGeometry& geometry, const float* values) {
    return copy_of(geometry, PixelType::Float, values);
}

Image Image::from_values(const ImageGeometry& geometry, const std::uint8_t* values) {
    return copy_of(geometry, PixelType::UInt8, values);
}

Image Image::from_view(const ImageGeometry& geometry, const VoxelView& voxels) {
    if (geometry.size[0] < 2 || geometry.size[1] < 2 || geometry.size[2] < 2 || !voxels.first)
        throw Error(Errc::InvalidInput,
                    "image: expected at least two voxels along each axis, got " + detail::size_text(geometry.size));
    check_geometry("image", geometry);
    Image image;
    image.geometry_ = geometry;
    image.type_ = voxels.type;
    image.held_ = detail::whole_box(geometry.size);
    image.data_ = voxels.first;
    image.stride_ = voxels.stride;
    image.require_finite();
    return image;
}

std::optional<VoxelView> Image::view() const {
    if (chunks_) return std::nullopt;
    return VoxelView{type_, data_, stride_};
}

// ---------------------------------------------------------------------------------------------- reading

Image read_image(const std::string& path, const ReadImageOptions& options, const RunContext& run) {
    require_valid(options, "read_image");
    Image image;
    with_threads(run, [&] {
        const std::unique_ptr<ImageFile> file = open_image(path, options, run);
        const ImageInfo info = corrected_info(path, *file, options, run);
        const PixelRequest request = choose_pixels(path, info, options);
        detail::require_memory(double(file->bytes_to_hold(request)), "read_image: " + path + ": the image",
                               "choose a part with `roi`, or downsample it", run);
        const detail::Pixels pixels = file->read(request, run);
        image.geometry_ = info.geometry;
        image.type_ = info.type;
        image.path_ = path;
        image.held_ = request.box;
        image.data_ = pixels.data;
        image.stride_ = pixels.stride;
        image.mapped_ = pixels.mapped;
        image.chunks_ = pixels.chunks;
        image.first_ = request.box.min;
        image.chunk_count_ = pixels.chunk_count;
        image.require_finite();
    });
    return image;
}

ImageGeometry read_image_geometry(const std::string& path, const ReadImageOptions& options, const RunContext& run) {
    return read_image_info(path, options, run).geometry;
}

ImageInfo read_image_info(const std::string& path, const ReadImageOptions& options, const RunContext& run) {
    require_valid(options, "read_image_info");
    const std::unique_ptr<ImageFile> file = open_image(path, options, run);
    ImageInfo info = corrected_info(path, *file, options, run);
    ReadImageOptions first = options;
    first.channel = options.channel.value_or(0);
    first.frame = options.frame.value_or(0);
    info.bytes_to_hold = file->bytes_to_hold(choose_pixels(path, info, first));
    return info;
}

std::vector<std::string> list_image_files(const std::string& path, const RunContext& run) {
    // BigDataViewer's description; the file itself is not opened for that.
    if (const auto hdf5 = detail::split_hdf5_name(path))
        return {fs::path(hdf5->path).replace_extension(".xml").string()};
    return open_image(path, {}, run)->files();
}

}  // namespace covol
