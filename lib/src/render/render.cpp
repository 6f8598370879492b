#include "covol/render.h"

#include <algorithm>
#include <cmath>

#include "base/geometry.h"
#include "base/number.h"
#include "base/text.h"
#include "covol/error.h"
#include "limits/memory_budget.h"
#include "render/draw/decorations.h"
#include "render/draw/layout.h"
#include "render/level_set.h"
#include "render/marks.h"
#include "render/slices.h"
#include "render/volume.h"

namespace covol {
namespace figure {
namespace {

constexpr double kLow = 0.005, kHigh = 0.998;  // intensity percentiles shown as black and white
constexpr double kRegionMargin = 0.08;         // around the structures on slices, fraction of their longest side
constexpr double kVolumeMargin = 0.15;
// Margins on each side of views without and with the image's volume, as fractions of the view.
constexpr double kViewMargin = 0.03, kVolumeView = 0.07;
// Opacity of structures around others, and of all structures if the image's volume is to be visible inside.
constexpr double kEnclosingOpacity = 0.35, kVolumeOpacity = 0.16;
constexpr double kVolumeDensity = 4.0;
constexpr double kBytesPerPixel = 90;  // memory for colours, depths and normals while a picture is made
constexpr int kPlanes = 3;
constexpr std::size_t kMaxBalls = 3000;

/// Size of the font for a picture of this size, pixels.
double text_size(int width, int height) { return std::max(9.0, 0.0185 * std::sqrt(double(width) * height)); }

class Drawing {
public:
    Drawing(const RenderScene& scene, const RenderOptions& options, const RunContext& run)
        : scene_(scene),
          options_(options),
          run_(run),
          theme_(theme(options.white_background)),
          canvas_(options.width, options.height, theme_.background),
          text_(text_size(options.width, options.height)),
          gap_(int(std::lround(0.5 * text_))) {
        if (scene.structures.empty()) throw Error(Errc::InvalidInput, "render: expected a structure, got none");
        if (scene.image == nullptr && options.figure == FigureKind::Slices)
            throw Error(Errc::InvalidInput, "render: slices: expected an image, got none");
        if (scene.image == nullptr && options.volume)
            throw Error(Errc::InvalidInput, "render: volume: expected an image, got none");
        for (const RenderStructure& structure : scene.structures) boxes_.push_back(surface_box(*structure.surface));
        for (const RenderStructure& structure : scene.structures) {
            all_marks_.insert(all_marks_.end(), structure.marks.begin(), structure.marks.end());
            bodies_.push_back({structure.surface, to_color(structure.color), opacity_of(bodies_.size())});
        }
        all_marks_.insert(all_marks_.end(), scene.marks.begin(), scene.marks.end());
        radius_ = mark_radius(text_, std::min(kMaxBalls, all_marks_.size()));
    }

    Picture go() {
        if (scene_.image != nullptr) find_planes();
        const int margin = int(std::lround(0.6 * text_));
        const Rect available{margin, margin, options_.width - 2 * margin, options_.height - 2 * margin};
        if (options_.figure == FigureKind::Slices)
            draw_slices_alone(available);
        else if (options_.figure == FigureKind::Surface || (scene_.image != nullptr && planes_.empty()))
            draw_view_alone(available);
        else if (scene_.image == nullptr)
            draw_views(available);
        else
            draw_composed(available);
        run_.check();
        return canvas_.picture();
    }

private:
    /// Structures that enclose others are translucent, so that these are visible. So are all structures if the image's
    /// volume is shown, unless their opacity is stated.
    [[nodiscard]] double opacity_of(std::size_t n) const {
        if (const auto& stated = scene_.structures[n].opacity) return *stated;
        if (options_.volume) return kVolumeOpacity;
        for (std::size_t m = 0; m < boxes_.size(); ++m) {
            if (m == n) continue;
            bool around = true;
            for (int a = 0; a < 3; ++a) {
                const double slack = 0.02 * (boxes_[n].max[a] - boxes_[n].min[a]);
                around = around && boxes_[n].min[a] <= boxes_[m].min[a] + slack &&
                         boxes_[n].max[a] >= boxes_[m].max[a] - slack;
            }
            if (around && longest_side(boxes_[n]) > longest_side(boxes_[m])) return kEnclosingOpacity;
        }
        return 1;
    }

