#include "covol/contours.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/heuristics.h"
#include "base/number.h"
#include "contours/contour_curve.h"
#include "contours/contour_solid.h"
#include "contours/heuristics.h"
#include "contours/sections.h"
#include "covol/domain.h"
#include "covol/error.h"

namespace covol {
namespace {

using detail::Polygon;
using detail::SliceFrame;
using detail::SolidSlice;
using detail::Vec2;

constexpr std::size_t kMaxNodes = 64u << 20;  // nodes of all slices' grids, 256 MB; larger cells if more are needed

constexpr int kMarginCells = 2;  // around the contours of a slice; sample_slice() extrapolates beyond the grid
constexpr const char* kAxisNames[3] = {"x", "y", "z"};

/// Distance, in cells, from the image's end to the end of a body that is continued beyond it. No result depends on this
/// end, because it lies farther outside the domain than the half width of the narrow band.
double end_cells() { return kBeyondVoxels + kHalfWidthVoxels + 1; }

struct Line {
    std::vector<Vec3> index;  ///< marks in voxels of the image, or of the contours' own frame
    std::vector<Vec3> world;
    bool closed = true;
    std::string name;  ///< for messages: file, and the line's own name
    std::array<bool, 3> constant{false, false, false};
};

/// The marks without successive duplicates.
std::vector<Vec3> without_repeats(const std::vector<Vec3>& marks, bool closed) {
    std::vector<Vec3> kept;
    for (const Vec3& mark : marks)
        if (kept.empty() || mark != kept.back()) kept.push_back(mark);
    while (closed && kept.size() > 1 && kept.front() == kept.back()) kept.pop_back();
    return kept;
}

/// Densifies the contours of one structure.
class Densifier {
public:
    Densifier(const ImageGeometry* geometry, const ContourOptions& options, const RunContext& run)
        : geometry_(geometry != nullptr ? *geometry : ImageGeometry{}),
          has_image_(geometry != nullptr),
          along_image_(geometry != nullptr),
          options_(options),
          run_(run) {}

    Contours go(const std::vector<PointCloud>& clouds) {
        for (const PointCloud& cloud : clouds) read(cloud);
        if (clouds.empty()) throw Error(Errc::InvalidInput, "contours: expected at least one file, got none");
        if (lines_.empty())
            throw Error(Errc::InvalidInput,
                        clouds.front().source +
                            ": expected lines of marks (slice, contour, x, y; shapes; selections), got separate "
                            "points; give them as points instead of contours");
        choose_plane();
        if (lies_in_slices() || choose_tilted_plane()) {
            join_lines();
            make_solid();
        } else {
            make_network();
        }
        summarise();
        return std::move(result_);
    }

private:
    void read(const PointCloud& cloud);
    void check_inside(const Line& line) const;
    /// Maximum deviation of marks from a common slice, relative to `spacing` with an image and to `length` without one.
    [[nodiscard]] double same_slice(double spacing, double length) const {
        return has_image_ ? kCommon.precision_voxels * spacing : kCommon.same_place * length;
    }
    void find_planes(Line& line) const;
    void choose_plane();
    [[nodiscard]] bool lies_in_slices() const;
    [[nodiscard]] bool choose_tilted_plane();
    [[nodiscard]] std::vector<Vec3> curve_through(const Line& line, const std::vector<Vec3>& marks) const;
    void make_network();
    void join_lines();
    [[nodiscard]] std::vector<Vec3> carried_beyond_sides(std::vector<Vec3> curve) const;
    void make_solid();
    void drop_repeated_loops();
    void fill_slices(ContourSolid::Data& data, const std::vector<std::vector<Polygon>>& polygons);
    void link_slices(ContourSolid::Data& data, const std::vector<std::vector<Polygon>>& polygons);
    void cap_ends(ContourSolid::Data& data);
    void summarise();

