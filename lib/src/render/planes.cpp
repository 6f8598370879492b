// The slices that a figure shows, and their orientation on it.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "base/geometry.h"
#include "render/draw/decorations.h"
#include "render/slices.h"

namespace covol::figure {
namespace {

/// For each axis of the image the closest world axis, and whether they have opposite directions. Each world axis is
/// assigned to one axis of the image.
struct Directions {
    std::array<int, 3> world{0, 1, 2};
    std::array<bool, 3> reversed{false, false, false};
};
Directions directions_of(const ImageGeometry& geometry) {
    Directions best;
    double maximum = -1;
    std::array<int, 3> order{0, 1, 2};
    do {
        double sum = 0;
        for (int a = 0; a < 3; ++a) sum += std::abs(geometry.direction[order[a]][a]);
        if (sum <= maximum + 1e-9) continue;
        maximum = sum;
        best.world = order;
    } while (std::next_permutation(order.begin(), order.end()));
    for (int a = 0; a < 3; ++a) best.reversed[a] = geometry.direction[best.world[a]][a] < 0;
    return best;
}

/// The range of indices of a world box along an axis of the image.
std::array<double, 2> range_of(const WorldBox& box, int axis, const ImageGeometry& geometry) {
    double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
    for (const Vec3& corner : corners(box)) {
        const double at = geometry.world_to_index(corner)[axis];
        low = std::min(low, at);
        high = std::max(high, at);
    }
    return {low, high};
}

/// A range of indices limited to the image.
std::array<double, 2> inside(const std::array<double, 2>& range, int axis, const ImageGeometry& geometry) {
    const double last = geometry.size[axis] - 1.0;
    return {std::clamp(range[0], 0.0, last), std::clamp(range[1], 0.0, last)};
}

std::array<double, 2> range_of(const std::vector<WorldBox>& boxes, int axis, const ImageGeometry& geometry) {
    std::array<double, 2> all{std::numeric_limits<double>::max(), std::numeric_limits<double>::lowest()};
    for (const WorldBox& box : boxes) {
        const auto range = range_of(box, axis, geometry);
        all = {std::min(all[0], range[0]), std::max(all[1], range[1])};
    }
    return all;
}

}  // namespace

Region region_around(const std::vector<WorldBox>& boxes, const ImageGeometry& geometry, double margin) {
    Region region;
    double longest = 0;
    std::array<std::array<double, 2>, 3> ranges{};
    for (int a = 0; a < 3; ++a) {
        ranges[a] = range_of(boxes, a, geometry);
        longest = std::max(longest, (ranges[a][1] - ranges[a][0]) * geometry.spacing[a]);
    }
    for (int a = 0; a < 3; ++a) {
        const double wider = margin * longest / geometry.spacing[a] + 0.5;
        // The region extends beyond the image only if a structure does.
        const double beyond = 0.25 * wider, little = 0.01 * (ranges[a][1] - ranges[a][0]);
        const double first = -0.5, last = geometry.size[a] - 0.5;
        const double low = ranges[a][0] < first - little ? ranges[a][0] - beyond : first;
        const double high = ranges[a][1] > last + little ? ranges[a][1] + beyond : last;
        region.min[a] = std::max(low, ranges[a][0] - wider);
        region.max[a] = std::min(high, ranges[a][1] + wider);
    }
    return region;
}

Plane plane_across(int axis, double index, const RenderScene& scene) {
    if (!scene.is_anatomical) {
        constexpr std::array<std::array<int, 2>, 3> kLaid{{{2, 1}, {0, 2}, {0, 1}}};
        return {axis, index, kLaid[axis][0], kLaid[axis][1], false, false};
    }
    // As in radiology: the right side of the picture is the patient's left, in sagittal planes the patient's back; the
    // lower side is towards the feet, in axial planes towards the back.
    const Directions directions = directions_of(scene.image->geometry());
    const int normal = directions.world[axis], right = normal == 0 ? 1 : 0, down = normal == 2 ? 1 : 2;
    Plane plane{axis, index, 0, 0, false, false};
    for (int a = 0; a < 3; ++a) {
        if (directions.world[a] == right) {
            plane.across = a;
            plane.mirror_across = directions.reversed[a];
        }
        if (directions.world[a] == down) {
            plane.down = a;
            plane.mirror_down = directions.reversed[a] != (down == 2);
        }
    }
    return plane;
}

MarkedSlices find_marked_slices(const std::vector<Vec3>& marks, const ImageGeometry& geometry) {
    constexpr double kNear = 0.1;      // [slices] maximum distance of a mark from the slice on which it was set
    constexpr double kOnSlices = 0.9;  // minimum fraction of the marks that lie on slices
    MarkedSlices found;
    // An axis is chosen only if the marked slices are fewer than this fraction of the slices from the first to the last
    // marked one.
    double sparsest = 0.6;
    for (const int a : {2, 1, 0}) {
        std::set<int> slices;
        std::size_t on = 0;
        for (const Vec3& mark : marks) {
            const double at = geometry.world_to_index(mark)[a];
            if (std::abs(at - std::round(at)) > kNear || at < -0.5 || at > geometry.size[a] - 0.5) continue;
            slices.insert(int(std::lround(at)));
            ++on;
        }
        if (slices.empty() || double(on) < kOnSlices * double(marks.size()) || 2 * slices.size() > marks.size())
            continue;
        const double fraction = double(slices.size()) / (*slices.rbegin() - *slices.begin() + 1.0);
        if (fraction >= sparsest && slices.size() > 1) continue;
        sparsest = fraction;
        found = {a, {slices.begin(), slices.end()}};
    }
    return found;
}

std::vector<int> spread_slices(int axis, int count, const std::vector<WorldBox>& boxes, const MarkedSlices& marked,
                               const ImageGeometry& geometry) {
    const auto range = inside(range_of(boxes, axis, geometry), axis, geometry);
    const double gap = (range[1] - range[0]) / (count + 1);
    std::vector<int> result;
    for (int n = 0; n < count; ++n) {
        const double wanted = range[0] + (n + 1) * gap;
        int chosen = int(std::lround(wanted));
        double nearest = 0.5 * gap;
        for (const int slice : marked.axis == axis ? marked.slices : std::vector<int>{})
            if (std::abs(slice - wanted) <= nearest && std::find(result.begin(), result.end(), slice) == result.end()) {
                nearest = std::abs(slice - wanted);
                chosen = slice;
            }
        result.push_back(std::clamp(chosen, 0, geometry.size[axis] - 1));
    }
    return result;
}

int middle_slice(int axis, const std::vector<WorldBox>& boxes, const MarkedSlices& marked,
                 const ImageGeometry& geometry) {
    const auto all = inside(range_of(boxes, axis, geometry), axis, geometry);
    const double middle = 0.5 * (all[0] + all[1]);
    std::vector<int> candidates;
    if (marked.axis == axis)
        for (const int slice : marked.slices)
            if (slice >= all[0] && slice <= all[1]) candidates.push_back(slice);
    if (candidates.empty())
        for (int n = int(std::ceil(all[0])); n <= int(std::floor(all[1])); ++n) candidates.push_back(n);
    int best = int(std::lround(middle)), maximum = -1;
    double nearest = 0;
    for (const int slice : candidates) {
        int cut = 0;
        for (const WorldBox& box : boxes) {
            const auto range = inside(range_of(box, axis, geometry), axis, geometry);
            // Near the end of a structure's box, a slice cuts only its tip and is not counted as cutting the structure.
            const double tip = 0.15 * (range[1] - range[0]);
            cut += slice >= range[0] + tip && slice <= range[1] - tip ? 1 : 0;
        }
        const double away = std::abs(slice - middle);
        if (cut < maximum || (cut == maximum && away >= nearest)) continue;
        best = slice;
        maximum = cut;
        nearest = away;
    }
    return std::clamp(best, 0, geometry.size[axis] - 1);
}

std::array<double, 2> place_on(const Rect& at, const Plane& plane, const Region& region, double pixel,
                               const Vec3& index, const ImageGeometry& geometry) {
    const int a = plane.across, b = plane.down;
    const double u = plane.mirror_across ? region.max[a] - index[a] : index[a] - region.min[a];
    const double v = plane.mirror_down ? region.max[b] - index[b] : index[b] - region.min[b];
    return {at.x + u * geometry.spacing[a] / pixel, at.y + v * geometry.spacing[b] / pixel};
}

std::array<std::string, 2> letters_of(int axis, const ImageGeometry& geometry) {
    const Directions directions = directions_of(geometry);
    constexpr std::array<std::array<const char*, 2>, 3> kLetters{{{"L", "R"}, {"P", "A"}, {"S", "I"}}};
    const auto& pair = kLetters[directions.world[axis]];
    if (directions.reversed[axis]) return {pair[1], pair[0]};
    return {pair[0], pair[1]};
}

std::string name_of(const Plane& plane, const RenderScene& scene) {
    const ImageGeometry& geometry = scene.image->geometry();
    const Directions directions = directions_of(geometry);
    const int world = directions.world[plane.axis];
    std::string name;
    if (scene.is_anatomical)
        name = std::array<const char*, 3>{"sagittal", "coronal", "axial"}[world] + std::string(" ");
    if (plane.axis == 2 || scene.is_anatomical) name += "slice " + short_number(plane.index) + ", ";
    if (!geometry.is_axis_aligned() && std::abs(geometry.direction[world][plane.axis]) < 1 - 1e-6) {
        constexpr const char* kIndices = "ijk";
        return name + kIndices[plane.axis] + " = " + short_number(plane.index);
    }
    Vec3 index{0, 0, 0};
    index[plane.axis] = plane.index;
    constexpr const char* kAxes = "xyz";
    return name + kAxes[world] + " = " +
           (scene.unit.empty() ? short_number(geometry.index_to_world(index)[world])
                               : length_text(geometry.index_to_world(index)[world], scene.unit));
}

}  // namespace covol::figure
