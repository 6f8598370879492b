// The properties of each plane of a DICOM file: from its functional groups if it has them (PS3.3 C.7.6.16), otherwise
// from the elements of the file.
#include "io/dicom/dicom_slices.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "base/number.h"
#include "io/dicom/dicom_header.h"
#include "io/modules/reader.h"

namespace covol::detail {
namespace {

constexpr std::uint32_t kSopClass = 0x00080016, kSopInstance = 0x00080018;
constexpr std::uint32_t kModality = 0x00080060, kSeriesDescription = 0x0008103E, kThickness = 0x00180050;
constexpr std::uint32_t kEchoTime = 0x00180081, kEchoNumbers = 0x00180086, kBetweenSlices = 0x00180088;
constexpr std::uint32_t kTriggerTime = 0x00181060, kImagerSpacing = 0x00181164, kRegionUnitsX = 0x00186024;
constexpr std::uint32_t kRegionUnitsY = 0x00186026, kRegionX = 0x0018602C, kRegionY = 0x0018602E;
constexpr std::uint32_t kEffectiveEcho = 0x00189082, kSeriesUid = 0x0020000E, kInstance = 0x00200013;
constexpr std::uint32_t kPosition = 0x00200032, kOrientation = 0x00200037, kTemporalPosition = 0x00200100;
constexpr std::uint32_t kLocation = 0x00201041, kStackId = 0x00209056, kTemporalIndex = 0x00209128;
constexpr std::uint32_t kVolumePosition = 0x00209301, kVolumeOrientation = 0x00209302, kTimeOffset = 0x0020930D;
constexpr std::uint32_t kPlanar = 0x00280006, kFrameCount = 0x00280008, kPixelSpacing = 0x00280030;
constexpr std::uint32_t kIntercept = 0x00281052, kSlope = 0x00281053, kFrameOffsets = 0x3004000C;

/// The type of the rescaled values: without rescaling the stored type, otherwise Int16 or Int32 if every rescaled value
/// is an integer that this type can hold, otherwise Float.
PixelType rescaled_type(PixelType stored, double slope, double intercept, int stored_bits) {
    if (slope == 1 && intercept == 0) return stored;
    const bool integral = slope == std::floor(slope) && intercept == std::floor(intercept);
    const double largest = std::abs(slope) * std::ldexp(1.0, stored_bits) + std::abs(intercept);
    if (!integral || largest >= std::ldexp(1.0, 31)) return PixelType::Float;
    return largest < std::ldexp(1.0, 15) ? PixelType::Int16 : PixelType::Int32;
}

/// A text that represents a number, so that the alphabetical order of such texts is the order of the numbers. The
/// number as users read it follows the last blank.
std::string sortable(double value) {
    const auto digits = std::to_string(std::int64_t(std::llround(std::clamp(value, -1e9, 1e9) * 1e6) + (1LL << 60)));
    return std::string(20 - std::min<std::size_t>(20, digits.size()), '0') + digits + " " + number(value);
}

struct Rescaling {
    double slope = 1, intercept = 0;
};

Rescaling rescaling_of(const DicomHeader& header, std::size_t frame) {
    Rescaling found;
    const std::vector<double> slope = header.numbers(kSlope, frame), intercept = header.numbers(kIntercept, frame);
    if (slope.size() == 1 && slope[0] != 0) found.slope = slope[0];
    if (intercept.size() == 1) found.intercept = intercept[0];
    return found;
}

/// Describes uncompressed pixels, which are read without GDCM. The file holds `frames` consecutive frames.
void fill_plain(const DicomHeader& header, std::size_t frames, const std::string& unusable, DicomSlice& slice) {
    const int allocated = int(header.integer(kBitsAllocated).value_or(0)),
              stored = int(header.integer(kBitsStored).value_or(0));
    const bool is_signed = header.integer(kRepresentation).value_or(0) == 1;
    slice.plain = true;
    slice.components = header.integer(kSamples).value_or(1);
    slice.unused_bits = allocated - stored;
    const std::uint64_t bytes = voxel_count(slice.size) * slice.components * std::uint64_t(allocated / 8);
    if (frames > header.pixel_bytes / std::max<std::uint64_t>(1, bytes) || header.pixel_bytes > bytes * frames + 1)
        throw Error(Errc::InvalidInput, unusable);
    PixelPlace& place = slice.place;
    place.path = slice.path;
    place.file_offset = header.pixel_offset + slice.frame * bytes;
    place.type = allocated == 8    ? (is_signed ? PixelType::Int8 : PixelType::UInt8)
                 : allocated == 16 ? (is_signed ? PixelType::Int16 : PixelType::UInt16)
                                   : (is_signed ? PixelType::Int32 : PixelType::UInt32);
    place.swap = header.big_endian && allocated > 8;
    const Rescaling own = rescaling_of(header, slice.frame);
    place.slope = own.slope;
    place.intercept = own.intercept;
    slice.type = slice.decoded_type = rescaled_type(place.type, own.slope, own.intercept, stored);
    if (slice.components > 1 && header.integer(kPlanar).value_or(0) != 0)
        throw Error(Errc::Unsupported,
                    slice.path + ": expected interleaved colours (RGBRGB...), got separate colour planes");
}

/// Describes compressed pixels. GDCM rescales all frames with the slope and intercept in `image`; if those of the frame
/// differ, the slice's slope and intercept correct the decoded pixels.
void fill_packed(const DicomHeader& header, const ItkHeader& image, DicomSlice& slice) {
    slice.components = image.components;
    slice.type = slice.decoded_type = image.type;
    if (header.frames.empty() || !(std::abs(image.slope) > 0)) return;
    const Rescaling own = rescaling_of(header, slice.frame);
    if (own.slope == image.slope && own.intercept == image.intercept) return;
    slice.slope = own.slope / image.slope;
    slice.intercept = own.intercept - slice.slope * image.intercept;
    slice.type = PixelType::Float;
}

/// The stated position of the plane; empty if there is none. If the file has `several` frames, the position must be in
/// the functional groups of the frame. A position in the shared groups is used only if the frames are time points of
/// one plane, because it would otherwise be the same for different planes.
std::vector<double> position_of(const DicomHeader& header, std::size_t frame, bool several) {
    if (several) {
        if (header.frames.size() <= frame) return {};
        const DicomValues& own = header.frames[frame];
        const bool is_shared = own.contains(kTemporalIndex) &&
                               (header.shared.contains(kPosition) || header.shared.contains(kVolumePosition));
        if (!own.contains(kPosition) && !own.contains(kVolumePosition) && !is_shared) return {};
    }
    const std::vector<double> position = header.numbers(kPosition, frame);
    return position.size() == 3 ? position : header.doubles(kVolumePosition, frame);
}

/// Sets the columns of the matrix `direction`: the direction along a row, the direction along a column, and the normal
/// of the plane.
void fill_direction(const DicomHeader& header, DicomSlice& slice) {
    std::vector<double> cosines = header.numbers(kOrientation, slice.frame);
    if (cosines.size() != 6) cosines = header.doubles(kVolumeOrientation, slice.frame);
    if (cosines.size() != 6) cosines = {1, 0, 0, 0, 1, 0};
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
        slice.direction[a] = {cosines[a], cosines[3 + a], cosines[b] * cosines[3 + c] - cosines[c] * cosines[3 + b]};
    }
}

void fill_step(const DicomHeader& header, DicomSlice& slice) {
    std::vector<double> spacing = header.numbers(kPixelSpacing, slice.frame);
    if (spacing.size() != 2) spacing = header.numbers(kImagerSpacing, slice.frame);
    if (spacing.size() == 2 && spacing[0] > 0 && spacing[1] > 0) {
        slice.step = {spacing[1], spacing[0]};
        return;
    }
    constexpr std::uint32_t kCentimetres = 3;
    const std::vector<double> x = header.doubles(kRegionX, 0), y = header.doubles(kRegionY, 0);
    if (x.size() == 1 && y.size() == 1 && header.integer(kRegionUnitsX, 0) == kCentimetres &&
        header.integer(kRegionUnitsY, 0) == kCentimetres && x[0] != 0 && y[0] != 0)
        slice.step = {10 * std::abs(x[0]), 10 * std::abs(y[0])};
}

/// Sets the position of the plane: the position that the file states; otherwise a position that is derived from the
/// offsets of the frames or, for the only plane of a file, from the slice location. If none of them is stated,
/// has_origin is false, and the position is the index of the frame times the stated distance between planes.
void fill_place(const DicomHeader& header, std::size_t frames, DicomSlice& slice) {
    fill_direction(header, slice);
    fill_step(header, slice);
    const std::vector<double> own = position_of(header, slice.frame, frames > 1);
    slice.has_origin = own.size() == 3;
    if (slice.has_origin) {
        slice.origin = {own[0], own[1], own[2]};
        return;
    }
    const std::vector<double> first = header.numbers(kPosition, 0), offsets = header.numbers(kFrameOffsets);
    if (first.size() == 3) slice.origin = {first[0], first[1], first[2]};
    double offset = 0;
    if (frames > 1 && offsets.size() == frames) {
        // In RT doses, the offsets are relative to the first plane, or are z coordinates. The difference to the first
        // offset is the same in both cases.
        offset = offsets[slice.frame] - offsets[0];
        slice.has_origin = true;
        slice.gap_field = "GridFrameOffsetVector (3004,000c)";
    } else {
        for (const auto& [tag, name] : {std::pair(kBetweenSlices, "SpacingBetweenSlices (0018,0088)"),
                                        std::pair(kThickness, "SliceThickness (0018,0050)")}) {
            const std::vector<double> gap = header.numbers(tag, slice.frame);
            if (slice.gap != 0 || gap.size() != 1) continue;
            slice.gap = gap[0];
            slice.gap_field = name;
        }
        offset = slice.gap * double(slice.frame);
    }
    for (std::size_t a = 0; a < 3; ++a) slice.origin[a] += offset * slice.direction[a][2];
    if (const std::vector<double> at = header.numbers(kLocation, slice.frame); frames == 1 && at.size() == 1) {
        for (std::size_t a = 0; a < 3; ++a) slice.origin[a] = at[0] * slice.direction[a][2];
        slice.has_origin = true;
        slice.gap_field = "SliceLocation (0020,1041)";
    }
}

/// Sets time, echo and stack, which distinguish the volumes of a series.
void fill_volume(const DicomHeader& header, std::size_t frames, DicomSlice& slice) {
    const std::size_t n = slice.frame;
    const auto first_of = [](const std::vector<double>& list) { return list.empty() ? "" : sortable(list[0]); };
    slice.stack = header.text(kStackId, n);
    if (const auto index = header.integer(kTemporalIndex, n)) slice.time = sortable(*index);
    if (slice.time.empty()) slice.time = first_of(header.doubles(kTimeOffset, n));
    slice.echo = first_of(header.doubles(kEffectiveEcho, n));
    if (frames > 1) return;
    if (slice.time.empty()) slice.time = first_of(header.numbers(kTemporalPosition));
    if (slice.time.empty()) slice.time = first_of(header.numbers(kTriggerTime));
    if (slice.echo.empty()) slice.echo = first_of(header.numbers(kEchoTime));
    if (slice.echo.empty()) slice.echo = first_of(header.numbers(kEchoNumbers));
}

std::vector<DicomSlice> slices_of(const std::string& path, const DicomHeader& header, std::size_t frames,
                                  const ItkHeader* packed, const std::string& unusable) {
    std::vector<DicomSlice> slices;
    for (std::size_t n = 0; n < frames; ++n) {
        DicomSlice slice;
        slice.path = path;
        slice.series = header.text(kSeriesUid);
        slice.sop_class = header.text(kSopClass);
        slice.sop_instance = header.text(kSopInstance);
        slice.description = header.text(kModality) + " " + header.text(kSeriesDescription);
        slice.frame = n;
        slice.file_frames = frames;
        slice.size = {std::int32_t(header.integer(kColumns).value_or(0)),
                      std::int32_t(header.integer(kRows).value_or(0)), 1};
        if (const std::vector<double> number = header.numbers(kInstance); number.size() == 1) slice.number = number[0];
        if (packed != nullptr)
            fill_packed(header, *packed, slice);
        else
            fill_plain(header, frames, unusable, slice);
        fill_place(header, frames, slice);
        fill_volume(header, frames, slice);
        slices.push_back(std::move(slice));
    }
    return slices;
}

/// @throws Error InvalidInput with the message `unusable`.
std::size_t count_frames(const DicomHeader& header, const std::string& unusable) {
    constexpr double kMax = 65535;
    const std::vector<double> frames = header.numbers(kFrameCount);
    if (frames.size() != 1 || frames[0] <= 1) return 1;
    if (frames[0] > kMax || frames[0] != std::floor(frames[0])) throw Error(Errc::InvalidInput, unusable);
    return static_cast<std::size_t>(frames[0]);
}

/// Checks that GDCM finds the same size and number of frames as the header. @throws Error InvalidInput with the message
/// `unusable`.
void check_packed(const DicomHeader& header, std::size_t frames, const ItkHeader& image, const std::string& unusable) {
    const std::uint64_t wanted[3] = {header.integer(kColumns).value_or(0), header.integer(kRows).value_or(0), frames};
    for (std::size_t a = 0; a < 3; ++a)
        if ((a < image.size.size() ? image.size[a] : 1) != wanted[a]) throw Error(Errc::InvalidInput, unusable);
}

}  // namespace