    ImageGeometry geometry_;
    bool has_image_;
    bool along_image_;        // whether the frame's axes are the image's
    bool has_loose_ = false;  // whether there are marks that belong to no line
    ContourOptions options_;
    const RunContext& run_;
    std::vector<Line> lines_;
    SliceFrame frame_;
    std::vector<std::pair<double, Polygon>> loops_;  ///< closed contours in the main plane, with their slice's w
    Contours result_;
};

void Densifier::read(const PointCloud& cloud) {
    const std::vector<Vec3> world = has_image_ ? to_world(cloud, geometry_) : to_world(cloud);
    result_.marks.insert(result_.marks.end(), world.begin(), world.end());
    std::vector<char> in_line(world.size(), 0);
    for (std::size_t n = 0; n < cloud.lines.size(); ++n) {
        const MarkLine& from = cloud.lines[n];
        if (from.begin >= from.end || from.end > world.size()) continue;
        Line line;
        for (std::size_t p = from.begin; p < from.end; ++p) {
            line.index.push_back(geometry_.world_to_index(world[p]));
            in_line[p] = 1;
        }
        line.name = cloud.source + ": contour " + (from.name.empty() ? std::to_string(n + 1) : "'" + from.name + "'");
        line.index = without_repeats(line.index, from.closed);
        for (const Vec3& p : line.index) line.world.push_back(geometry_.index_to_world(p));
        line.closed = from.closed && line.index.size() >= 3;
        if (has_image_) check_inside(line);
        find_planes(line);
        lines_.push_back(std::move(line));
    }
    for (std::size_t p = 0; p < world.size(); ++p)
        if (!in_line[p]) {
            result_.along.push_back(world[p]);
            has_loose_ = true;
        }
}

void Densifier::check_inside(const Line& line) const {
    std::size_t outside = 0;
    const Vec3* first = nullptr;
    for (const Vec3& p : line.index)
        for (int a = 0; a < 3; ++a)
            if (p[a] < -0.5 - kCommon.precision_voxels || p[a] > geometry_.size[a] - 0.5 + kCommon.precision_voxels) {
                ++outside;
                if (first == nullptr) first = &p;
                break;
            }
    if (outside == 0) return;
    std::ostringstream text;
    text << line.name << ": " << outside << " of " << line.index.size()
         << " marks lie outside the image, the first at voxel (" << (*first)[0] << ", " << (*first)[1] << ", "
         << (*first)[2] << ") of " << geometry_.size[0] << " x " << geometry_.size[1] << " x " << geometry_.size[2]
         << "; check `points_space`, `points_order` and `spacing`";
    throw Error(Errc::InvalidInput, text.str(), "points_space");
}

void Densifier::find_planes(Line& line) const {
    Vec3 low = line.index.front(), high = low;
    for (const Vec3& p : line.index)
        for (int a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], p[a]);
            high[a] = std::max(high[a], p[a]);
        }
    const double tolerance = same_slice(1, std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}));
    for (int a = 0; a < 3; ++a) line.constant[a] = high[a] - low[a] <= tolerance;
    if (line.constant != std::array<bool, 3>{false, false, false} || line.index.size() < 3) return;
    const double off = detail::thickness_along(line.world, detail::plane_through(line.world).normal);
    if (off > tolerance * geometry_.smallest_spacing()) {
        std::ostringstream text;
        text << line.name << ": expected marks in one plane of any orientation, got marks that span " << off
             << " across their best-fitting plane";
        throw Error(Errc::InvalidInput, text.str());
    }
}

/// Whether each closed line lies in a plane perpendicular to an axis: with an image, to any of its axes; without an
/// image, to the axis of choose_plane().
bool Densifier::lies_in_slices() const {
    return std::all_of(lines_.begin(), lines_.end(), [&](const Line& line) {
        return !line.closed ||
               (has_image_ ? line.constant != std::array<bool, 3>{false, false, false} : line.constant[frame_.axis()]);
    });
}

/// Chooses the frame of parallel planes that are tilted against the image. The ends of the image are not parallel to
/// them, so bodies are not continued beyond the image. @returns whether all closed lines lie in such planes
bool Densifier::choose_tilted_plane() {
    const Line* longest = nullptr;
    for (const Line& line : lines_)
        if (line.closed && (longest == nullptr || line.index.size() > longest->index.size())) longest = &line;
    const detail::SectionPlane plane = detail::plane_through(longest->world);
    const double spacing = geometry_.smallest_spacing();
    const auto is_across = [&](const Line& line) {
        return detail::thickness_along(line.world, plane.normal) <= same_slice(spacing, detail::extent_of(line.world));
    };
    if (!std::all_of(lines_.begin(), lines_.end(), [&](const Line& line) { return !line.closed || is_across(line); }))
        return false;
    ImageGeometry tilted = geometry_;
    tilted.origin = plane.origin;
    tilted.spacing = {spacing, spacing, spacing};
    for (int a = 0; a < 3; ++a) tilted.direction[a] = {plane.u[a], plane.v[a], plane.normal[a]};
    for (Line& line : lines_) {
        line.constant = {false, false, is_across(line)};
        for (std::size_t n = 0; n < line.index.size(); ++n) line.index[n] = tilted.world_to_index(line.world[n]);
    }
    geometry_ = tilted;
    along_image_ = false;
    frame_ = SliceFrame(geometry_, 2);
    return true;
}

