// Reads DICOM series: uncompressed pixels are read here, compressed ones by ITK's GDCM reader in a separate program
// (reader.h).
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <variant>

#include "files/dicom_class.h"
#include "io/dicom/dicom_header.h"
#include "io/dicom/dicom_volumes.h"
#include "io/image/image_formats.h"
#include "io/modules/reader.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

std::string kind_of_object(const std::string& sop_class) {
    if (sop_class == kSegmentationStorage)
        return "a segmentation (SEG), which covol writes but does not read; export it as .nrrd or .nii.gz from the "
               "program that made it";
    if (sop_class == kRtStructureSet) return "an RT structure set, whose contours are marks: give it with `contours`";
    return "SOP class " + sop_class;
}

/// The slices of all usable files of a folder, by series UID. Warns about files that cannot be used.
std::map<std::string, std::vector<DicomSlice>> list_series(const fs::path& folder, const RunContext& run) {
    std::error_code status;
    std::vector<std::string> paths;
    for (const auto& entry : fs::directory_iterator(folder, status))
        if (entry.is_regular_file(status) && is_dicom(entry.path().string()) && entry.path().filename() != "DICOMDIR" &&
            !holds_no_image(entry.path().string()))
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    std::map<std::string, std::vector<DicomSlice>> series;
    std::size_t passed_over = 0;
    std::string why;
    for (const auto& file : read_dicom_slices(paths, run)) {
        if (const Error* error = std::get_if<Error>(&file)) {
            if (passed_over++ == 0) why = error->what();
            continue;
        }
        for (const DicomSlice& slice : std::get<std::vector<DicomSlice>>(file)) series[slice.series].push_back(slice);
    }
    // If an unusable file is a slice between others, the gap is reported as an error later. If it is a slice at an end
    // of the series, only this warning reports it.
    if (passed_over > 0)
        run.warn(why + "; skipped" +
                 (passed_over > 1 ? ", and " + std::to_string(passed_over - 1) +
                                        (passed_over > 2 ? " other files" : " other file") + " of the folder"
                                  : "") +
                 ": if it is a slice at an end of the series, it is missing from the image");
    return series;
}

class DicomSeries : public ImageFile {
public:
    DicomSeries(std::string path, std::vector<DicomSlice> slices, std::optional<int> frame) : path_(std::move(path)) {
        std::vector<std::string> files;
        for (const DicomSlice& slice : slices)
            if (files.empty() || files.back() != slice.path) files.push_back(slice.path);
        refer_to(std::move(files));
        std::vector<DicomVolume> volumes = dicom_volumes(path_, std::move(slices));
        const std::size_t chosen = std::size_t(std::max(0, frame.value_or(0))) < volumes.size()
                                       ? std::size_t(std::max(0, frame.value_or(0)))
                                       : 0;
        check_depth(volumes);
        place_dicom_volume(path_, volumes[chosen], info_);
        slices_ = std::move(volumes[chosen].slices);
        const DicomSlice& first = slices_.front();
        info_.format = "DICOM";
        info_.axis_order = "XYZ";
        info_.frames = int(volumes.size());
        info_.type = first.type;
        for (const DicomSlice& slice : slices_)
            // Slices may be rescaled to different types. The image then has the type Float.
            if (slice.type != first.type) info_.type = PixelType::Float;
        info_.channels = int(std::max(1U, first.components));
        if (first.file_frames > 1)
            info_.fields.emplace_back("NumberOfFrames (0028,0008)", std::to_string(first.file_frames));
        info_.fields.emplace_back("SeriesInstanceUID (0020,000e)", first.series);
        info_.fields.emplace_back("Modality, SeriesDescription", first.description);
        constexpr std::size_t kMaxListed = 20;
        for (std::size_t n = 0; volumes.size() > 1 && n < std::min(kMaxListed, volumes.size()); ++n)
            info_.fields.emplace_back("frame " + std::to_string(n),
                                      volumes[n].name + (n == chosen ? ", whose geometry is reported" : ""));
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        const Index3 n = request.box.size();
        for (const DicomSlice& slice : slices_) refuse_absurd_size(slice);
        const std::shared_ptr<void> data = allocate_pixels(path_, voxel_count(n), info_.type, 0);
        auto* out = static_cast<char*>(data.get());
        for_each_decoded(std::size_t(request.box.min[2]), std::size_t(request.box.max[2]) + 1, run,
                         [&](const DicomSlice& slice, const char* pixels) { out = copy(slice, pixels, request, out); });
        return {data, dense_strides(n), false};
    }

private:
    /// Rejects a series whose volumes have only one plane each, so that none is 3D: time points of one plane, or planes
    /// of many directions.
    void check_depth(const std::vector<DicomVolume>& volumes) const {
        if (volumes.size() < 2 || volumes.front().slices.size() > 1) return;
        throw read_error(Errc::InvalidInput, path_,
                         "expected slices at several positions, got " + std::to_string(volumes.size()) +
                             " planes that form no stack: time points of one plane, or planes of several "
                             "orientations");
    }