    // ---- slices --------------------------------------------------------------------------------------------------

    void find_planes() {
        const ImageGeometry& geometry = scene_.image->geometry();
        region_ = region_around(boxes_, geometry, kRegionMargin);
        const MarkedSlices marked = find_marked_slices(all_marks_, geometry);
        if (options_.slices) {
            const int axis = options_.slice_axis.value_or(marked.axis >= 0 ? marked.axis : 2);
            for (const int slice : spread_slices(axis, *options_.slices, boxes_, marked, geometry))
                planes_.push_back(plane_across(axis, slice, scene_));
        } else {
            std::array<Plane, kPlanes> across;
            for (int a = 0; a < kPlanes; ++a) {
                int index = middle_slice(a, boxes_, marked, geometry);
                if (options_.at)
                    index = int(
                        std::lround(std::clamp(geometry.world_to_index(*options_.at)[a], 0.0, geometry.size[a] - 1.0)));
                across[a] = plane_across(a, index, scene_);
            }
            // In the first arrangement of ways(), the plane beside the first one should have the same vertical axis as
            // that one, and the plane below it the same horizontal axis.
            choose_first(across);
        }
        window_ = scene_.image->percentiles(kLow, kHigh);
    }

    void choose_first(const std::array<Plane, kPlanes>& across) {
        planes_ = {across[2], across[0], across[1]};
        for (const Plane& main : across) {
            const Plane &beside = across[main.across], &below = across[main.down];
            if (scene_.is_anatomical && beside.down == main.down && below.across == main.across)
                planes_ = {main, beside, below};
        }
    }

    /// Puts the planes into the order of the parts in ways(). In the first arrangement the second plane is beside the
    /// first one and has the same vertical axis; in the others its axes are exchanged, unless they are anatomical. With
    /// the option `slices`, the planes are numbered row by row, but the parts column by column.
    void arrange(int way) {
        if (options_.slices) {
            std::vector<Plane> ordered;
            const std::size_t columns = ways()[way].columns.size();
            for (std::size_t c = 0; c < columns; ++c)
                for (std::size_t n = c; n < planes_.size(); n += columns) ordered.push_back(planes_[n]);
            planes_ = ordered;
        } else if (way == 0) {
            std::swap(planes_[1], planes_[2]);  // the first column contains the first and the third plane
        } else {
            planes_[1] = upright();
        }
    }

    [[nodiscard]] Plane upright() const {
        if (scene_.is_anatomical) return planes_[1];
        Plane turned = planes_[1];
        std::swap(turned.across, turned.down);
        std::swap(turned.mirror_across, turned.mirror_down);
        return turned;
    }

    [[nodiscard]] std::vector<Tiling> ways() const {
        const ImageGeometry& geometry = scene_.image->geometry();
        const auto cell = [&](const Plane& plane) {
            return Cell{region_.length(plane.across, geometry), region_.length(plane.down, geometry)};
        };
        const Cell first = cell(planes_[0]);
        if (options_.slices) return ways_for_equals(first.width, first.height, int(planes_.size()));
        std::vector<Tiling> all = ways_for_three({first, cell(upright()), cell(planes_[2])});
        all.front() = ways_for_three({first, cell(planes_[1]), cell(planes_[2])}).front();
        return all;
    }

    void draw_slices(const Tiling::Placed& placed) {
        SliceStyle style;
        style.pixel = placed.pixel;
        style.text = std::max(9.0, 0.85 * text_);
        style.window = window_;
        style.beyond = gray(options_.white_background ? 0.42 : 0.22);
        if (!options_.slices) style.others = planes_;
        style.mark_radius = std::max(1.2, 0.8 * radius_);
        for (std::size_t n = 0; n < planes_.size(); ++n)
            draw_slice(canvas_, placed.at[n], planes_[n], region_, scene_, style, run_);
        const Rect& first = placed.at.front();
        const double rim = std::max(1.0, 0.11 * style.text);
        draw_scale_bar(canvas_, first.right() - 0.7 * text_, first.bottom() - 0.7 * text_, first.width, placed.pixel,
                       scene_.unit, {gray(1), style.text, rim});
    }