/// Chooses the axis whose slices contain the largest number of marks on lines; marks of closed lines count twice.
void Densifier::choose_plane() {
    std::array<std::size_t, 3> votes{0, 0, 0};
    for (const Line& line : lines_) {
        if (std::count(line.constant.begin(), line.constant.end(), true) != 1) continue;  // oblique, or along an axis
        for (int a = 0; a < 3; ++a)
            if (line.constant[a]) votes[a] += line.index.size() * (line.closed ? 2 : 1);
    }
    // The slices of a stack are perpendicular to k, which is preferred in a tie.
    int best = 2;
    for (const int a : {1, 0})
        if (votes[a] > votes[best]) best = a;
    frame_ = SliceFrame(geometry_, best);
}

/// If a contour follows a side of the image, within the last row of voxels, the structure is cut off by the image
/// there, and the contour is continued beyond that side.
std::vector<Vec3> Densifier::carried_beyond_sides(std::vector<Vec3> curve) const {
    for (int side = 0; side < 4; ++side) {
        const int a = side / 2, axis = a == 0 ? frame_.x_axis() : frame_.y_axis();
        const double spacing = geometry_.spacing[axis], out = side % 2 == 0 ? -1.0 : 1.0;
        const double face = (side % 2 == 0 ? -0.5 : geometry_.size[axis] - 0.5) * spacing;
        const auto at_side = [&](const Vec3& p) { return (face - p[a]) * out <= spacing; };
        // Begin with a mark that is not at this side, so that no run is split.
        const auto first = std::find_if_not(curve.begin(), curve.end(), at_side);
        if (first == curve.end()) return curve;
        std::rotate(curve.begin(), first, curve.end());
        std::vector<Vec3> carried;
        for (std::size_t n = 0; n < curve.size(); ++n) {
            if (!at_side(curve[n])) {
                carried.push_back(curve[n]);
                continue;
            }
            std::size_t end = n;
            while (end + 1 < curve.size() && at_side(curve[end + 1])) ++end;
            carried.push_back(curve[n]);
            if (end > n) {
                for (std::size_t m = n; m <= end; ++m) {
                    carried.push_back(curve[m]);
                    carried.back()[a] = face + out * end_cells() * options_.step;
                }
                carried.push_back(curve[end]);
            }
            n = end;
        }
        curve = std::move(carried);
    }
    return curve;
}

std::vector<Vec3> Densifier::curve_through(const Line& line, const std::vector<Vec3>& marks) const {
    return options_.curve == ContourCurve::Spline ? detail::centripetal_curve(marks, line.closed, options_.step)
                                                  : marks;
}

/// For planes of several directions: computes points along all lines, and positions inside and outside the sections.
void Densifier::make_network() {
    std::vector<std::vector<Vec3>> open, closed;
    double length = 0;
    for (const Line& line : lines_) {
        std::vector<Vec3> curve = curve_through(line, line.world);
        length += detail::length_of(curve, line.closed);
        ++(line.closed ? result_.closed : result_.open);
        (line.closed ? closed : open).push_back(std::move(curve));
    }
    const double step = std::max(options_.step, length / kContours.network_marks);
    std::vector<detail::Section> sections =
        detail::sections_of(closed, same_slice(geometry_.smallest_spacing(), detail::extent_of(result_.marks)));
    detail::SectionMarks marks = detail::marks_along(sections, step);
    result_.along.insert(result_.along.end(), marks.places.begin(), marks.places.end());
    if (open.empty() && !has_loose_) result_.outward = std::move(marks.outward);
    for (const std::vector<Vec3>& curve : open) {
        const std::vector<Vec3> evenly = detail::evenly_along(curve, false, step);
        result_.along.insert(result_.along.end(), evenly.begin(), evenly.end());
    }
    detail::Sides sides = detail::sides_of(sections, options_.step);
    result_.inside = std::move(sides.inside);
    result_.outside = std::move(sides.outside);
    result_.slices = sections.size();
    result_.is_network = true;
    if (open.empty() && !has_loose_) result_.sections = std::make_shared<Sections>(Sections{std::move(sections)});
}

void Densifier::join_lines() {
    for (const Line& line : lines_) {
        std::vector<Vec3> marks;
        for (const Vec3& p : line.index) marks.push_back(frame_.from_index(p));
        std::vector<Vec3> curve = curve_through(line, marks);
        if (along_image_ && line.closed && line.constant[frame_.axis()]) curve = carried_beyond_sides(curve);
        for (const Vec3& p : detail::subdivide(curve, line.closed, options_.step))
            result_.along.push_back(frame_.to_world(p));
        ++(line.closed ? result_.closed : result_.open);
        if (!line.closed || !line.constant[frame_.axis()]) continue;
        Polygon polygon;
        for (const Vec3& p : curve) polygon.push_back({p[0], p[1]});
        loops_.emplace_back(marks.front()[2], std::move(polygon));
    }
}

