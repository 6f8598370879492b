#include "image/support.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace covol::detail {
namespace {

// Half steps along a normal: half width of a window, and distance from a place to the two windows beside it.
constexpr int kWindow = 4, kBeside = 10;
constexpr int kReach = 10, kPlaces = 2 * kReach + 1;

/// Voxels and values of the image at multiples of half a step along the normal at a place. Negative positions are
/// before the place, positive ones behind it.
class Profile {
public:
    Profile(const Image& image, const Vec3& place, const Vec3& normal, double step)
        : image_(image), middle_(image.geometry().world_to_index(place)) {
        const Vec3 ahead =
            image.geometry().world_to_index({place[0] + normal[0], place[1] + normal[1], place[2] + normal[2]});
        double length = 0;
        for (int a = 0; a < 3; ++a) {
            half_[a] = ahead[a] - middle_[a];
            length += half_[a] * half_[a];
        }
        const double voxel = length > 0 ? 1 / std::sqrt(length) : 0;
        for (double& c : half_) c *= 0.5 * std::max(voxel, step);
    }
    [[nodiscard]] std::optional<Index3> voxel(int at) const {
        Index3 index;
        for (int a = 0; a < 3; ++a) {
            const double c = std::round(middle_[a] + at * half_[a]);
            if (!(std::abs(c) < std::numeric_limits<int>::max())) return {};
            index[a] = static_cast<int>(c);
        }
        if (!image_.held().contains(index)) return {};
        return index;
    }
    /// Maximum minus minimum value within kWindow half steps; none if these leave the image.
    [[nodiscard]] std::optional<double> range(int around) const {
        double minimum = std::numeric_limits<double>::infinity(), maximum = -minimum;
        for (int at = around - kWindow; at <= around + kWindow; ++at) {
            const std::optional<Index3> index = voxel(at);
            if (!index) return {};
            const double value = image_.at((*index)[0], (*index)[1], (*index)[2]);
            minimum = std::min(minimum, value), maximum = std::max(maximum, value);
        }
        return maximum - minimum;
    }

    /// Sum of the two values behind minus that of the two before the position; none if these leave the image.
    [[nodiscard]] std::optional<double> slope(int around) const {
        double difference = 0;
        for (const int at : {1, 2})
            for (const int side : {-1, 1}) {
                const std::optional<Index3> index = voxel(around + side * at);
                if (!index) return {};
                difference += side * image_.at((*index)[0], (*index)[1], (*index)[2]);
            }
        return difference;
    }
    /// Sum of the three values around the position, minus the mean of the same sums two steps before and two steps
    /// behind it; none if these leave the image.
    [[nodiscard]] std::optional<double> ridge(int around) const {
        double sum = 0;
        for (const int beside : {-4, 0, 4})
            for (int at = -1; at <= 1; ++at) {
                const std::optional<Index3> index = voxel(around + beside + at);
                if (!index) return {};
                sum += (beside == 0 ? 1.0 : -0.5) * image_.at((*index)[0], (*index)[1], (*index)[2]);
            }
        return sum;
    }

private:
    const Image& image_;
    Vec3 middle_, half_;
};

/// The profiles of the places. Loads the image up to `reach` half steps before and behind each place.
std::vector<Profile> profiles_of(const Image& image, const std::vector<Vec3>& places, const std::vector<Vec3>& normals,
                                 double step, int reach, const RunContext& run) {
    std::vector<Profile> profiles;
    profiles.reserve(places.size());
    std::vector<Vec3> needed;
    for (std::size_t n = 0; n < places.size(); ++n) {
        profiles.emplace_back(image, places[n], normals[n], step);
        for (int at = -reach; at <= reach; at += 2)
            if (const std::optional<Index3> voxel = profiles.back().voxel(at))
                needed.push_back(
                    image.geometry().index_to_world({double((*voxel)[0]), double((*voxel)[1]), double((*voxel)[2])}));
    }
    image.load(needed, run);
    return profiles;
}

using Strengths = std::array<std::optional<double>, kPlaces>;

/// Mean strength at the position with index `at`, over the lines with a value there; 0 if fewer than half of the lines
/// have one.
double mean_strength(const std::vector<Strengths>& lines, int at) {
    double sum = 0;
    std::size_t count = 0;
    for (const Strengths& line : lines)
        if (line[at]) sum += *line[at], ++count;
    return 2 * count < lines.size() ? 0 : sum / double(count);
}

/// Probability that a value of `first` exceeds one of `second`; equal values count half.
double probability_above(const std::vector<double>& first, std::vector<double> second) {
    std::sort(second.begin(), second.end());
    double sum = 0;
    for (const double value : first) {
        const auto [below, above] = std::equal_range(second.begin(), second.end(), value);
        sum += 0.5 * double((below - second.begin()) + (above - second.begin()));
    }
    return sum / (double(first.size()) * double(second.size()));
}

}  // namespace

