#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <vector>

#include "covol/error.h"
#include "covol/points.h"
#include "image/to_world.h"
#include "io/points/point_reading.h"

namespace covol {
namespace {

/// A possible interpretation of the coordinates of a file.
struct Reading {
    ReadPointsOptions options;
    int changes = 0;     ///< number of differences from the current reading
    std::string advice;  ///< the options that select this reading, as messages name them
};

/// Factors between common units of length, the more likely factors first.
constexpr std::array<double, 15> kScales{1.0,  1e3, 1e-3, 1e6, 1e-6, 10,   0.1,     100,
                                         0.01, 1e4, 1e-4, 1e5, 1e-5, 25.4, 1 / 25.4};

/// How unusual a factor is. 0: the factor is 1; 1: 1000 or 1/1000; 2: 10^6 or 10^-6; 3: any other factor.
int rank_of_scale(double scale) {
    for (const auto& [factor, rank] : {std::pair(1.0, 0), {1e3, 1}, {1e-3, 1}, {1e6, 2}, {1e-6, 2}})
        if (std::abs(scale / factor - 1) < 1e-9) return rank;
    return 3;
}

const char* advice_of(PointSpace space) {
    switch (space) {
        case PointSpace::Index: return "points_space = index";
        case PointSpace::IndexOne: return "points_space = index1";
        case PointSpace::Ras: return "points_space = ras";
        case PointSpace::Local: return "points_space = local";
        default: return "points_space = world";
    }
}

/// Describes for messages how `reading` differs from `now`, the current interpretation of the coordinates.
std::string name_of(const Reading& reading, const ReadPointsOptions& now) {
    std::string text;
    const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
    if (reading.options.order != now.order) add("the order of the axes is reversed");
    if (reading.options.space != now.space) switch (reading.options.space) {
            case PointSpace::Index: add("they are voxels, not world units"); break;
            case PointSpace::IndexOne: add("they are voxels counted from 1"); break;
            case PointSpace::Ras: add("they are in RAS, the image is in LPS"); break;
            case PointSpace::Local: add("they leave out the image's origin"); break;
            default:
                add(now.space == PointSpace::Ras ? "they are in LPS, not in RAS" : "they are world units, not voxels");
        }
    if (reading.options.scale != now.scale) add("their unit differs from the image's");
    if (reading.options.channels != now.channels) add("their slices count the channels of a hyperstack");
    return text;
}

class Checker {
public:
    Checker(const PointCloud& cloud, const ImageGeometry& geometry)
        : cloud_(cloud), geometry_(geometry), now_(cloud.reading) {
        // A cloud that was not read from a file states no reading, so its space and the order x, y, z are assumed.
        if (now_.space == PointSpace::Unstated) now_.space = cloud.space;
        if (now_.order == PointOrder::Unstated) now_.order = PointOrder::XYZ;
        world_ = to_world(cloud, geometry);
    }

    [[nodiscard]] std::size_t count_outside() const {
        return static_cast<std::size_t>(
            std::count_if(world_.begin(), world_.end(), [&](const Vec3& p) { return !is_inside(p); }));
    }

    [[nodiscard]] std::string boxes() const {
        return "points from " + text_of(bounding_box(world_)) + ", image from " + text_of(geometry_.world_box());
    }

    /// The interpretations of the coordinates, with the fewest changes, that put every point inside the image.
    /// Interpretations with other units have the lowest priority, because they are weak evidence: if points are scaled
    /// down enough, all of them are inside.
    [[nodiscard]] std::vector<Reading> remedies() const {
        std::vector<Reading> found;
        const auto rank = [&](const Reading& r) {
            return std::pair(in_voxels(r.options) ? 0 : rank_of_scale(r.options.scale / now_.scale), r.changes);
        };
        std::vector<Reading> candidates = others();
        std::stable_sort(candidates.begin(), candidates.end(),
                         [&](const Reading& a, const Reading& b) { return rank(a) < rank(b); });
        for (const Reading& reading : candidates) {
            if (!found.empty() && rank(reading) > rank(found.front())) break;
            if (rank(reading).first > 0 && is_too_small(reading, rank(reading).first)) continue;
            if (rank(reading).first == 0 && is_in_one_voxel(reading)) continue;
            if (fits(reading)) found.push_back(reading);
        }
        // Counting voxels from 1 is suggested only if counting from 0 does not fit.
        const auto has = [&](PointSpace space, PointOrder order) {
            return std::any_of(found.begin(), found.end(),
                               [&](const Reading& r) { return r.options.space == space && r.options.order == order; });
        };
        std::erase_if(found, [&](const Reading& r) {
            return r.options.space == PointSpace::IndexOne && has(PointSpace::Index, r.options.order);
        });
        return found;
    }

