// DICOM slice by slice: plain pixels are read here, compressed ones and files of several frames through ITK's GDCM
// reader, in another program (reader.h). Series are put together here too: ITK's own helper neither says what lies in a
// folder nor finds a missing slice.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <variant>

#include "io/image/dicom_header.h"
#include "io/image/image_formats.h"
#include "io/modules/reader.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kModality = 0x00080060, kSeriesDescription = 0x0008103E, kThickness = 0x00180050;
constexpr std::uint32_t kImagerSpacing = 0x00181164, kSeriesUid = 0x0020000E, kPosition = 0x00200032;
constexpr std::uint32_t kOrientation = 0x00200037, kPlanar = 0x00280006, kFrames = 0x00280008;
constexpr std::uint32_t kPixelSpacing = 0x00280030, kIntercept = 0x00281052, kSlope = 0x00281053;

struct Slice {
    std::string path, series, description;
    PixelType type = PixelType::UInt8;
    Index3 size{};  ///< along k the file's own frames
    Vec3 spacing{}, origin{};
    Matrix3 direction{};
    unsigned components = 1;
    bool spacing_known = true;
    bool plain = false;   ///< read here: the fields below
    PixelPlace place;     ///< slope and intercept are the rescaling
    int unused_bits = 0;  ///< of each stored number, the upper ones
    double position = 0;  ///< along the series' normal
};

/// The smallest type that holds every rescaled value.
PixelType rescaled_type(const PixelPlace& place, int stored_bits) {
    if (place.slope == 1 && place.intercept == 0) return place.type;
    const bool integral = place.slope == std::floor(place.slope) && place.intercept == std::floor(place.intercept);
    const double largest = std::abs(place.slope) * std::ldexp(1.0, stored_bits) + std::abs(place.intercept);
    if (!integral || largest >= std::ldexp(1.0, 31)) return PixelType::Float;
    return largest < std::ldexp(1.0, 15) ? PixelType::Int16 : PixelType::Int32;
}

/// A file with plain pixels and one frame. Without orientation and position it lies at 0.
void fill_plain(const DicomHeader& header, const std::string& unusable, Slice& slice) {
    const int allocated = int(header.integer(kBitsAllocated).value_or(0)),
              stored = int(header.integer(kBitsStored).value_or(0));
    const bool is_signed = header.integer(kRepresentation).value_or(0) == 1;
    slice.plain = true;
    slice.components = header.integer(kSamples).value_or(1);
    slice.size = {std::int32_t(header.integer(kColumns).value_or(0)), std::int32_t(header.integer(kRows).value_or(0)),
                  1};
    slice.unused_bits = allocated - stored;
    PixelPlace& place = slice.place;
    place.path = slice.path;
    place.file_offset = header.pixel_offset;
    place.type = allocated == 8    ? (is_signed ? PixelType::Int8 : PixelType::UInt8)
                 : allocated == 16 ? (is_signed ? PixelType::Int16 : PixelType::UInt16)
                                   : (is_signed ? PixelType::Int32 : PixelType::UInt32);
    place.swap = header.big_endian && allocated > 8;
    const std::vector<double> slope = header.numbers(kSlope), intercept = header.numbers(kIntercept);
    if (slope.size() == 1 && slope[0] != 0) place.slope = slope[0];
    if (intercept.size() == 1) place.intercept = intercept[0];
    slice.type = rescaled_type(place, stored);
    const std::uint64_t bytes = voxel_count(slice.size) * slice.components * std::uint64_t(allocated / 8);
    if (header.pixel_bytes < bytes || header.pixel_bytes > bytes + 1) throw Error(Errc::InvalidInput, unusable);
    if (slice.components > 1 && header.integer(kPlanar).value_or(0) != 0)
        throw Error(Errc::Unsupported, "read_image: " + slice.path + ": colour planes behind each other");

    std::vector<double> spacing = header.numbers(kPixelSpacing);
    if (spacing.size() != 2) spacing = header.numbers(kImagerSpacing);
    slice.spacing_known = spacing.size() == 2 && spacing[0] > 0 && spacing[1] > 0;
    const std::vector<double> thickness = header.numbers(kThickness);
    slice.spacing = {slice.spacing_known ? spacing[1] : 1, slice.spacing_known ? spacing[0] : 1,
                     thickness.size() == 1 ? thickness[0] : 1};
    if (const std::vector<double> position = header.numbers(kPosition); position.size() == 3)
        slice.origin = {position[0], position[1], position[2]};
    std::vector<double> cosines = header.numbers(kOrientation);
    if (cosines.size() != 6) cosines = {1, 0, 0, 0, 1, 0};
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
        slice.direction[a] = {cosines[a], cosines[3 + a], cosines[b] * cosines[3 + c] - cosines[c] * cosines[3 + b]};
    }
}