    /// Calls use(slice, pixels) for the slices [begin, end), in this order, with all pixels of the slice. Uncompressed
    /// slices are decoded one by one, compressed files are decoded several at once.
    template <typename Use>
    void for_each_decoded(std::size_t begin, std::size_t end, const RunContext& run, const Use& use) const {
        constexpr std::uint64_t kMaxAtOnce = std::uint64_t(256) << 20;
        std::optional<DecodedPixels> packed;
        std::map<std::string, std::size_t> numbers;  // by path: index of the file's decoded pixels in `packed`
        for (std::size_t n = begin; n < end; ++n) {
            run.check();
            run.report("image", double(n - begin) / double(end - begin));
            const DicomSlice& slice = slices_[n];
            if (slice.plain) {
                use(slice, decode_plain(slice).data());
                continue;
            }
            if (!numbers.contains(slice.path)) {
                std::vector<Piece> files;
                numbers.clear();
                packed.reset();
                std::uint64_t bytes = 0;
                for (std::size_t next = n; next < end && (files.empty() || bytes < kMaxAtOnce); ++next) {
                    const DicomSlice& other = slices_[next];
                    if (other.plain || !numbers.try_emplace(other.path, files.size()).second) continue;
                    files.push_back({other.path, unusable(other), 0, file_bytes(other)});
                    bytes += files.back().bytes;
                }
                packed.emplace(ReaderTask::GdcmPixels, files, run);
            }
            use(slice, packed->of(numbers.at(slice.path)) + slice.frame * decoded_bytes(slice));
        }
    }

    [[nodiscard]] static std::uint64_t pixels_of(const DicomSlice& slice) {
        return voxel_count(slice.size) * slice.components;
    }
    [[nodiscard]] static std::uint64_t decoded_bytes(const DicomSlice& slice) {
        return pixels_of(slice) * pixel_bytes(slice.decoded_type);
    }
    [[nodiscard]] static std::uint64_t file_bytes(const DicomSlice& slice) {
        return decoded_bytes(slice) * slice.file_frames;
    }
    [[nodiscard]] static std::string unusable(const DicomSlice& slice) { return slice.path + ": damaged or truncated"; }
    static void refuse_absurd_size(const DicomSlice& slice) {
        allocate_pixels(slice.path, pixels_of(slice) * slice.file_frames, slice.type, fs::file_size(slice.path));
    }