    [[nodiscard]] std::string name(const Reading& reading) const { return name_of(reading, now_); }

    /// The most plausible interpretation of the coordinates, if it is more plausible than the current one; otherwise
    /// empty. It is more plausible if it puts all points on voxel centres along more axes, because marks that were set
    /// with the mouse lie on slices and often on voxel centres.
    [[nodiscard]] std::vector<Reading> more_plausible() const {
        constexpr std::size_t kMinPoints = 8;  // fewer points may lie on voxel centres by chance
        if (world_.size() < kMinPoints || cloud_.stated || now_.scale != 1) return {};
        const int axes = axes_on_centres(now_);
        std::vector<Reading> best;
        int maximum = axes;
        for (const Reading& reading : others()) {
            // Interpretations with another number of channels are excluded: they round slice numbers to integers, so
            // that all points lie on voxel centres along z.
            if (reading.options.scale != now_.scale || reading.options.channels != now_.channels ||
                reading.options.space == PointSpace::IndexOne || !fits(reading))
                continue;
            const int count = axes_on_centres(reading.options);
            if (count > maximum) {
                maximum = count;
                best.assign(1, reading);
            }
        }
        return best;
    }

private:
    [[nodiscard]] bool is_inside(const Vec3& world) const {
        constexpr double kTolerance = 1e-3;  // voxels
        const Vec3 index = geometry_.world_to_index(world);
        for (int a = 0; a < 3; ++a)
            if (index[a] < -0.5 - kTolerance || index[a] > geometry_.size[a] - 0.5 + kTolerance) return false;
        return true;
    }

    /// The position of a point of the cloud if the coordinates in its file are interpreted as `reading` states.
    [[nodiscard]] Vec3 place(const ReadPointsOptions& reading, const Vec3& point) const {
        const PointSpace space = detail::space_after(reading.space);
        // A scale that differs from the current one replaces the file's unit.
        const double unit = reading.scale == now_.scale ? detail::unit_factor(cloud_, geometry_) : 1;
        const Vec3 read = detail::read_as(reading, detail::undo(now_, point));
        return detail::to_world(space, detail::scaled(space, read, unit), geometry_);
    }

    [[nodiscard]] bool fits(const Reading& reading) const {
        return std::all_of(cloud_.points.begin(), cloud_.points.end(),
                           [&](const Vec3& p) { return is_inside(place(reading.options, p)); });
    }

    /// The bounding box of the points in voxels of the image.
    [[nodiscard]] WorldBox index_box(const Reading& reading) const {
        std::vector<Vec3> index;
        for (const Vec3& p : cloud_.points) index.push_back(geometry_.world_to_index(place(reading.options, p)));
        return bounding_box(index);
    }

    /// Whether the points are scaled down so much that being inside the image is no evidence for this interpretation of
    /// the coordinates. The limit `minimum` is stricter for unusual factors.
    [[nodiscard]] bool is_too_small(const Reading& reading, int rank) const {
        constexpr std::size_t kMinPoints = 8;
        const bool is_odd = rank > 2;
        // Minimum side of the bounding box of the points, as a fraction of the side of the image.
        const double minimum = is_odd ? 0.2 : 0.02;
        if (is_odd && cloud_.points.size() < kMinPoints) return true;
        const WorldBox box = index_box(reading);
        for (int a = 0; a < 3; ++a)
            if (box.max[a] - box.min[a] >= minimum * geometry_.size[a]) return false;
        return true;
    }

    /// Whether all points lie within a box smaller than one voxel. Such a reading is improbable: it takes small lengths
    /// for voxels.
    [[nodiscard]] bool is_in_one_voxel(const Reading& reading) const {
        return cloud_.points.size() > 1 && longest_side(index_box(reading)) < 1;
    }

    /// Number of axes along which all points lie on voxel centres. Axes along which all points have the same position
    /// are not counted.
    [[nodiscard]] int axes_on_centres(const ReadPointsOptions& reading) const {
        constexpr double kTolerance = 0.01;  // voxels
        std::array<bool, 3> on{true, true, true}, differ{false, false, false};
        std::optional<Vec3> first;
        for (const Vec3& p : cloud_.points) {
            const Vec3 index = geometry_.world_to_index(place(reading, p));
            if (!first) first = index;
            for (int a = 0; a < 3; ++a) {
                on[a] = on[a] && std::abs(index[a] - std::round(index[a])) < kTolerance;
                differ[a] = differ[a] || std::round(index[a]) != std::round((*first)[a]);
            }
        }
        int count = 0;
        for (int a = 0; a < 3; ++a) count += int(on[a] && differ[a]);
        return count;
    }