/// By what GDCM says of the file's image.
void fill_from_gdcm(const DicomHeader& header, const ItkHeader& image, const std::string& unusable, Slice& slice) {
    slice.type = image.type;
    slice.components = image.components;
    for (std::size_t a = 0; a < 3; ++a) {
        const bool there = a < image.size.size();
        const std::uint64_t size = there ? image.size[a] : 1;
        if (size < 1 || size > 65535) throw Error(Errc::InvalidInput, unusable);
        slice.size[a] = static_cast<std::int32_t>(size);
        slice.spacing[a] = there ? image.spacing[a] : 1;
        slice.origin[a] = there ? image.origin[a] : 0;
        for (std::size_t b = 0; b < 3; ++b)
            slice.direction[b][a] = there && b < image.axes[a].size() ? image.axes[a][b] : (a == b ? 1 : 0);
    }
    // Packed pixels may be many; others are all there.
    const std::uint64_t bytes = header.integer(kBitsAllocated).value_or(8) / 8;
    if (!header.encapsulated && voxel_count(slice.size) * slice.components * bytes > header.pixel_bytes)
        throw Error(Errc::InvalidInput, unusable);
}

using SliceOrError = std::variant<Slice, Error>;

/// The headers of some files.
std::vector<SliceOrError> read_headers(const std::vector<std::string>& paths, const RunContext& run) {
    std::vector<SliceOrError> slices;
    std::vector<Piece> for_gdcm;
    std::vector<std::pair<std::size_t, DicomHeader>> waiting;  // their places among the slices
    for (const std::string& path : paths) {
        run.check();
        const std::string unusable = "read_image: " + path + ": damaged, truncated, or not a DICOM image";
        try {
            std::optional<DicomHeader> header = read_dicom_header(path);
            if (!header) throw Error(Errc::InvalidInput, unusable);
            Slice slice;
            slice.path = path;
            slice.series = header->text(kSeriesUid);
            slice.description = header->text(kModality) + " " + header->text(kSeriesDescription);
            const std::vector<double> frames = header->numbers(kFrames);
            if (header->encapsulated || (frames.size() == 1 && frames[0] > 1)) {
                for_gdcm.push_back({path, unusable});
                waiting.emplace_back(slices.size(), std::move(*header));
            } else {
                fill_plain(*header, unusable, slice);
            }
            slices.emplace_back(std::move(slice));
        } catch (const Error& error) {
            slices.emplace_back(error);
        }
    }
    if (waiting.empty()) return slices;
    const std::vector<std::variant<ItkHeader, Error>> images =
        detail::read_headers(ReaderTask::GdcmHeader, for_gdcm, run);
    for (std::size_t n = 0; n < images.size(); ++n) {
        SliceOrError& slice = slices[waiting[n].first];
        try {
            if (const Error* error = std::get_if<Error>(&images[n])) throw Error(*error);
            fill_from_gdcm(waiting[n].second, std::get<ItkHeader>(images[n]), for_gdcm[n].detail,
                           std::get<Slice>(slice));
        } catch (const Error& error) {
            slice = error;
        }
    }
    return slices;
}

