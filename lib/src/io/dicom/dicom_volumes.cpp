// Combines the planes of a DICOM series into a volume. ITK's class for DICOM series neither reports the contents of a
// folder nor detects a missing slice, and assumes that the frames of a file are evenly spaced in the order of the file.
#include "io/dicom/dicom_volumes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "base/number.h"

namespace covol::detail {
namespace {

using Slices = std::vector<DicomSlice>;

std::string name_of(const DicomSlice& slice) {
    return std::filesystem::path(slice.path).filename().string() +
           (slice.file_frames > 1 ? ", frame " + std::to_string(slice.frame + 1) + "," : "");
}

bool same_direction(const DicomSlice& a, const DicomSlice& b) {
    double maximum = 0;
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 2; ++c)
            maximum = std::max(maximum, std::abs(a.direction[r][c] - b.direction[r][c]));
    return maximum < 1e-3;
}

/// The position of a plane along the normal of the plane `first`, in mm. All planes of a volume have the same normal.
double depth(const DicomSlice& slice, const DicomSlice& first) {
    double along = 0;
    for (std::size_t a = 0; a < 3; ++a) along += first.direction[a][2] * slice.origin[a];
    return along;
}

bool same_place(const DicomSlice& a, const DicomSlice& b) {
    double maximum = 0;
    for (std::size_t c = 0; c < 3; ++c) maximum = std::max(maximum, std::abs(a.origin[c] - b.origin[c]));
    return maximum < 1e-4;
}

void sort_by_depth(Slices& slices) {
    const DicomSlice first = slices.front();
    std::stable_sort(slices.begin(), slices.end(),
                     [&](const DicomSlice& a, const DicomSlice& b) { return depth(a, first) < depth(b, first); });
}

bool has_planes_at_one_place(const Slices& slices) {
    Slices sorted = slices;
    sort_by_depth(sorted);
    return slices.front().has_origin && std::adjacent_find(sorted.begin(), sorted.end(), same_place) != sorted.end();
}

/// Splits each volume by the value of `key` in its planes. A volume is not split if all its planes have the same value.
/// With `only_at_one_place`, a volume without two planes at the same position is not split either. Without it, a volume
/// is not split if every plane has a value of its own, which would yield volumes of a single plane.
std::vector<DicomVolume> split_by(const std::vector<DicomVolume>& volumes, const char* what,
                                  std::string DicomSlice::*key, bool only_at_one_place) {
    std::vector<DicomVolume> parts;
    for (const DicomVolume& volume : volumes) {
        std::map<std::string, Slices> by_key;
        if (!only_at_one_place || has_planes_at_one_place(volume.slices))
            for (const DicomSlice& slice : volume.slices) by_key[slice.*key].push_back(slice);
        if (by_key.size() < 2 || (by_key.size() == volume.slices.size() && !only_at_one_place)) {
            parts.push_back(volume);
            continue;
        }
        for (auto& [text, slices] : by_key)
            parts.push_back({std::move(slices), volume.name + (volume.name.empty() ? "" : ", ") + what + " " +
                                                    text.substr(text.rfind(' ') + 1)});
    }
    return parts;
}

std::vector<DicomVolume> split_by_direction(const DicomVolume& volume) {
    std::vector<DicomVolume> parts;
    for (const DicomSlice& slice : volume.slices) {
        auto part = std::find_if(parts.begin(), parts.end(),
                                 [&](const DicomVolume& known) { return same_direction(known.slices.front(), slice); });
        if (part == parts.end()) {
            parts.push_back({{}, "orientation " + std::to_string(parts.size())});
            part = parts.end() - 1;
        }
        part->slices.push_back(slice);
    }
    if (parts.size() == 1) parts.front().name.clear();
    return parts;
}

/// Splits volumes in which frames of one file have the same position although they have the same time, echo and stack:
/// the first frames of all positions form one volume, the second frames another, and so on.
std::vector<DicomVolume> split_by_order(const std::vector<DicomVolume>& volumes) {
    std::vector<DicomVolume> parts;
    for (const DicomVolume& volume : volumes) {
        if (volume.slices.front().file_frames < 2 || !has_planes_at_one_place(volume.slices)) {
            parts.push_back(volume);
            continue;
        }
        Slices sorted = volume.slices;
        sort_by_depth(sorted);
        std::vector<DicomVolume> ranks;
        for (std::size_t n = 0, rank = 0; n < sorted.size(); ++n) {
            rank = n > 0 && same_place(sorted[n - 1], sorted[n]) ? rank + 1 : 0;
            if (rank == ranks.size())
                ranks.push_back({{},
                                 volume.name + (volume.name.empty() ? "" : ", ") + "no. " + std::to_string(rank) +
                                     " at each position, in the order of the file"});
            ranks[rank].slices.push_back(sorted[n]);
        }
        parts.insert(parts.end(), ranks.begin(), ranks.end());
    }
    return parts;
}

void check_gaps(const std::string& path, const Slices& slices) {
    std::vector<double> gaps;
    for (std::size_t k = 1; k < slices.size(); ++k)
        gaps.push_back(depth(slices[k], slices.front()) - depth(slices[k - 1], slices.front()));
    std::vector<double> sorted = gaps;
    std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(sorted.size() / 2), sorted.end());
    const double usual = sorted[sorted.size() / 2];
    for (std::size_t k = 0; k < gaps.size(); ++k) {
        if (std::abs(gaps[k] - usual) <= 0.02 * usual && usual > 0) continue;
        throw read_error(
            Errc::InvalidInput, path,
            "expected equidistant slices, got a distance of " + number(gaps[k]) + " between " + name_of(slices[k]) +
                " and " + name_of(slices[k + 1]) + " instead of " + number(usual) +
                (!(gaps[k] > 0 && usual > 0)       ? ": several volumes in one series; put one into a folder of its own"
                 : std::round(gaps[k] / usual) > 1 ? ": a slice is missing"
                                                   : ": resample the image to equal distances"));
    }
}