/// Removes repeated contours, because by the even-odd rule two copies would cancel.
void Densifier::drop_repeated_loops() {
    std::sort(loops_.begin(), loops_.end());
    const auto last = std::unique(loops_.begin(), loops_.end());
    const auto repeated = loops_.end() - last;
    loops_.erase(last, loops_.end());
    if (repeated > 0)
        run_.warn("contours: " + std::to_string(repeated) + (repeated > 1 ? " contours repeat" : " contour repeats") +
                  " the marks of another one; each is used once");
}

void Densifier::make_solid() {
    if (loops_.empty()) return;
    drop_repeated_loops();
    auto data = std::make_shared<ContourSolid::Data>();
    data->frame = frame_;
    std::vector<std::vector<Polygon>> polygons;
    const double same = same_slice(geometry_.spacing[frame_.axis()], options_.step);
    for (auto& [w, polygon] : loops_) {
        if (data->slices.empty() || w - data->slices.back().w > same) {
            data->slices.emplace_back();
            data->slices.back().w = w;
            polygons.emplace_back();
        }
        polygons.back().push_back(std::move(polygon));
    }
    fill_slices(*data, polygons);
    // Slices whose contours enclose no node of the grid are removed: the body would end there in spite of the contour.
    for (std::size_t n = data->slices.size(); n-- > 0;)
        if (data->slices[n].depth == 0) {
            data->slices.erase(data->slices.begin() + std::ptrdiff_t(n));
            polygons.erase(polygons.begin() + std::ptrdiff_t(n));
        }
    if (data->slices.empty()) return;
    link_slices(*data, polygons);
    cap_ends(*data);
    result_.slices = data->slices.size();
    result_.solid = std::make_shared<ContourSolid>(data);
    result_.between = result_.solid->surface_points(options_.step, run_);
}

void Densifier::fill_slices(ContourSolid::Data& data, const std::vector<std::vector<Polygon>>& polygons) {
    Vec2 low = polygons[0][0][0], high = low;
    for (const auto& slice : polygons)
        for (const Polygon& polygon : slice)
            for (const Vec2& p : polygon)
                for (int a = 0; a < 2; ++a) {
                    low[a] = std::min(low[a], p[a]);
                    high[a] = std::max(high[a], p[a]);
                }
    const double nodes =
        (high[0] - low[0]) * (high[1] - low[1]) / (options_.step * options_.step) * double(polygons.size());
    const double cell = options_.step * std::max(1.0, std::sqrt(nodes / double(kMaxNodes)));
    if (cell > options_.step)
        run_.info("contours: slices are filled on a grid with cells of " + detail::number(cell) +
                  ", coarser than the voxels, to limit memory");
    data.grid.cell = cell;
    data.grid.origin = {low[0] - kMarginCells * cell, low[1] - kMarginCells * cell};
    data.grid.nx = int((high[0] - low[0]) / cell + 2 * kMarginCells) + 2;
    data.grid.ny = int((high[1] - low[1]) / cell + 2 * kMarginCells) + 2;
    run_.check();
    tbb::parallel_for(std::size_t(0), data.slices.size(), [&](std::size_t n) {
        SolidSlice& slice = data.slices[n];
        slice.level = detail::signed_distance_of_polygons(polygons[n], data.grid);
        slice.polygons = polygons[n].size();
        std::size_t inside = 0;
        for (const float v : slice.level) {
            inside += v < 0;
            slice.depth = std::max(slice.depth, double(-v));
        }
        slice.area = double(inside) * cell * cell;
    });
    run_.check();
}