/// All usable files of a folder, by series.
std::map<std::string, std::vector<Slice>> list_series(const fs::path& folder, const RunContext& run) {
    std::error_code status;
    std::vector<std::string> paths;
    for (const auto& entry : fs::directory_iterator(folder, status))
        if (entry.is_regular_file(status) && is_dicom(entry.path().string()) && entry.path().filename() != "DICOMDIR")
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    std::map<std::string, std::vector<Slice>> series;
    std::size_t passed_over = 0;
    std::string why;
    for (SliceOrError& slice : read_headers(paths, run)) {
        if (const Error* error = std::get_if<Error>(&slice)) {
            if (passed_over++ == 0) why = error->what();
        } else {
            series[std::get<Slice>(slice).series].push_back(std::move(std::get<Slice>(slice)));
        }
    }
    // A gap between slices is an error; at an end the volume would be shorter without a word.
    if (passed_over > 0)
        run.warn(why + "; passed over" +
                 (passed_over > 1 ? ", and " + std::to_string(passed_over - 1) + " others of the folder" : "") +
                 ": if it is a slice at an end of the series, the image is without it");
    return series;
}

class DicomSeries : public ImageFile {
public:
    DicomSeries(std::string path, std::vector<Slice> slices) : path_(std::move(path)), slices_(std::move(slices)) {
        std::vector<std::string> files;
        for (const Slice& slice : slices_) files.push_back(slice.path);
        refer_to(std::move(files));
        check_alike();
        const Slice& first = slices_.front();
        info_.format = "DICOM";
        info_.axis_order = "XYZ";
        info_.type = first.type;
        for (const Slice& slice : slices_)
            if (slice.type != first.type) info_.type = PixelType::Float;  // a slope of its own for each slice
        info_.channels = int(std::max(1U, first.components));
        info_.geometry.unit = "mm";
        info_.fields = {{"PixelSpacing (0028,0030)", "the spacing along x and y"},
                        {"ImageOrientationPatient (0020,0037)", "the direction"}};
        info_.spacing_known[0] = info_.spacing_known[1] = first.spacing_known;
        if (slices_.size() == 1)
            set_single(first);
        else
            stack();
        info_.fields.emplace_back("SeriesInstanceUID (0020,000e)", first.series);
        info_.fields.emplace_back("Modality, SeriesDescription", first.description);
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        const Index3 n = request.box.size();
        for (const Slice& slice : slices_) refuse_absurd_size(slice);
        const std::shared_ptr<void> data = allocate_pixels(path_, voxel_count(n), info_.type, 0);
        auto* out = static_cast<char*>(data.get());
        if (slices_.size() == 1) {
            const Index3& size = info_.geometry.size;
            for_each_decoded(0, 1, run, [&](const Slice& slice, const char* pixels) {
                for (int k = request.box.min[2]; k <= request.box.max[2]; ++k)
                    out = copy(slice, pixels, std::uint64_t(k) * std::uint64_t(size[0]) * std::uint64_t(size[1]),
                               request, out);
            });
        } else {
            for_each_decoded(
                std::size_t(request.box.min[2]), std::size_t(request.box.max[2]) + 1, run,
                [&](const Slice& slice, const char* pixels) { out = copy(slice, pixels, 0, request, out); });
        }
        return {data, dense_strides(n), false};
    }

private:
    void check_alike() const {
        const Slice& first = slices_.front();
        for (const Slice& slice : slices_) {
            if (slices_.size() > 1 && slice.size[2] != 1)
                throw read_error(Errc::Unsupported, path_,
                                 "the series has several files with several frames each; give one of them");
            bool same = slice.size == first.size && slice.components == first.components;
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 2; ++b)
                    same = same && std::abs(slice.direction[a][b] - first.direction[a][b]) < 1e-3;
            if (!same)
                throw read_error(Errc::Unsupported, path_,
                                 "the slices of the series differ in size or orientation: " +
                                     fs::path(first.path).filename().string() + " and " +
                                     fs::path(slice.path).filename().string());
        }
    }

    void set_single(const Slice& slice) {
        ImageGeometry& g = info_.geometry;
        g.size = require_3d(path_,
                            {std::uint64_t(slice.size[0]), std::uint64_t(slice.size[1]), std::uint64_t(slice.size[2])});
        g.spacing = slice.spacing;
        g.origin = slice.origin;
        g.direction = slice.direction;
        info_.fields.emplace_back("SpacingBetweenSlices or SliceThickness", "the spacing along z");
        info_.fields.emplace_back("ImagePositionPatient (0020,0032)", "the origin");
    }

    /// Sorts by position; the spacing along z is the positions' distance.
    void stack() {
        const Matrix3& d = slices_.front().direction;
        Vec3 normal;
        for (int a = 0; a < 3; ++a) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            normal[a] = d[b][0] * d[c][1] - d[c][0] * d[b][1];
        }
        for (Slice& s : slices_)
            s.position = normal[0] * s.origin[0] + normal[1] * s.origin[1] + normal[2] * s.origin[2];
        std::stable_sort(slices_.begin(), slices_.end(),
                         [](const Slice& a, const Slice& b) { return a.position < b.position; });
        const std::size_t n = slices_.size();
        const Slice &first = slices_.front(), &last = slices_.back();
        const double gap = (last.position - first.position) / double(n - 1);
        check_gaps();
        ImageGeometry& g = info_.geometry;
        g.size = require_3d(path_, {std::uint64_t(first.size[0]), std::uint64_t(first.size[1]), n});
        g.spacing = {first.spacing[0], first.spacing[1], gap};
        g.origin = first.origin;
        g.direction = first.direction;
        // along the positions: a tilted gantry shows as sheared axes
        for (int a = 0; a < 3; ++a) g.direction[a][2] = (last.origin[a] - first.origin[a]) / double(n - 1) / gap;
        info_.fields.emplace_back("ImagePositionPatient (0020,0032)",
                                  "order of " + std::to_string(n) + " slices, origin, spacing along z");
    }

    void check_gaps() const {
        std::vector<double> gaps;
        for (std::size_t k = 1; k < slices_.size(); ++k) gaps.push_back(slices_[k].position - slices_[k - 1].position);
        std::vector<double> sorted = gaps;
        std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(sorted.size() / 2), sorted.end());
        const double usual = sorted[sorted.size() / 2];
        for (std::size_t k = 0; k < gaps.size(); ++k) {
            if (std::abs(gaps[k] - usual) <= 0.02 * usual && usual > 0) continue;
            std::ostringstream text;
            text << "expected slices at even distances, got " << gaps[k] << " between "
                 << fs::path(slices_[k].path).filename().string() << " and "
                 << fs::path(slices_[k + 1].path).filename().string() << " where the others have " << usual
                 << (gaps[k] > 0 ? ": a slice is missing"
                                 : ": several volumes in one series; put one into a folder of its own");
            throw read_error(Errc::InvalidInput, path_, text.str());
        }
    }

    /// Calls use(slice, pixels) for slices [begin, end) with all pixels of each, rescaled: plain ones one by one,
    /// packed ones some at once.
    template <typename Use>
    void for_each_decoded(std::size_t begin, std::size_t end, const RunContext& run, const Use& use) const {
        constexpr std::uint64_t kMostAtOnce = std::uint64_t(256) << 20;
        const std::uint64_t most = kMostAtOnce / bytes_of(slices_.front());
        for (std::size_t first = begin; first < end;) {
            run.report("image", double(first - begin) / double(end - begin));
            const std::size_t last = first + std::clamp<std::size_t>(most, 1, end - first);
            const DecodedPixels packed(ReaderTask::GdcmPixels, packed_of(first, last), run);
            for (std::size_t next = 0; first < last; ++first) {
                run.check();
                const Slice& slice = slices_[first];
                use(slice, slice.plain ? decode_plain(slice).data() : packed.of(next++));
            }
        }
    }

    [[nodiscard]] static std::uint64_t pixels_of(const Slice& slice) {
        return voxel_count(slice.size) * slice.components;
    }
    [[nodiscard]] static std::uint64_t bytes_of(const Slice& slice) {
        return pixels_of(slice) * pixel_bytes(slice.type);
    }
    [[nodiscard]] static std::string unusable(const Slice& slice) {
        return "read_image: " + slice.path + ": damaged or truncated";
    }
    static void refuse_absurd_size(const Slice& slice) {
        allocate_pixels(slice.path, pixels_of(slice), slice.type, fs::file_size(slice.path));
    }

    /// Those that GDCM decodes.
    [[nodiscard]] std::vector<Piece> packed_of(std::size_t begin, std::size_t end) const {
        std::vector<Piece> files;
        for (std::size_t n = begin; n < end; ++n)
            if (const Slice& slice = slices_[n]; !slice.plain)
                files.push_back({slice.path, unusable(slice), 0, bytes_of(slice)});
        return files;
    }

    static std::vector<char> decode_plain(const Slice& slice) {
        const PixelPlace& place = slice.place;
        const std::uint64_t pixels = pixels_of(slice);
        std::vector<char> stored(pixels * place.stored_bytes()), values(bytes_of(slice));
        if (!read_bytes(place, stored.size(), stored.data())) throw Error(Errc::InvalidInput, unusable(slice));
        if (place.swap) swap_bytes(stored.data(), pixels, place.stored_bytes());
        with_pixel_type(place.type, [&](auto from) {
            with_pixel_type(slice.type, [&](auto to) {
                using From = decltype(from);
                using To = decltype(to);
                if constexpr (std::is_integral_v<From>) {
                    const auto* source = reinterpret_cast<const From*>(stored.data());
                    auto* target = reinterpret_cast<To*>(values.data());
                    const int unused = slice.unused_bits;
                    for (std::uint64_t n = 0; n < pixels; ++n) {
                        // what lies in the unused bits is no part of the number
                        const From value = From(From(std::make_unsigned_t<From>(source[n]) << unused) >> unused);
                        target[n] = static_cast<To>(place.slope * double(value) + place.intercept);
                    }
                }
            });
        });
        return values;
    }

    char* copy(const Slice& slice, const char* stored, std::uint64_t first, const PixelRequest& request,
               char* out) const {
        const Index3 n = request.box.size();
        with_pixel_type(slice.type, [&](auto from) {
            with_pixel_type(info_.type, [&](auto to) {
                using To = decltype(to);
                const auto* source = reinterpret_cast<const decltype(from)*>(stored);
                auto* target = reinterpret_cast<To*>(out);
                for (int j = request.box.min[1]; j <= request.box.max[1]; ++j)
                    for (int i = request.box.min[0]; i <= request.box.max[0]; ++i) {
                        const std::uint64_t pixel =
                            first + std::uint64_t(j) * std::uint64_t(slice.size[0]) + std::uint64_t(i);
                        *target++ = static_cast<To>(source[pixel * slice.components + request.channel]);
                    }
            });
        });
        return out + std::uint64_t(n[0]) * std::uint64_t(n[1]) * pixel_bytes(info_.type);
    }

    std::string path_;
    std::vector<Slice> slices_;
};

}  // namespace