ImageSupport measure_support(const Image& image, const std::vector<Vec3>& places, const std::vector<Vec3>& normals,
                             double step, const RunContext& run) {
    const std::vector<Profile> profiles = profiles_of(image, places, normals, step, kBeside + kWindow, run);
    using Ranges = std::array<std::optional<double>, 3>;
    std::vector<Ranges> ranges(places.size());
    tbb::parallel_for(std::size_t(0), places.size(), [&](std::size_t n) {
        ranges[n] = {profiles[n].range(0), profiles[n].range(-kBeside), profiles[n].range(kBeside)};
    });
    std::vector<double> at_places, beside;
    for (const Ranges& r : ranges) {
        if (!r[0] || (!r[1] && !r[2])) continue;
        at_places.push_back(*r[0]);
        for (int side = 1; side <= 2; ++side)
            if (r[side]) beside.push_back(*r[side]);
    }
    ImageSupport support;
    support.places = at_places.size();
    if (at_places.empty()) return support;
    support.fraction = probability_above(at_places, beside);
    const double a = double(at_places.size()), b = double(beside.size());
    support.error = std::sqrt((a + b + 1) / (12 * a * b));
    return support;
}

StrongestBorder find_strongest_border(const Image& image, const std::vector<Vec3>& places,
                                      const std::vector<Vec3>& normals, double step, BorderKind kind,
                                      const RunContext& run) {
    const bool is_line = kind == BorderKind::Line;
    const std::vector<Profile> profiles =
        profiles_of(image, places, normals, step, 2 * kReach + (is_line ? 5 : 2), run);
    std::vector<Strengths> lines(places.size());
    tbb::parallel_for(std::size_t(0), places.size(), [&](std::size_t n) {
        for (int at = 0; at < kPlaces; ++at) {
            const int around = 2 * (at - kReach);
            lines[n][at] = is_line ? profiles[n].ridge(around) : profiles[n].slope(around);
        }
    });
    std::array<double, kPlaces> mean{};
    for (int at = 0; at < kPlaces; ++at) mean[at] = mean_strength(lines, at);
    const auto strongest = [&](int first, int last) {
        int found = first;
        for (int at = first; at <= last; ++at)
            if (std::abs(mean[at]) > std::abs(mean[found])) found = at;
        return found;
    };
    const int own = strongest(kReach - 1, kReach + 1), maximum = strongest(0, kPlaces - 1);
    StrongestBorder result;
    result.at = maximum - kReach;
    const auto along = [&](const Strengths& line, int at) { return mean[at] < 0 ? -*line[at] : *line[at]; };
    double sum = 0, squares = 0;
    for (const Strengths& line : lines) {
        if (!line[own] || !line[maximum]) continue;
        const double more = along(line, maximum) - along(line, own);
        sum += more;
        squares += more * more;
        ++result.lines;
    }
    if (own == maximum || mean[maximum] == 0 || result.lines == 0) return result;
    result.fraction = std::abs(mean[own] / mean[maximum]);
    const auto count = double(result.lines);
    const double variance = std::max(0.0, squares / count - sum * sum / (count * count));
    result.errors = variance > 0 ? sum / count / std::sqrt(variance / count) : 0;
    return result;
}

}  // namespace covol::detail
