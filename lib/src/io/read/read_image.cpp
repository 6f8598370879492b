// Images of all formats, recognized by the names and the first bytes of their files.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <tuple>
#include <utility>

#include "base/file.h"
#include "covol/error.h"
#include "covol/image.h"
#include "covol/image_files.h"
#include "covol/image_levels.h"
#include "covol/vdb_io.h"
#include "image/geometry_check.h"
#include "io/chunked/zarr.h"
#include "io/dicom/dicom_header.h"
#include "io/hdf5/hdf5_image.h"
#include "io/image/image_formats.h"
#include "io/image/segmentation.h"
#include "io/image/tiff.h"
#include "io/modules/reader.h"
#include "io/pixels/nrrd_segments.h"
#include "limits/memory_budget.h"

namespace covol {
namespace {

namespace fs = std::filesystem;
using detail::ImageFile;
using detail::PixelRequest;
using detail::read_error;

constexpr const char* kReadable =
    ".tif, .tiff, .nrrd, .nhdr, .nii, .nii.gz, .mha, .mhd, .mrc, .map, .ics, .h5, .ims, .npy, .dcm or .vdb, "
    "or a folder with a DICOM series or a Zarr store";

bool is_one_of(const std::string& text, std::initializer_list<const char*> list) {
    return std::any_of(list.begin(), list.end(), [&](const char* known) { return text == known; });
}

/// Splits "stack.tif:ZYX" into {"stack.tif", "ZYX"}. The letters replace the order of the planes that a TIFF's
/// description states; they are empty if the text has none, or is itself the name of a file.
std::pair<std::string, std::string> split_axes(const std::string& given) {
    const std::size_t colon = given.rfind(':');
    std::error_code status;
    if (colon == std::string::npos || fs::exists(given, status)) return {given, ""};
    const std::string path = given.substr(0, colon);
    if (!is_one_of(detail::extension(path), {".tif", ".tiff", ".btf", ".tf8"})) return {given, ""};
    return {path, given.substr(colon + 1)};
}

/// Opens an HDF5 file after trying it in a separate program, because on damaged files the HDF5 library may access
/// memory outside of its buffers, and keeps objects of damaged headers in memory.
std::unique_ptr<ImageFile> open_tried_hdf5(const detail::Hdf5Name& name) {
    detail::try_hdf5(name.path, name.inside);
    return detail::open_either_hdf5(name);
}

std::unique_ptr<ImageFile> open_image(const std::string& given, const ReadImageOptions& options,
                                      const RunContext& run) {
    auto [path, grid] = split_grid_name(given);
    std::string axes, segment;
    std::tie(path, axes) = split_axes(path);
    std::tie(path, segment) = detail::split_segment_name(path);
    const std::optional<detail::Hdf5Name> hdf5 = detail::split_hdf5_name(given);
    if (hdf5) path = hdf5->path;
    std::error_code status;
    if (!fs::exists(path, status)) throw read_error(Errc::Io, path, "no such file");
    if (fs::is_directory(path, status) && detail::is_zarr(path))
        return detail::open_zarr(path, options.correct_level_shift, run);
    if (fs::is_directory(path, status)) return detail::open_dicom(path, options.frame, run);
    if (!fs::is_regular_file(path, status) || !std::ifstream(path).good())
        throw read_error(Errc::Io, path, "cannot be opened");
    const std::string end = detail::extension(path);
    const bool itk = is_one_of(end, {".nrrd", ".nhdr", ".mha", ".mhd"});
    const bool nifti = is_one_of(end, {".nii", ".nii.gz"});
    const bool mrc = is_one_of(end, {".mrc", ".map", ".rec", ".st", ".ccp4", ".ali"});
    const bool tiff = is_one_of(end, {".tif", ".tiff", ".btf", ".tf8"});
    const bool known = itk || nifti || mrc || tiff || hdf5 || end == ".ics" || end == ".npy" || end == ".vdb";
    // DICOM files are also recognized by their contents, because their extensions are often numbers.
    const bool marked = !known && (is_one_of(end, {".dcm", ".ima", ".dicom"}) || detail::is_dicom(path));
    if (end == ".ids")
        throw read_error(Errc::Unsupported, path,
                         "these are the voxels of an ICS image; open its header, the .ics file of the same name");
    if (!marked && !known)
        throw read_error(Errc::Unsupported, path,
                         std::string("expected a name ending in ") + kReadable + ", got '" + end + "'");
    if (fs::file_size(path) == 0) throw read_error(Errc::InvalidInput, path, "the file is empty");
    if (marked) return detail::open_dicom(path, options.frame, run);
    if (hdf5) return open_tried_hdf5(*hdf5);
    if (itk && !segment.empty()) return detail::open_segment(path, detail::open_itk(path, run), segment);
    if (itk) return detail::open_itk(path, run);
    if (nifti) return detail::open_nifti(path, run);
    if (mrc) return detail::open_mrc(path);
    if (tiff) return detail::open_tiff(path, axes, run);
    if (end == ".ics") return detail::open_ics(path);
    if (end == ".npy") return detail::open_npy(path);
    return detail::open_vdb_image(path, grid);
}

/// Warns about axes whose spacing the file does not state, and names the option that sets it.
void warn_of_spacing(const std::string& path, const ImageInfo& info, const RunContext& run) {
    std::string axes;
    for (int a = 0; a < 3; ++a)
        if (!info.spacing_known[a]) axes += (axes.empty() ? "" : ", ") + std::string(1, "xyz"[a]);
    if (axes.empty()) return;
    run.warn(path + ": the file states no spacing along " + axes +
             ": 1 is used instead, so lengths, volumes and shapes may be wrong; set it with `spacing = sx,sy,sz`");
}

/// The properties of the image with the spacing that `options` gives, and 1 for unknown spacings. Checks the geometry.
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
    detail::check_geometry(path, info.geometry);
    warn_of_spacing(path, info, run);
    return info;
}

/// The index of the channel or frame that the caller has chosen; 0 if nothing is chosen and there is only one. @throws
/// Error Unsupported if nothing is chosen from several, InvalidOptions if the chosen one does not exist.
std::uint64_t choose(const std::string& path, const std::string& what, const std::optional<int>& wanted, int count,
                     const std::vector<std::string>& names, const std::string& advice = {}) {
    if (!wanted && count == 1) return 0;
    if (wanted && *wanted < count) return std::uint64_t(*wanted);
    std::string list = count == 1 ? "0" : "0 to " + std::to_string(count - 1);
    if (!names.empty()) {
        list.clear();
        for (std::size_t n = 0; n < names.size(); ++n)
            list += (n == 0 ? "" : ", ") + std::to_string(n) + (names[n].empty() ? "" : " (" + names[n] + ")");
    }
    const std::string choice = "; choose " + list + " with `" + what + "`";
    if (!wanted)
        throw read_error(Errc::Unsupported, path,
                         "expected one " + what + ", got " + std::to_string(count) + (advice.empty() ? choice : advice),
                         what);
    throw read_error(Errc::InvalidOptions, path, what + " " + std::to_string(*wanted) + " does not exist" + choice,
                     what);
}

PixelRequest choose_pixels(const std::string& path, const ImageInfo& info, const ReadImageOptions& options) {
    PixelRequest request;
    request.channel =
        choose(path, "channel", options.channel, info.channels, info.channel_names, detail::advice_on_segments(path));
    request.frame = choose(path, "frame", options.frame, info.frames, {});
    request.box = options.roi ? voxels_around(info.geometry, *options.roi) : detail::whole_box(info.geometry.size);
    return request;
}

}  // namespace