/// Joins neighbouring sections that do not overlap by a translation if each is one contour; others end between slices.
void Densifier::link_slices(ContourSolid::Data& data, const std::vector<std::vector<Polygon>>& polygons) {
    std::vector<char> apart(data.slices.size(), 0);
    tbb::parallel_for(std::size_t(0), data.slices.size() - 1, [&](std::size_t n) {
        const auto &a = data.slices[n].level, &b = data.slices[n + 1].level;
        apart[n] = 1;
        for (std::size_t node = 0; node < a.size() && apart[n]; ++node) apart[n] = !(a[node] < 0 && b[node] < 0);
    });
    std::size_t carried = 0, ended = 0;
    for (std::size_t n = 0; n + 1 < data.slices.size(); ++n) {
        data.slices[n].apart = apart[n] != 0;
        if (!apart[n]) continue;
        if (polygons[n].size() != 1 || polygons[n + 1].size() != 1) {
            ++ended;
            continue;
        }
        const Vec2 here = detail::moments(polygons[n][0]).centroid,
                   there = detail::moments(polygons[n + 1][0]).centroid;
        data.slices[n].shift = {there[0] - here[0], there[1] - here[1]};
        ++carried;
    }
    if (carried > 0)
        run_.warn("contours: " + std::to_string(carried) + (carried > 1 ? " pairs" : " pair") +
                  " of neighbouring slices with contours that do not overlap: they are joined along the line between "
                  "their centroids; mark more slices there if that is wrong");
    if (ended > 0)
        run_.warn("contours: " + std::to_string(ended) + (ended > 1 ? " pairs" : " pair") +
                  " of neighbouring slices with several contours and no overlap: the parts end between them; mark more "
                  "slices there if that is wrong");
}

void Densifier::cap_ends(ContourSolid::Data& data) {
    auto& slices = data.slices;
    std::vector<double> distances;
    for (std::size_t n = 0; n + 1 < slices.size(); ++n) distances.push_back(slices[n + 1].w - slices[n].w);
    double gap = geometry_.spacing[frame_.axis()];
    if (!distances.empty()) {
        std::nth_element(distances.begin(), distances.begin() + std::ptrdiff_t(distances.size() / 2), distances.end());
        gap = distances[distances.size() / 2];
    }
    result_.slice_distance = gap;
    const double spacing = geometry_.spacing[frame_.axis()];
    const auto cap = [&](std::size_t end, std::size_t before) {
        const bool alone = end == before, first = end < before;
        const double distance = std::abs(slices[end].w - slices[before].w);
        slices[end].cap =
            std::max(compute_cap_height(slices[end].area, alone ? 0 : slices[before].area, distance, gap), 1e-3 * gap);
        if (!along_image_ || alone) return;
        // The end is open on the image's last slice, or if the next marked slice would lie beyond the image and the
        // sections, extrapolated, do not end before the image does.
        const double left =
            first ? slices[end].w + 0.5 * spacing : (geometry_.size[frame_.axis()] - 0.5) * spacing - slices[end].w;
        const double shrinks_by = slices[before].area - slices[end].area;
        const double ends_after = shrinks_by > 0 ? distance * slices[end].area / shrinks_by : 2 * gap;
        slices[end].open = left < spacing || (left <= gap && left < ends_after);
        if (!slices[end].open) return;
        slices[end].cap = left + kBeyondVoxels * options_.step;
        slices[end].end = left + end_cells() * options_.step;
    };
    if (slices.size() == 1) {
        cap(0, 0);
        if (options_.thickness > 0) slices[0].cap = 0.5 * options_.thickness;
        const bool only_plane =
            std::all_of(lines_.begin(), lines_.end(), [&](const Line& l) { return l.constant[frame_.axis()]; });
        const bool one_slice = along_image_ && geometry_.size[frame_.axis()] == 1;
        result_.flat = !(options_.thickness > 0) && only_plane && !one_slice && !has_loose_;
        return;
    }
    cap(0, 1);
    cap(slices.size() - 1, slices.size() - 2);
}

void Densifier::summarise() {
    std::ostringstream text;
    text << result_.marks.size() << " marks on " << result_.closed << " closed and " << result_.open
         << " open contours";
    if (result_.solid)
        text << ", " << result_.slices << " slices across "
             << (along_image_ || !has_image_ ? kAxisNames[frame_.axis()] : "an axis fitted to them") << ", "
             << result_.slice_distance << " apart";
    if (result_.is_network)
        text << " in " << result_.slices << " planes of several orientations, which determine " << result_.inside.size()
             << " positions inside and " << result_.outside.size() << " outside";
    text << ": " << result_.along.size() << " points along them, " << result_.between.size() << " between";
    result_.summary = text.str();
}

}  // namespace

namespace {

Contours densify_in(const ImageGeometry* geometry, const std::vector<PointCloud>& clouds, const ContourOptions& options,
                    const RunContext& run) {
    require_valid(options, "densify");
    Contours result;
    with_threads(run, [&] { result = Densifier(geometry, options, run).go(clouds); });
    return result;
}

}  // namespace

Contours densify(const std::vector<PointCloud>& clouds, const ImageGeometry& geometry, const ContourOptions& options,
                 const RunContext& run) {
    return densify_in(&geometry, clouds, options, run);
}

Contours densify(const std::vector<PointCloud>& clouds, const ContourOptions& options, const RunContext& run) {
    return densify_in(nullptr, clouds, options, run);
}

}  // namespace covol