    static std::vector<char> decode_plain(const DicomSlice& slice) {
        const PixelPlace& place = slice.place;
        const std::uint64_t pixels = pixels_of(slice);
        std::vector<char> stored(pixels * place.stored_bytes()), values(decoded_bytes(slice));
        if (!read_bytes(place, stored.size(), stored.data())) throw Error(Errc::InvalidInput, unusable(slice));
        if (place.swap) swap_bytes(stored.data(), pixels, place.stored_bytes());
        with_pixel_type(place.type, [&](auto from) {
            with_pixel_type(slice.decoded_type, [&](auto to) {
                using From = decltype(from);
                using To = decltype(to);
                if constexpr (std::is_integral_v<From>) {
                    const auto* source = reinterpret_cast<const From*>(stored.data());
                    auto* target = reinterpret_cast<To*>(values.data());
                    const int unused = slice.unused_bits;
                    for (std::uint64_t n = 0; n < pixels; ++n) {
                        // The shifts clear the unused upper bits, which may have any content, and extend the sign.
                        const From value = From(From(std::make_unsigned_t<From>(source[n]) << unused) >> unused);
                        target[n] = static_cast<To>(place.slope * double(value) + place.intercept);
                    }
                }
            });
        });
        return values;
    }

    char* copy(const DicomSlice& slice, const char* decoded, const PixelRequest& request, char* out) const {
        const Index3 n = request.box.size();
        const bool as_decoded = slice.slope == 1 && slice.intercept == 0;
        with_pixel_type(slice.decoded_type, [&](auto from) {
            with_pixel_type(info_.type, [&](auto to) {
                using To = decltype(to);
                const auto* source = reinterpret_cast<const decltype(from)*>(decoded);
                auto* target = reinterpret_cast<To*>(out);
                for (int j = request.box.min[1]; j <= request.box.max[1]; ++j)
                    for (int i = request.box.min[0]; i <= request.box.max[0]; ++i) {
                        const std::uint64_t pixel = std::uint64_t(j) * std::uint64_t(slice.size[0]) + std::uint64_t(i);
                        const auto value = source[pixel * slice.components + request.channel];
                        *target++ = as_decoded ? static_cast<To>(value)
                                               : static_cast<To>(slice.slope * double(value) + slice.intercept);
                    }
            });
        });
        return out + std::uint64_t(n[0]) * std::uint64_t(n[1]) * pixel_bytes(info_.type);
    }

    std::string path_;
    std::vector<DicomSlice> slices_;
};

}  // namespace

std::vector<DicomSlice> read_dicom_series(const std::string& path, const RunContext& run) {
    if (!fs::is_directory(path)) {
        if (holds_no_image(path))
            throw read_error(Errc::Unsupported, path,
                             "expected a DICOM image, got an object without one: " + kind_of_object(dicom_class(path)));
        const auto read = read_dicom_slices({path}, run).front();
        if (const Error* error = std::get_if<Error>(&read)) throw Error(*error);
        const auto& own = std::get<std::vector<DicomSlice>>(read);
        if (own.size() > 1) return own;
        const fs::path folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
        return list_series(folder, run)[own.front().series];
    }
    const auto series = list_series(path, run);
    if (series.empty())
        throw read_error(
            Errc::InvalidInput, path,
            "expected a DICOM series, or a Zarr store (.zarray, .zgroup, .zattrs or zarr.json), got a folder "
            "that contains neither a usable DICOM image nor any of these files");
    if (series.size() > 1) {
        std::string list;
        for (const auto& [uid, slices] : series)
            list += (list.empty() ? "" : "; ") + std::to_string(slices.size()) +
                    (slices.size() > 1 ? " slices of " : " slice of ") + slices.front().description + " (" +
                    fs::path(slices.front().path).filename().string() + ")";
        throw read_error(Errc::Unsupported, path,
                         "expected one DICOM series, got " + std::to_string(series.size()) + ": " + list +
                             "; give a file of the series that is to be read");
    }
    return series.begin()->second;
}

std::unique_ptr<ImageFile> open_dicom(const std::string& path, std::optional<int> frame, const RunContext& run) {
    return std::make_unique<DicomSeries>(path, read_dicom_series(path, run), frame);
}

}  // namespace covol::detail