ImageLevels open_image_levels(const Image& image, const ReadImageOptions& options, std::uint64_t max_bytes,
                              const RunContext& run) {
    ImageLevels whole(image);
    if (image.view()) return whole;  // all voxels are in memory or mapped, so no chunks have to be read
    RunContext quiet = run;          // warnings have already been reported when the image was read
    quiet.log = nullptr;
    const auto chunks_of = [&](const std::string& path, ImageGeometry& geometry) {
        const std::unique_ptr<ImageFile> file = open_image(path, options, quiet);
        geometry = file->info().geometry;
        return std::pair(file->chunk_source(choose_pixels(path, file->info(), options)), file->coarser_levels());
    };
    std::vector<ImageLevels::Source> sources;
    ImageGeometry finest, geometry;
    const auto [own, coarser] = chunks_of(image.path(), finest);
    if (!own) return whole;
    sources.push_back({finest, own});
    for (const std::string& path : coarser) try {
            if (auto chunks = chunks_of(path, geometry).first) sources.push_back({geometry, std::move(chunks)});
        } catch (const Error& error) {
            if (error.code() == Errc::Cancelled) throw;
            run.warn(std::string(error.what()) + ": this level of the pyramid is not used");
        }
    return {image, std::move(sources), max_bytes};
}

Image read_image(const std::string& path, const ReadImageOptions& options, const RunContext& run) {
    require_valid(options, "read_image");
    Image image;
    with_threads(run, [&] {
        const std::unique_ptr<ImageFile> file = open_image(path, options, run);
        const ImageInfo info = corrected_info(path, *file, options, run);
        const PixelRequest request = choose_pixels(path, info, options);
        detail::require_memory(double(file->bytes_to_hold(request)), path + ": the image",
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
    // An HDF5 file is not opened to find its layout. Its only additional file can be BigDataViewer's XML file, which is
    // listed even if it does not exist.
    if (const auto hdf5 = detail::split_hdf5_name(path))
        return {fs::path(hdf5->path).replace_extension(".xml").string()};
    return open_image(path, {}, run)->files();
}

}  // namespace covol