std::vector<std::variant<std::vector<DicomSlice>, Error>> read_dicom_slices(const std::vector<std::string>& paths,
                                                                            const RunContext& run) {
    std::vector<std::variant<std::vector<DicomSlice>, Error>> files;
    std::vector<Piece> for_gdcm;
    std::vector<std::pair<std::size_t, DicomHeader>> waiting;  // compressed files: index in `files`, and header
    for (const std::string& path : paths) {
        run.check();
        const std::string unusable = path + ": damaged, truncated, or not a DICOM image";
        try {
            std::optional<DicomHeader> header = read_dicom_header(path);
            if (!header) throw Error(Errc::InvalidInput, unusable);
            const std::size_t frames = count_frames(*header, unusable);
            if (header->encapsulated) {
                for_gdcm.push_back({path, unusable});
                waiting.emplace_back(files.size(), std::move(*header));
                files.emplace_back(std::vector<DicomSlice>());
            } else {
                files.emplace_back(slices_of(path, *header, frames, nullptr, unusable));
            }
        } catch (const Error& error) {
            files.emplace_back(error);
        }
    }
    if (waiting.empty()) return files;
    const std::vector<std::variant<ItkHeader, Error>> images = read_headers(ReaderTask::GdcmHeader, for_gdcm, run);
    for (std::size_t n = 0; n < images.size(); ++n) {
        auto& file = files[waiting[n].first];
        try {
            if (const Error* error = std::get_if<Error>(&images[n])) throw Error(*error);
            const auto& image = std::get<ItkHeader>(images[n]);
            const DicomHeader& header = waiting[n].second;
            const std::size_t frames = count_frames(header, for_gdcm[n].detail);
            check_packed(header, frames, image, for_gdcm[n].detail);
            file = slices_of(for_gdcm[n].path, header, frames, &image, for_gdcm[n].detail);
        } catch (const Error& error) {
            file = error;
        }
    }
    return files;
}

}  // namespace covol::detail