    void draw_slices_alone(const Rect& available) {
        if (planes_.empty()) throw Error(Errc::InvalidOptions, "render: slices: expected > 0, got 0");
        Rect rest = available;
        const auto entries = legend();
        const auto [width, height] = legend_size(entries, text_);
        Split found = fill(available, ways(), gap_);
        if (!place_legend_in_corner(found)) {
            rest.height -= int(height + 0.6 * text_);
            if (entries.empty()) rest = available;
            found = fill(rest, ways(), gap_);
            draw_legend(canvas_, found.parts.bounds.x, found.parts.bounds.bottom() + 0.6 * text_, entries, text_,
                        theme_.ink);
        }
        arrange(found.way);
        draw_slices(found.parts);
    }

    // ---- views ---------------------------------------------------------------------------------------------------

    [[nodiscard]] Extent extent(const Basis& basis) const {
        Extent all;
        if (options_.whole_turn) {
            const WorldBox box = around_all();
            Vec3 center;
            for (int a = 0; a < 3; ++a) center[a] = 0.5 * (box.min[a] + box.max[a]);
            for (const Body& body : bodies_) all.add(turning_extent(*body.surface, center, options_.view.elevation));
            const double at[3] = {dot(center, basis.right), dot(center, basis.up), dot(center, basis.to_eye)};
            for (int a = 0; a < 3; ++a) {
                all.min[a] += at[a];
                all.max[a] += at[a];
            }
            return all;
        }
        for (const Body& body : bodies_) all.add(surface_extent(*body.surface, basis));
        return all;
    }

    [[nodiscard]] WorldBox around_all() const {
        WorldBox all = boxes_.front();
        for (const WorldBox& box : boxes_)
            for (int a = 0; a < 3; ++a) {
                all.min[a] = std::min(all.min[a], box.min[a]);
                all.max[a] = std::max(all.max[a], box.max[a]);
            }
        return all;
    }

    void draw_surfaces(const Camera& camera) {
        if (options_.volume) {
            const Region region = region_around(boxes_, scene_.image->geometry(), kVolumeMargin);
            VoxelBox box = scene_.image->held();
            for (int a = 0; a < 3; ++a) {
                box.min[a] = std::clamp(int(std::floor(region.min[a] + 0.5)), box.min[a], box.max[a]);
                box.max[a] = std::clamp(int(std::ceil(region.max[a] - 0.5)), box.min[a], box.max[a]);
            }
            const Volume volume(*scene_.image, box, window_, run_);
            compose(cast_volume(volume, camera, kVolumeDensity, options_.white_background, run_), camera.at, canvas_);
        }
        const Layer layer = cast_surfaces(bodies_, camera, run_);
        compose(layer, camera.at, canvas_);
        std::vector<Ball> balls;
        const bool several = scene_.structures.size() > 1;
        double slack = 0;
        for (const RenderStructure& structure : scene_.structures) {
            slack = std::max(slack, 2 * structure.surface->voxelSize()[0]);
            const Color color = several ? mix(to_color(structure.color), gray(1), 0.35) : kLoneMark;
            add_balls(structure.marks, color, balls);
        }
        add_balls(scene_.marks, several ? kLooseMark : kLoneMark, balls);
        draw_balls(canvas_, balls, camera, layer, radius_, slack);
    }

    /// Adds only every n-th mark if there are very many, because they would hide the surface.
    void add_balls(const std::vector<Vec3>& marks, const Color& color, std::vector<Ball>& balls) const {
        const std::size_t stride = all_marks_.size() / kMaxBalls + 1;
        for (std::size_t n = 0; n < marks.size(); n += stride) balls.push_back({marks[n], color});
    }