bool is_dicom(const std::string& path) {
    constexpr int kPreamble = 128;
    std::ifstream file(path, std::ios::binary);
    char mark[4] = {};
    return file.seekg(kPreamble) && file.read(mark, sizeof(mark)) && std::memcmp(mark, "DICM", 4) == 0;
}

std::unique_ptr<ImageFile> open_dicom(const std::string& path, const RunContext& run) {
    if (!fs::is_directory(path)) {
        const SliceOrError read = read_headers({path}, run).front();
        if (const Error* error = std::get_if<Error>(&read)) throw Error(*error);
        const Slice& own = std::get<Slice>(read);
        if (own.size[2] > 1) return std::make_unique<DicomSeries>(path, std::vector<Slice>{own});
        const fs::path folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
        return std::make_unique<DicomSeries>(path, list_series(folder, run)[own.series]);
    }
    const auto series = list_series(path, run);
    if (series.empty())
        throw read_error(
            Errc::InvalidInput, path,
            "expected a DICOM series, or a Zarr store (.zarray, .zgroup, .zattrs or zarr.json), got a folder "
            "that holds no DICOM image and none of these files");
    if (series.size() > 1) {
        std::string list;
        for (const auto& [uid, slices] : series)
            list += (list.empty() ? "" : "; ") + std::to_string(slices.size()) + " slices of " +
                    slices.front().description + " (" + fs::path(slices.front().path).filename().string() + ")";
        throw read_error(Errc::Unsupported, path,
                         "expected one DICOM series, got " + std::to_string(series.size()) + ": " + list +
                             "; give the file of the one that is wanted");
    }
    return std::make_unique<DicomSeries>(path, series.begin()->second);
}

}  // namespace covol::detail
