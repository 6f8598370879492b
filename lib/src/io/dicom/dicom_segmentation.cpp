#include "io/dicom/dicom_segmentation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "covol/error.h"
#include "covol/version.h"
#include "files/atomic.h"
#include "files/dicom_class.h"
#include "io/dicom/dicom_source.h"

namespace covol::detail {
namespace {

constexpr std::uint32_t kSegmentNumber = 0x0062000B, kSegmentIdentification = 0x0062000A;
constexpr std::uint32_t kPlanePosition = 0x00209113, kImagePosition = 0x00200032;

/// The voxels of a label in a slice, one bit for each voxel. The first voxel is the lowest bit of the first byte (PS3.5
/// 8.1.1).
using Bits = std::vector<std::uint8_t>;

/// For each label, the indices of the slices in which it occurs, with its voxels in the slice.
using Planes = std::map<std::int32_t, std::map<std::int32_t, Bits>>;

std::map<std::int32_t, Bits> split(const PixelSource& source, int k) {
    const Index3 size = source.geometry().size;
    const VoxelBox box{{0, 0, k}, {size[0] - 1, size[1] - 1, k}};
    const std::size_t count = std::size_t(size[0]) * std::size_t(size[1]);
    std::map<std::int32_t, Bits> labels;
    const std::optional<double> uniform = source.uniform(box);
    if (uniform && *uniform == 0) {
        source.wrote(box, nullptr, 0);
        return labels;
    }
    with_pixel_type(source.type(), [&](auto pixel) {
        using T = decltype(pixel);
        std::vector<T> values(count);
        source.fill(box, values.data());
        source.wrote(box, values.data(), 0);
        Bits* bits = nullptr;
        for (std::size_t n = 0; n < count; ++n) {
            if (values[n] == T(0)) continue;
            if (bits == nullptr || values[n] != values[n - 1]) {
                bits = &labels[std::int32_t(values[n])];
                bits->resize((count + 7) / 8);
            }
            (*bits)[n / 8] = std::uint8_t((*bits)[n / 8] | 1U << n % 8);
        }
    });
    return labels;
}

Planes read_planes(const PixelSource& source, const RunContext& run) {
    constexpr int kAtOnce = 16;
    const int slices = source.geometry().size[2];
    Planes planes;
    for (int first = 0; first < slices; first += kAtOnce) {
        run.check();
        run.report("write", double(first) / slices);
        std::array<std::map<std::int32_t, Bits>, kAtOnce> some;
        const int count = std::min(kAtOnce, slices - first);
        tbb::parallel_for(0, count, [&](int n) { some[std::size_t(n)] = split(source, first + n); });
        for (int n = 0; n < count; ++n)
            for (auto& [value, bits] : some[std::size_t(n)]) planes[value][first + n] = std::move(bits);
    }
    return planes;
}

/// The pixel data of all frames. A frame begins at the bit after the end of the previous one, so it may begin within a
/// byte.
class BitStream {
public:
    void add(const Bits& bits, std::size_t count) {
        const std::size_t shift = count_ % 8;
        for (std::size_t n = 0; n < bits.size(); ++n) {
            if (shift == 0)
                bytes_ += char(bits[n]);
            else {
                bytes_.back() = char(std::uint8_t(bytes_.back()) | std::uint8_t(bits[n] << shift));
                if (n * 8 + 8 - shift < count) bytes_ += char(bits[n] >> (8 - shift));
            }
        }
        count_ += count;
    }
    [[nodiscard]] std::string take() { return std::move(bytes_); }

private:
    std::string bytes_;
    std::size_t count_ = 0;
};

/// The labels that have names, followed by the labels without names that occur in the image.
std::vector<NamedLabel> segments_of(const PixelSource& source, const Planes& planes) {
    std::vector<NamedLabel> segments = source.label_names();
    for (const auto& [value, slices] : planes)
        if (std::none_of(segments.begin(), segments.end(),
                         [value = value](const NamedLabel& known) { return known.value == value; }))
            segments.push_back({value, "label " + std::to_string(value)});
    return segments;
}

DicomItem segment_item(const DicomSource& from, std::size_t number, const NamedLabel& label) {
    constexpr std::size_t kLongest = 64;
    // The kind of structure (organ, tumour, ...) is unknown, so the most general code, "Tissue", is used.
    const DicomItem tissue = dicom_code("85756007", "SCT", "Tissue");
    const auto [l, a, b] = to_cielab(label.color);
    DicomItem item;
    item.put_items(0x00620003, {tissue});
    item.put_shorts(0x00620004, {std::uint16_t(number)});
    item.put(0x00620005, "LO", from.name(label.name, kLongest));
    item.put(0x00620008, "CS", "SEMIAUTOMATIC");
    item.put(0x00620009, "LO", "covol " COVOL_VERSION_STRING);
    item.put_shorts(0x0062000D, {l, a, b});
    item.put_items(0x0062000F, {tissue});
    return item;
}

DicomItem shared_groups(const ImageGeometry& g) {
    std::vector<double> cosines;
    for (std::size_t a = 0; a < 2; ++a)
        for (std::size_t r = 0; r < 3; ++r) cosines.push_back(g.direction[r][a]);
    // If the gantry is tilted, the axis k is oblique to the slices, so the distance between their planes is measured
    // along the normal.
    const Vec3 normal{cosines[1] * cosines[5] - cosines[2] * cosines[4],
                      cosines[2] * cosines[3] - cosines[0] * cosines[5],
                      cosines[0] * cosines[4] - cosines[1] * cosines[3]};
    double across = 0;
    for (std::size_t r = 0; r < 3; ++r) across += normal[r] * g.direction[r][2];
    const double apart = std::abs(across) * g.spacing[2];
    DicomItem orientation, measures, groups;
    orientation.put_decimals(0x00200037, cosines);
    measures.put_decimals(0x00180050, {apart});
    measures.put_decimals(0x00180088, {apart});
    measures.put_decimals(0x00280030, {g.spacing[1], g.spacing[0]});
    groups.put_items(0x00209116, {orientation});
    groups.put_items(0x00289110, {measures});
    return groups;
}

DicomItem frame_groups(const Vec3& position, std::size_t segment, std::size_t place,
                       const std::optional<SourcePlane>& from) {
    DicomItem groups, content, plane, identification;
    content.put_longs(0x00209157, {std::uint32_t(segment), std::uint32_t(place)});
    plane.put_decimals(kImagePosition, {position[0], position[1], position[2]});
    identification.put_shorts(kSegmentNumber, {std::uint16_t(segment)});
    groups.put_items(0x00209111, {content});
    groups.put_items(kPlanePosition, {plane});
    groups.put_items(kSegmentIdentification, {identification});
    if (from) {
        DicomItem image = DicomSource::reference(*from), derivation;
        image.put_items(0x0040A170, {dicom_code("121322", "DCM", "Source image for image processing operation")});
        derivation.put_items(0x00082112, {image});
        derivation.put_items(0x00089215, {dicom_code("113076", "DCM", "Segmentation")});
        groups.put_items(0x00089124, {derivation});
    }
    return groups;
}

DicomItem dimension(std::uint32_t pointer, std::uint32_t group, const std::string& organization, const char* label) {
    DicomItem item;
    item.put(0x00209164, "UI", organization);
    item.put_tag(0x00209165, pointer);
    item.put_tag(0x00209167, group);
    item.put(0x00209421, "LO", label);
    return item;
}

void put_dimensions(DicomItem& file) {
    const std::string organization = dicom_uid("covol: segments, and positions of planes");
    DicomItem whole;
    whole.put(0x00209164, "UI", organization);
    file.put_items(0x00209221, {whole});
    file.put_items(0x00209222, {dimension(kSegmentNumber, kSegmentIdentification, organization, "Segment Number"),
                                dimension(kImagePosition, kPlanePosition, organization, "Image Position")});
}

void put_image(DicomItem& file, const Index3& size, std::size_t frames) {
    file.put(0x00080008, "CS", "DERIVED\\PRIMARY");
    file.put_shorts(0x00280002, {1});
    file.put(0x00280004, "CS", "MONOCHROME2");
    file.put(0x00280008, "IS", std::to_string(frames));
    file.put_shorts(0x00280010, {std::uint16_t(size[1])});
    file.put_shorts(0x00280011, {std::uint16_t(size[0])});
    file.put_shorts(0x00280100, {1});
    file.put_shorts(0x00280101, {1});
    file.put_shorts(0x00280102, {0});
    file.put_shorts(0x00280103, {0});
    file.put(0x00620001, "CS", "BINARY");
    file.put(0x00620013, "CS", "NO");
    file.put(0x00700080, "CS", "SEGMENTATION");
    file.put(0x00700081, "LO", "Structures segmented with covol");
    file.put(0x00700084, "PN", "");
}

void check_size(const std::string& path, const PixelSource& source) {
    constexpr std::int32_t kMax = 65535;
    const Index3 size = source.geometry().size;
    if (!source.is_labels())
        throw Error(Errc::Unsupported, path +
                                           ": only label images can be written as DICOM (a segmentation); write "
                                           ".nrrd, .nii.gz or .mha");
    if (size[0] > kMax || size[1] > kMax)
        throw Error(Errc::Unsupported, path + ": expected at most 65535 columns and rows, got " + size_text(size) +
                                           "; write .nrrd or .zarr");
}

}  // namespace

std::array<std::uint16_t, 3> to_cielab(const std::array<std::uint8_t, 3>& color) {
    std::array<double, 3> linear{};
    for (std::size_t n = 0; n < 3; ++n) {
        const double c = color[n] / 255.0;  // sRGB as defined in IEC 61966-2-1
        linear[n] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    }
    // From linear sRGB to XYZ, adapted to the white point D50 by Bradford's method: http://www.brucelindbloom.com
    constexpr double kToXyz[3][3] = {
        {0.4360747, 0.3850649, 0.1430804}, {0.2225045, 0.7168786, 0.0606169}, {0.0139322, 0.0971045, 0.7141733}};
    constexpr double kWhite[3] = {0.96422, 1, 0.82521};
    std::array<double, 3> f{};
    for (std::size_t n = 0; n < 3; ++n) {
        double t = 0;
        for (std::size_t m = 0; m < 3; ++m) t += kToXyz[n][m] * linear[m] / kWhite[n];
        f[n] = t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
    }
    const auto word = [](double fraction) {
        return std::uint16_t(std::lround(65535 * std::clamp(fraction, 0.0, 1.0)));
    };
    return {word((116 * f[1] - 16) / 100), word((500 * (f[0] - f[1]) + 128) / 255),
            word((200 * (f[1] - f[2]) + 128) / 255)};
}

void write_dicom_segmentation(const std::string& path, const PixelSource& source, const WriteImageOptions& options,
                              const RunContext& run) {
    check_size(path, source);
    const ImageGeometry g = in_millimetres(path, source.geometry(), run);
    const DicomSource from = read_dicom_source(options.like, options.like_frame, g, run);
    Planes planes = read_planes(source, run);
    const std::vector<NamedLabel> segments = segments_of(source, planes);
    if (segments.empty())
        throw Error(Errc::InvalidInput, path + ": expected labels, got an image that is 0 everywhere");
    const std::size_t pixels = std::size_t(g.size[0]) * std::size_t(g.size[1]);
    // DICOM requires at least one frame. If no label has voxels, the first label gets an empty frame.
    if (planes.empty()) planes[segments.front().value][0].resize((pixels + 7) / 8);
    std::map<std::int32_t, std::size_t> places;  // number of each slice in the file, counted from 1, by slice index
    for (const auto& [value, slices] : planes)
        for (const auto& [k, bits] : slices) places[k] = 0;
    std::size_t place = 0;
    for (auto& [k, number] : places) number = ++place;

    std::vector<DicomItem> frames, described;
    std::vector<SourcePlane> used;
    std::map<std::int32_t, std::optional<SourcePlane>> origins;
    for (const auto& [k, number] : places) {
        origins[k] = from.plane_of(g, k);
        if (origins[k]) used.push_back(*origins[k]);
    }
    BitStream stream;
    for (std::size_t n = 0; n < segments.size(); ++n) {
        described.push_back(segment_item(from, n + 1, segments[n]));
        for (const auto& [k, bits] : planes[segments[n].value]) {
            frames.push_back(frame_groups(g.index_to_world({0, 0, double(k)}), n + 1, places.at(k), origins.at(k)));
            stream.add(bits, pixels);
        }
    }

    DicomItem file = from.instance("SEG", "Segmentation by covol");
    put_image(file, g.size, frames.size());
    put_dimensions(file);
    file.put_items(0x00620002, described);
    file.put_items(0x52009229, {shared_groups(g)});
    file.put_items(0x52009230, frames);
    file.put(0x00282110, "CS", "00");
    file.add(from.lossy);
    const auto [date, time] = dicom_time();
    file.put(0x00080023, "DA", date);
    file.put(0x00080033, "TM", time);
    from.refer(file, used);
    file.put(0x7FE00010, "OB", stream.take());
    write_atomically(
        path, [&](const std::string& temporary) { write_dicom_instance(temporary, file, true, kSegmentationStorage); });
}

}  // namespace covol::detail