    void draw_view(const Rect& at) {
        const Basis basis = view_basis(options_.view.azimuth, options_.view.elevation);
        Rect inside = at;
        inside.height = std::max(1, at.height - rim());
        const Camera camera =
            frame(basis, extent(basis), inside, options_.volume ? kVolumeView : kViewMargin, options_.zoom);
        draw_surfaces(camera);
        draw_scale_bar(canvas_, at.right() - 0.6 * text_, at.bottom() - 0.3 * text_, at.width, camera.pixel,
                       scene_.unit, {theme_.ink, text_, 0});
        const double length = 1.8 * text_;
        double left = 0, down = 0;
        for (int a = 0; a < 3; ++a) {
            left = std::max(left, -length * basis.right[a] + 0.95 * text_);
            down = std::max(down, -length * basis.up[a] + 0.95 * text_);
        }
        draw_axes(canvas_, at.x + std::max(left, 0.8 * text_), at.bottom() - std::max(down, 0.5 * text_), length, basis,
                  axis_names(), 0.9 * text_, theme_.ink);
    }

    [[nodiscard]] std::array<std::string, 3> axis_names() const {
        if (scene_.is_anatomical) return {"L", "P", "S"};
        return {"x", "y", "z"};
    }

    /// Height in pixels of the strip below a view for axes and the scale bar.
    [[nodiscard]] int rim() const { return int(std::lround(3.0 * text_)); }

    [[nodiscard]] double aspect() const {
        const Extent all = extent(view_basis(options_.view.azimuth, options_.view.elevation));
        return std::clamp(all.size(0) / std::max(1e-12, all.size(1)), 0.1, 10.0);
    }

    void draw_view_alone(const Rect& available) {
        draw_view(available);
        draw_legend(canvas_, available.x, available.y, legend(), text_, theme_.ink);
    }

    /// A large view, and the structures from the front, the right (the left if axes are anatomical) and above.
    void draw_views(const Rect& available) {
        std::array<const char*, kPlanes> names{"front", scene_.is_anatomical ? "left" : "right", "top"};
        std::array<Basis, kPlanes> bases;
        std::array<Extent, kPlanes> extents;
        std::array<Cell, kPlanes> sizes{};
        for (int n = 0; n < kPlanes; ++n) {
            const ViewDirection view = parse_view(names[n], scene_.is_anatomical);
            bases[n] = view_basis(view.azimuth, view.elevation);
            for (const Body& body : bodies_) extents[n].add(surface_extent(*body.surface, bases[n]));
            sizes[n] = {1.12 * extents[n].size(0), 1.12 * extents[n].size(1) + 0.06 * extents[n].size(0)};
        }
        const Split found = split(available, aspect(), rim(), ways_for_three(sizes), gap_);
        draw_view(found.view);
        draw_legend(canvas_, found.view.x, found.view.y, legend(), text_, theme_.ink);
        const double text = std::max(9.0, 0.85 * text_);
        if (found.way == 0) {
            std::swap(bases[1], bases[2]);
            std::swap(extents[1], extents[2]);
            std::swap(names[1], names[2]);
        }
        for (int n = 0; n < kPlanes; ++n) {
            Camera camera = frame(bases[n], extents[n], found.parts.at[n], 0, 1);
            camera.pixel = found.parts.pixel;
            draw_surfaces(camera);
            draw_text(canvas_, camera.at.x, camera.at.y + text, names[n], {text, theme_.faint, Align::Left, 0, {}});
        }
    }

    void draw_composed(const Rect& available) {
        const Split found = split(available, aspect(), rim(), ways(), gap_);
        draw_view(found.view);
        arrange(found.way);
        draw_slices(found.parts);
        if (!place_legend_in_corner(found))
            draw_legend(canvas_, found.view.x, found.view.y, legend(), text_, theme_.ink);
    }

    // ---- legend --------------------------------------------------------------------------------------------------

