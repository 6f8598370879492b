#include "io/dicom/dicom_source.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <set>
#include <utility>

#include "base/text.h"
#include "covol/digest.h"
#include "covol/safe_text.h"
#include "covol/version.h"
#include "io/chunked/zarr.h"
#include "io/dicom/dicom_header.h"
#include "io/dicom/dicom_volumes.h"

namespace covol::detail {
namespace {

constexpr std::uint32_t kCharacterSet = 0x00080005, kStudyUid = 0x0020000D, kFrameOfReference = 0x00200052;

struct Copied {
    std::uint32_t tag;
    const char* vr;
    bool must_be;  ///< DICOM type 2: the element is required, but may be empty
};
/// The modules Patient, General Study and Patient Study: PS3.3 C.7.1.1, C.7.2.1 and C.7.2.2.
constexpr Copied kPatientAndStudy[] = {
    {0x00080020, "DA", true},  {0x00080030, "TM", true},  {0x00080050, "SH", true},  {0x00080090, "PN", true},
    {0x00081030, "LO", false}, {0x00100010, "PN", true},  {0x00100020, "LO", true},  {0x00100021, "LO", false},
    {0x00100030, "DA", true},  {0x00100040, "CS", true},  {0x00101010, "AS", false}, {0x00101020, "DS", false},
    {0x00101030, "DS", false}, {0x00120062, "CS", false}, {0x00120063, "LO", false}, {0x00200010, "SH", true}};
constexpr Copied kLossy[] = {{0x00282110, "CS", false}, {0x00282112, "DS", false}, {0x00282114, "CS", false}};

bool is_ascii(const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
}

bool is_valid_uid(const std::string& uid) {
    constexpr std::size_t kLongest = 64;
    return !uid.empty() && uid.size() <= kLongest &&
           std::all_of(uid.begin(), uid.end(), [](char c) { return c == '.' || (c >= '0' && c <= '9'); });
}

/// A text that distinguishes the image `like` from others on the same lattice: the digest of the file, or the path with
/// dicom_time() if there is no such file.
std::string identity_of(const std::string& like) {
    std::error_code status;
    if (std::filesystem::exists(like, status)) return digest_of(like);
    const auto [date, time] = dicom_time();
    return like + " " + date + time;
}

/// The planes of the chosen volume of the image `like`; empty if it is not a DICOM image.
std::vector<DicomSlice> planes_of(const std::string& like, std::optional<int> frame, const RunContext& run) {
    std::error_code status;
    const bool is_folder = std::filesystem::is_directory(like, status);
    if (is_folder ? is_zarr(like) : !std::filesystem::is_regular_file(like, status) || !is_dicom(like)) return {};
    RunContext silent = run;  // warnings about the image were already reported when it was read for the computation
    silent.log = {};
    std::vector<DicomVolume> volumes = dicom_volumes(like, read_dicom_series(like, silent));
    const auto chosen = std::size_t(std::max(0, frame.value_or(0)));
    return std::move(volumes[std::min(chosen, volumes.size() - 1)].slices);
}

/// Copies the elements. Latin-1 is converted to UTF-8; texts in other character sets are copied unchanged.
void copy_patient_and_study(const DicomHeader& header, DicomSource& source) {
    const std::string set = header.text(kCharacterSet);
    std::vector<std::pair<Copied, std::string>> texts;
    for (const Copied& copied : kPatientAndStudy) texts.emplace_back(copied, header.text(copied.tag));
    const bool plain = std::all_of(texts.begin(), texts.end(), [](const auto& text) { return is_ascii(text.second); });
    const bool is_latin = set.empty() || set == "ISO_IR 6" || set == "ISO_IR 100";
    source.is_utf8 = plain || is_latin || set == "ISO_IR 192";
    for (const auto& [copied, text] : texts)
        if (copied.must_be || !text.empty())
            source.patient_and_study.put(copied.tag, copied.vr, !plain && is_latin ? latin_to_utf8(text) : text);
    if (!source.is_utf8) source.patient_and_study.put(kCharacterSet, "CS", set);
    for (const Copied& copied : kLossy)
        if (const std::string text = header.text(copied.tag); !text.empty())
            source.lossy.put(copied.tag, copied.vr, text);
}

}  // namespace

DicomTime dicom_time() {
    // SOURCE_DATE_EPOCH, for reproducible files: https://reproducible-builds.org/specs/source-date-epoch
    const char* const given = std::getenv("SOURCE_DATE_EPOCH");
    const std::optional<long long> seconds = given == nullptr ? std::nullopt : to_number<long long>(given);
    const std::time_t now = seconds ? std::time_t(*seconds) : std::time(nullptr);
    std::tm parts{};
    if (seconds)
        gmtime_r(&now, &parts);
    else
        localtime_r(&now, &parts);
    std::array<char, 32> date{}, time{};
    std::strftime(date.data(), date.size(), "%Y%m%d", &parts);
    std::strftime(time.data(), time.size(), "%H%M%S", &parts);
    return {date.data(), time.data()};
}

std::optional<SourcePlane> DicomSource::plane_of(const ImageGeometry& geometry, int k) const {
    constexpr double kNear = 0.5;  // [voxels] the planes of other slices are farther away than this
    for (const DicomSlice& plane : planes) {
        if (!plane.has_origin && plane.file_frames == 1) continue;  // the position of this plane is unknown
        const Vec3 at = geometry.world_to_index(plane.origin);
        const double off = std::max({std::abs(at[0]), std::abs(at[1]), std::abs(at[2] - k)});
        if (off < kNear && is_valid_uid(plane.sop_class) && is_valid_uid(plane.sop_instance))
            return SourcePlane{plane.sop_class, plane.sop_instance, plane.frame, plane.file_frames};
    }
    return std::nullopt;
}

std::string DicomSource::name(const std::string& given, std::size_t longest) const {
    std::string text;
    std::size_t letters = 0;
    for (const char c : safe_text(given)) {
        const auto code = static_cast<unsigned char>(c);
        const bool begins = (code & 0xC0U) != 0x80;
        letters += begins ? 1 : 0;
        if (letters > longest) break;
        if (code >= 128 && !is_utf8)
            text += begins ? "?" : "";
        else
            text += c == '\\' ? '/' : c;
    }
    return text;
}

DicomItem DicomSource::reference(const SourcePlane& plane) {
    DicomItem item;
    item.put(0x00081150, "UI", plane.sop_class);
    item.put(0x00081155, "UI", plane.sop_instance);
    if (plane.file_frames > 1) item.put(0x00081160, "IS", std::to_string(plane.frame + 1));
    return item;
}

DicomItem DicomSource::instance(const std::string& own_modality, const std::string& description) const {
    DicomItem item = patient_and_study;
    if (is_utf8) item.put(kCharacterSet, "CS", "ISO_IR 192");
    item.put(0x00080060, "CS", own_modality);
    item.put(0x00080070, "LO", "covol");
    item.put(0x0008103E, "LO", description);
    item.put(0x00081090, "LO", "covol");
    item.put(0x00181000, "LO", "0");
    item.put(0x00181020, "LO", COVOL_VERSION_STRING);
    item.put(kStudyUid, "UI", study);
    item.put(0x00200011, "IS", "1");
    item.put(0x00200013, "IS", "1");
    item.put(kFrameOfReference, "UI", frame_of_reference);
    item.put(0x00201040, "LO", position_reference);
    return item;
}

void DicomSource::refer(DicomItem& file, const std::vector<SourcePlane>& used) const {
    if (series.empty() || used.empty()) return;
    std::set<std::string> known;
    std::vector<DicomItem> instances;
    for (SourcePlane plane : used) {
        if (!known.insert(plane.sop_instance).second) continue;
        plane.file_frames = 1;  // refers to the whole instance, not to one frame
        instances.push_back(reference(plane));
    }
    DicomItem item;
    item.put_items(0x0008114A, instances);
    item.put(0x0020000E, "UI", series);
    file.put_items(0x00081115, {item});
}

DicomSource read_dicom_source(const std::string& like, std::optional<int> frame, const ImageGeometry& geometry,
                              const RunContext& run) {
    DicomSource source;
    source.planes = planes_of(like, frame, run);
    std::string lattice = geometry.unit;
    for (int n = 0; n < 3; ++n) {
        lattice += " " + std::to_string(geometry.size[n]) + " " + decimal_string(geometry.spacing[n]) + " " +
                   decimal_string(geometry.origin[n]);
        for (const double c : geometry.direction[n]) lattice += " " + decimal_string(c);
    }
    const auto header = source.planes.empty() ? std::nullopt : read_dicom_header(source.planes.front().path);
    copy_patient_and_study(header.value_or(DicomHeader()), source);
    const std::string own = header ? source.planes.front().series : identity_of(like);
    source.study = dicom_uid("study of " + own + lattice);
    source.frame_of_reference = dicom_uid("frame of reference of " + own + lattice);
    if (!header) return source;
    if (is_valid_uid(source.planes.front().series)) source.series = source.planes.front().series;
    source.position_reference = header->text(0x00201040);
    if (const std::string uid = header->text(kStudyUid); is_valid_uid(uid)) source.study = uid;
    if (const std::string uid = header->text(kFrameOfReference, 0); is_valid_uid(uid)) source.frame_of_reference = uid;
    return source;
}

ImageGeometry in_millimetres(const std::string& path, const ImageGeometry& geometry, const RunContext& run) {
    const auto along = [&](std::size_t a, std::size_t b) {
        return geometry.direction[0][a] * geometry.direction[0][b] +
               geometry.direction[1][a] * geometry.direction[1][b] +
               geometry.direction[2][a] * geometry.direction[2][b];
    };
    // Maximum cosine of the angle between rows and columns; is_sheared() in raw_write.cpp has the same limit.
    constexpr double kMax = 1e-3;
    if (std::abs(along(0, 1)) > kMax)
        throw Error(Errc::Unsupported,
                    path +
                        ": expected perpendicular rows and columns, as DICOM requires, got sheared axes; write .nrrd, "
                        ".mha or .nii.gz, which can store them");
    const double metres = unit_in_metres(geometry.unit);
    constexpr double kMillimetre = 1e-3;
    if (metres == 0)
        run.warn(path +
                 ": the image's unit is not known, and DICOM stores lengths in mm: the numbers are interpreted as mm");
    const double scale = metres == 0 ? 1 : metres / kMillimetre;
    ImageGeometry scaled = geometry;
    if (metres != kMillimetre)
        for (std::size_t a = 0; a < 3; ++a) {
            scaled.spacing[a] *= scale;
            scaled.origin[a] *= scale;
        }
    scaled.unit = "mm";
    return scaled;
}

}  // namespace covol::detail