/// Checks that the origins of the slices lie on a straight line, so that an affine map describes the volume. With a
/// tilted gantry, this line is oblique to the slices.
void check_straight(const std::string& path, const Slices& slices, const Vec3& step) {
    const DicomSlice& first = slices.front();
    const double pixel = std::min(first.step[0], first.step[1]), maximum = pixel > 0 ? pixel / 2 : 0.5;
    for (std::size_t k = 0; k < slices.size(); ++k) {
        double square = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const double off = slices[k].origin[a] - first.origin[a] - double(k) * step[a];
            square += off * off;
        }
        if (square > maximum * maximum)
            throw read_error(Errc::InvalidInput, path,
                             "expected slices along a straight line, got " + name_of(slices[k]) + " " +
                                 number(std::sqrt(square)) +
                                 " mm away from it: the image is bent or was moved; resample it");
    }
}

/// Sorts the slices by position and sets the spacing and direction along k. With a tilted gantry, this direction is not
/// perpendicular to the slices.
void place_by_positions(const std::string& path, Slices& slices, ImageInfo& info) {
    sort_by_depth(slices);
    check_gaps(path, slices);
    const DicomSlice &first = slices.front(), &last = slices.back();
    const double gaps = double(slices.size() - 1);
    ImageGeometry& g = info.geometry;
    Vec3 step;
    for (std::size_t a = 0; a < 3; ++a) step[a] = (last.origin[a] - first.origin[a]) / gaps;
    check_straight(path, slices, step);
    g.spacing[2] = std::hypot(step[0], step[1], step[2]);
    for (std::size_t a = 0; a < 3; ++a) g.direction[a][2] = step[a] / g.spacing[2];
    info.fields.emplace_back(first.gap_field.empty() ? "ImagePositionPatient (0020,0032)" : first.gap_field,
                             "order of " + std::to_string(slices.size()) + " slices, origin, spacing along z");
}

/// Orders frames as in the file (reversed if the stated distance is negative) and slices by InstanceNumber. The spacing
/// along z is the distance that the file states.
void place_by_order(Slices& slices, ImageInfo& info) {
    const bool are_frames = slices.front().file_frames > 1;
    if (!are_frames)
        std::stable_sort(slices.begin(), slices.end(),
                         [](const DicomSlice& a, const DicomSlice& b) { return a.number < b.number; });
    const double gap = slices.front().gap;
    if (are_frames && gap < 0) std::reverse(slices.begin(), slices.end());
    info.spacing_known[2] = gap != 0;
    if (gap != 0) info.geometry.spacing[2] = std::abs(gap);
    info.fields.emplace_back("order of the slices", are_frames ? "the file's frames" : "InstanceNumber (0020,0013)");
    info.fields.emplace_back(gap != 0 ? slices.front().gap_field : "no position, SpacingBetweenSlices, SliceThickness",
                             gap != 0 ? "the spacing along z: " + number(gap) : "the spacing along z is not known");
}

}  // namespace

std::vector<DicomVolume> dicom_volumes(const std::string& path, Slices slices) {
    const bool one_file = slices.front().file_frames > 1;
    for (const DicomSlice& slice : slices) {
        const DicomSlice& first = slices.front();
        if (slice.path != first.path && slice.file_frames > 1 && !slice.has_origin)
            throw read_error(Errc::Unsupported, path,
                             "the series has several files with several frames each, without positions; give one of "
                             "them");
        if (slice.size == first.size && slice.components == first.components &&
            (one_file || same_direction(slice, first)))
            continue;
        throw read_error(
            Errc::Unsupported, path,
            "the slices of the series differ in size, orientation or number of channels: " + name_of(first) + " and " +
                name_of(slice) + "; give a folder with the slices of one volume");
    }
    std::vector<DicomVolume> volumes = split_by_direction({std::move(slices), ""});
    volumes = split_by(volumes, "stack", &DicomSlice::stack, false);
    volumes = split_by(volumes, "time", &DicomSlice::time, true);
    volumes = split_by(volumes, "echo", &DicomSlice::echo, true);
    return split_by_order(volumes);
}

void place_dicom_volume(const std::string& path, DicomVolume& volume, ImageInfo& info) {
    Slices& slices = volume.slices;
    const auto placed = std::size_t(
        std::count_if(slices.begin(), slices.end(), [](const DicomSlice& slice) { return slice.has_origin; }));
    if (placed > 0 && placed < slices.size())
        throw read_error(Errc::InvalidInput, path,
                         "expected a position of each slice, got " + std::to_string(placed) + " of " +
                             std::to_string(slices.size()) +
                             " with ImagePositionPatient (0020,0032) or SliceLocation (0020,1041)");
    info.fields = {{"PixelSpacing (0028,0030)", "the spacing along x and y"},
                   {"ImageOrientationPatient (0020,0037)", "the direction"}};
    ImageGeometry& g = info.geometry;
    g.unit = "mm";
    const DicomSlice one = slices.front();
    g.size = require_3d(path, {std::uint64_t(one.size[0]), std::uint64_t(one.size[1]), slices.size()});
    for (std::size_t a = 0; a < 2; ++a) {
        info.spacing_known[a] = one.step[a] > 0;
        g.spacing[a] = info.spacing_known[a] ? one.step[a] : 1;
    }
    g.spacing[2] = 1;
    info.spacing_known[2] = true;
    g.direction = one.direction;
    if (placed > 0)
        place_by_positions(path, slices, info);
    else
        place_by_order(slices, info);
    g.origin = slices.front().origin;
}

}  // namespace covol::detail