    [[nodiscard]] std::vector<LegendEntry> legend() const {
        std::vector<LegendEntry> entries;
        const bool several = scene_.structures.size() > 1;
        if (several || scene_.structures.front().name != "surface")
            for (const RenderStructure& structure : scene_.structures)
                entries.push_back({structure.name, to_color(structure.color), false});
        if (all_marks_.empty()) return entries;
        if (!several) entries.push_back({"marks", kLoneMark, true});
        if (several && !scene_.marks.empty()) entries.push_back({"marks", kLooseMark, true});
        return entries;
    }

    /// Places the legend in the space that three planes leave free: in the corner of the first arrangement, or beside
    /// the second plane of a column.
    /// @returns false if there is no such space, or it is too small.
    bool place_legend_in_corner(const Split& found) {
        if (options_.slices || found.way % 2 != 0 || found.parts.at.size() != kPlanes) return false;
        const std::vector<Rect>& at = found.parts.at;
        const auto entries = legend();
        const auto [width, height] = legend_size(entries, text_);
        const Rect available = found.way == 0 ? Rect{at[2].x, at[1].y, at[2].width, at[1].height}
                                              : Rect{at[1].right() + gap_, at[1].y,
                                                     found.parts.bounds.right() - at[1].right() - gap_, at[1].height};
        if (width > available.width - 0.5 * text_ || height > available.height - 0.3 * text_) return false;
        draw_legend(canvas_, available.x + 0.4 * text_, available.y + 0.3 * text_, entries, text_, theme_.ink);
        return true;
    }

    const RenderScene& scene_;
    const RenderOptions& options_;
    const RunContext& run_;
    Theme theme_;
    Canvas canvas_;
    double text_;
    int gap_;
    double radius_ = 3;
    std::vector<WorldBox> boxes_;  // bounding boxes of the surfaces, world units
    std::vector<Body> bodies_;
    std::vector<Vec3> all_marks_;
    Region region_;
    std::vector<Plane> planes_;
    std::array<double, 2> window_{0, 1};
};

}  // namespace
}  // namespace figure

ViewDirection parse_view(const std::string& text, bool is_anatomical) {
    const double left = is_anatomical ? 90 : -90;
    const std::array<std::pair<const char*, ViewDirection>, 7> names{{{"front", {0, 0}},
                                                                      {"back", {180, 0}},
                                                                      {"left", {left, 0}},
                                                                      {"right", {-left, 0}},
                                                                      {"top", {0, 90}},
                                                                      {"bottom", {0, -90}},
                                                                      {"iso", RenderOptions{}.view}}};
    for (const auto& [name, view] : names)
        if (text == name) return view;
    const std::size_t comma = text.find(',');
    try {
        std::size_t first = 0, second = 0;
        if (comma == std::string::npos) throw std::invalid_argument(text);
        const ViewDirection view{std::stod(text.substr(0, comma), &first), std::stod(text.substr(comma + 1), &second)};
        if (first == comma && comma + 1 + second == text.size() && std::isfinite(view.azimuth) &&
            std::abs(view.elevation) <= 90)
            return view;
    } catch (const std::logic_error&) {
    }
    throw Error(Errc::InvalidOptions,
                "view: expected front, back, left, right, top, bottom, iso, or azimuth and elevation in "
                "degrees (\"-32,28\", elevation -90 to 90), got '" +
                    text + "'");
}

Picture render(const RenderScene& scene, const RenderOptions& options, const RunContext& run) {
    require_valid(options, "render");
    for (const RenderStructure& structure : scene.structures)
        if (structure.opacity && !(*structure.opacity >= 0 && *structure.opacity <= 1))
            throw Error(Errc::InvalidOptions,
                        "render: opacity: expected 0 to 1, got " + detail::number(*structure.opacity));
    detail::require_memory(figure::kBytesPerPixel * options.width * options.height, "render: a picture of that size",
                           "make it smaller", run);
    Picture picture;
    with_threads(run, [&] { picture = figure::Drawing(scene, options, run).go(); });
    return picture;
}

}  // namespace covol