    static bool in_voxels(const ReadPointsOptions& reading) {
        return reading.space == PointSpace::Index || reading.space == PointSpace::IndexOne;
    }

    /// The interpretations of the coordinates that differ from the current one in one or two options, those with one
    /// change first. Empty if the slice numbers of the current one count channels.
    [[nodiscard]] std::vector<Reading> others() const {
        std::vector<Reading> list;
        // undo() cannot be used: a slice number that counts channels does not determine the position.
        if (now_.channels != 1) return list;
        const bool lengths = !in_voxels(now_);
        const bool shifted = geometry_.origin != Vec3{0, 0, 0} || !geometry_.is_axis_aligned();
        for (const PointSpace space : {PointSpace::World, PointSpace::Index, PointSpace::IndexOne, PointSpace::Ras,
                                       PointSpace::Local, PointSpace::Slices}) {
            if ((space == PointSpace::Slices && now_.space != space) || (space == PointSpace::Local && !shifted))
                continue;
            const bool voxels = in_voxels({space});
            for (const PointOrder order : {PointOrder::XYZ, PointOrder::ZYX})
                for (const double scale : kScales) {
                    if (voxels && scale != 1) continue;
                    add(list, {space, order, voxels && lengths ? 1.0 : now_.scale * scale, 1});
                }
        }
        constexpr int kMaxChannels = 6;
        if (!lengths)
            for (int channels = 2; channels <= kMaxChannels; ++channels)
                add(list, {now_.space, now_.order, now_.scale, channels});
        std::stable_sort(list.begin(), list.end(),
                         [](const Reading& a, const Reading& b) { return a.changes < b.changes; });
        return list;
    }

    void add(std::vector<Reading>& list, const ReadPointsOptions& options) const {
        constexpr int kMaxChanges = 2;
        Reading reading{options, 0, ""};
        const auto change = [&](const std::string& advice) {
            ++reading.changes;
            reading.advice += (reading.advice.empty() ? "" : ", ") + advice;
        };
        if (options.space != now_.space) change(advice_of(options.space));
        if (options.order != now_.order)
            change(options.order == PointOrder::ZYX ? "points_order = zyx" : "points_order = xyz");
        if (options.channels != now_.channels) change("points_channels = " + std::to_string(options.channels));
        if (options.scale != now_.scale && !in_voxels(options)) {
            std::ostringstream scale;
            scale << "points_scale = " << options.scale;
            change(scale.str());
        }
        if (reading.changes > 0 && reading.changes <= kMaxChanges) list.push_back(reading);
    }

    static std::string text_of(const WorldBox& box) {
        std::ostringstream s;
        s << "(" << box.min[0] << ", " << box.min[1] << ", " << box.min[2] << ") to (" << box.max[0] << ", "
          << box.max[1] << ", " << box.max[2] << ")";
        return s.str();
    }

    const PointCloud& cloud_;
    const ImageGeometry& geometry_;
    ReadPointsOptions now_;
    std::vector<Vec3> world_;
};

std::string advice_of(const Checker& checker, const std::vector<Reading>& remedies, bool spacing_known) {
    std::string text;
    for (const Reading& reading : remedies)
        text += (text.empty() ? "; `" : ", or `") + reading.advice + "` would bring them inside (" +
                checker.name(reading) + ")";
    if (remedies.size() > 1) text += "; several interpretations are possible: check which one is right";
    if (!spacing_known) text += "; the image states no spacing: set it with `spacing = sx,sy,sz`";
    return text;
}

}  // namespace

void check_inside(const PointCloud& cloud, const ImageGeometry& geometry, const RunContext& run) {
    const Checker checker(cloud, geometry);
    const std::size_t outside = checker.count_outside();
    if (outside > 0) {
        const std::vector<Reading> remedies = checker.remedies();
        const std::string first = !remedies.empty() ? remedies.front().advice : geometry.spacing_known ? "" : "spacing";
        throw Error(Errc::InvalidInput,
                    cloud.source + ": " + std::to_string(outside) + " of " + std::to_string(cloud.points.size()) +
                        " points lie outside the image: " + checker.boxes() +
                        advice_of(checker, remedies, geometry.spacing_known),
                    first.substr(0, first.find(' ')));
    }
    if (!geometry.spacing_known && cloud.space != PointSpace::Index)
        run.warn(cloud.source +
                 ": the points are in world units, but the image states no spacing, so 1 is used: set it with "
                 "`spacing = sx,sy,sz`, or use `points_space = index` if the points are voxels");
    for (const Reading& reading : checker.more_plausible())
        run.warn(cloud.source + ": the points lie inside the image, but `" + reading.advice +
                 "` would put them on voxel centres: perhaps " + checker.name(reading));
}

}  // namespace covol
