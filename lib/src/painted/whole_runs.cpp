#include "painted/whole_runs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/heuristics.h"
#include "painted/heuristics.h"

namespace covol::painted {
namespace {

/// The first or last slice of a piece of paint.
struct End {
    double fraction = 0;  ///< area of the end slice's section, divided by that of the piece's largest section
    bool blunt = false;   ///< larger section than that of an ellipsoid that ends before the next slice
};

/// @param areas      of the slices, beginning with the end slice
/// @param elongated  whether the sections are elongated, as if a tube were cut along its axis: the area of such
/// sections decreases in proportion to their width, that of round ones in proportion to the square of their width
End end_of(const std::vector<std::size_t>& areas, bool elongated) {
    const auto largest = double(*std::max_element(areas.begin(), areas.end()));
    // The ellipsoid's middle is assumed at the first slice that is about as large as the largest, and its pole at most
    // one slice beyond the end slice: a section w slices from the middle has 1 - (w / (w + 1))^2 of the largest area.
    double w = 0;
    for (const std::size_t area : areas) {
        if (double(area) >= (1 - kCommon.minority) * largest) break;
        ++w;
    }
    const double fraction = double(areas.front()) / largest, of_round = (2 * w + 1) / ((w + 1) * (w + 1));
    return {fraction, w == 0 || fraction > (elongated ? std::sqrt(of_round) : of_round)};
}

/// The mean, over the piece's ends along the axis, of the ratio of the end section to the largest one; 0 if no end is
/// blunt, 1 if both lie at the image's ends.
double blunt_ends(const Paint& piece, int axis) {
    const AxisPaint slice_paint = properties_across(piece, axis);
    // A piece of at most the width of a stroke, in its slices or across them, is a stroke or a wall of strokes on
    // neighbouring slices, and has no blunt end.
    if (slice_paint.widest <= kOutline.widest_stroke || int(slice_paint.voxels.size()) <= kOutline.widest_stroke)
        return 0;
    const auto largest = *std::max_element(slice_paint.voxels.begin(), slice_paint.voxels.end());
    // The area of a disc is 1.3 to 1.8 times widest^2, because the width of a patch is that of its largest inscribed
    // square.
    const bool elongated = double(largest) > kCommon.clear_ratio * slice_paint.widest * slice_paint.widest;
    std::vector<End> ends;
    if (piece.box().min[axis] > 0) ends.push_back(end_of(slice_paint.voxels, elongated));
    if (piece.box().max[axis] < piece.image_size()[axis] - 1)
        ends.push_back(end_of({slice_paint.voxels.rbegin(), slice_paint.voxels.rend()}, elongated));
    if (ends.empty()) return 1;
    double sum = 0;
    for (const End& end : ends) sum += end.fraction;
    const bool any = std::any_of(ends.begin(), ends.end(), [](const End& end) { return end.blunt; });
    return any ? sum / double(ends.size()) : 0;
}

/// Whether the sides of a box have the same length in world units, up to the longest edge of a voxel.
bool is_cube(const VoxelBox& box, const Vec3& spacing) {
    const Index3 n = box.size();
    const std::array<double, 3> side{n[0] * spacing[0], n[1] * spacing[1], n[2] * spacing[2]};
    return *std::max_element(side.begin(), side.end()) - *std::min_element(side.begin(), side.end()) <=
           *std::max_element(spacing.begin(), spacing.end());
}

}  // namespace

std::optional<int> find_whole_runs(const Paint& paint, const ImageGeometry& geometry) {
    std::array<double, 3> wide{0, 0, 0}, blunt{0, 0, 0};  // by axis: mean of blunt_ends(); voxels of blunt pieces
    for (const Paint& piece : paint.pieces())
        for (int a = 0; a < 3; ++a) {
            const double ends = blunt_ends(piece, a);
            wide[a] += ends * double(piece.voxels) / double(paint.voxels);
            if (ends > 0) blunt[a] += double(piece.voxels);
        }
    for (int a = 0; a < 3; ++a)
        if (2 * blunt[a] <= double(paint.voxels)) wide[a] = 0;
    const double widest = *std::max_element(wide.begin(), wide.end());
    if (widest == 0) return {};
    const auto is_widest = [&](int a) { return wide[a] >= (1 - kCommon.negligible) * widest; };
    const int count = is_widest(0) + is_widest(1) + is_widest(2);
    if (count > 1 && is_cube(paint.box(), geometry.spacing)) return {};
    for (const int a : {2, 1, 0})
        if (is_widest(a)) return a;
    return {};
}

}  // namespace covol::painted
