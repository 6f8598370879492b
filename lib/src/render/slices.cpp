#include "render/slices.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "limits/memory_budget.h"
#include "render/draw/decorations.h"
#include "render/level_set.h"
#include "render/marks.h"

namespace covol::figure {
namespace {

constexpr std::size_t kMaxMarks = 120;
constexpr int kMaxSamples = 4;  // samples of the image along each side of a pixel
constexpr float kFar = 1e6F;    // pixels: initial distance of an outline
// Minimum slope of the level set within the plane by which its values are divided. If the slope is smaller, the surface
// is nearly parallel to the plane.
constexpr double kFlat = 0.2;

/// The image's values in one plane.
class Slice {
public:
    Slice(const Image& image, const Plane& plane, const Region& region, const RunContext& run) : plane_(plane) {
        VoxelBox box = image.held();
        for (const int a : {plane.across, plane.down}) {
            box.min[a] = std::clamp(int(std::floor(region.min[a])), box.min[a], box.max[a]);
            box.max[a] = std::clamp(int(std::ceil(region.max[a])), box.min[a], box.max[a]);
        }
        const int n = plane.axis;
        box.min[n] = box.max[n] = std::clamp(int(std::lround(plane.index)), box.min[n], box.max[n]);
        image.load(box, run);
        const Index3 size = box.size();
        detail::require_memory(sizeof(float) * double(size[0]) * size[1] * size[2],
                               "render: the plane through " + image.path(), "choose a smaller part of it", run);
        values_.resize(std::size_t(size[0]) * size[1] * size[2]);
        image.copy(box, values_.data());
        std::size_t stride = 1;
        for (int a = 0; a < 3; ++a) {
            if (a == plane.across) stride_[0] = stride;
            if (a == plane.down) stride_[1] = stride;
            stride *= std::size_t(size[a]);
        }
        first_ = {box.min[plane.across], box.min[plane.down]};
        size_ = {size[plane.across], size[plane.down]};
    }

    /// The bilinearly interpolated value at a position, given as indices along the plane's two axes.
    [[nodiscard]] double at(double u, double v) const {
        const auto [i, s] = place(u, 0);
        const auto [j, t] = place(v, 1);
        const float* const p = values_.data() + i * stride_[0] + j * stride_[1];
        const std::size_t di = size_[0] > 1 ? stride_[0] : 0, dj = size_[1] > 1 ? stride_[1] : 0;
        const double near = p[0] + s * (double(p[di]) - p[0]), far = p[dj] + s * (double(p[di + dj]) - p[dj]);
        return near + t * (far - near);
    }

private:
    [[nodiscard]] std::pair<std::size_t, double> place(double at, int axis) const {
        const double x = std::clamp(at - first_[axis], 0.0, size_[axis] - 1.0);
        const auto base = std::size_t(std::min(std::floor(x), std::max(0.0, size_[axis] - 2.0)));
        return {base, x - double(base)};
    }

    Plane plane_;
    std::vector<float> values_;
    std::array<std::size_t, 2> stride_{1, 1};
    std::array<int, 2> first_{0, 0}, size_{1, 1};
};

class Panel {
public:
    Panel(Canvas& canvas, const Rect& at, const Plane& plane, const Region& region, const RenderScene& scene,
          const SliceStyle& style, const RunContext& run)
        : canvas_(canvas),
          at_(at),
          plane_(plane),
          region_(region),
          scene_(scene),
          geometry_(scene.image->geometry()),
          style_(style),
          run_(run) {}

    void go() {
        draw_image();
        draw_outlines();
        draw_planes();
        for (const RenderStructure& structure : scene_.structures)
            draw_marks(structure.marks, scene_.structures.size() > 1 ? to_color(structure.color) : kLoneMark);
        draw_marks(scene_.marks, scene_.structures.size() > 1 ? kLooseMark : kLoneMark);
        draw_labels();
    }

private:
    /// Indices along the plane's two axes at a position on the picture.
    [[nodiscard]] std::array<double, 2> indices(double x, double y) const {
        const int a = plane_.across, b = plane_.down;
        const double u = (x - at_.x) * style_.pixel / geometry_.spacing[a];
        const double v = (y - at_.y) * style_.pixel / geometry_.spacing[b];
        return {plane_.mirror_across ? region_.max[a] - u : region_.min[a] + u,
                plane_.mirror_down ? region_.max[b] - v : region_.min[b] + v};
    }

    [[nodiscard]] Vec3 world(double x, double y) const {
        const auto [u, v] = indices(x, y);
        Vec3 index;
        index[plane_.axis] = plane_.index;
        index[plane_.across] = u;
        index[plane_.down] = v;
        return geometry_.index_to_world(index);
    }

    [[nodiscard]] bool is_in_image(int axis, double index) const {
        return index >= -0.5 && index <= geometry_.size[axis] - 0.5;
    }

    void draw_image() const {
        const Slice slice(*scene_.image, plane_, region_, run_);
        const double finest = std::min(geometry_.spacing[plane_.across], geometry_.spacing[plane_.down]);
        const int samples = std::clamp(int(std::lround(style_.pixel / finest)), 1, kMaxSamples);
        const double span = style_.window[1] - style_.window[0], scale = span > 0 ? 1 / span : 0;
        tbb::parallel_for(0, at_.height, [&](int y) {
            for (int x = 0; x < at_.width; ++x) {
                double sum = 0, inside = 0;
                for (int s = 0; s < samples * samples; ++s) {
                    const auto [u, v] =
                        indices(at_.x + x + (s % samples + 0.5) / samples, at_.y + y + (s / samples + 0.5) / samples);
                    if (!is_in_image(plane_.across, u) || !is_in_image(plane_.down, v)) continue;
                    sum += slice.at(u, v);
                    ++inside;
                }
                const double value = inside > 0 ? (sum / inside - style_.window[0]) * scale : 0;
                canvas_.at(at_.x + x, at_.y + y) =
                    mix(style_.beyond, gray(std::clamp(value, 0.0, 1.0)), inside / (samples * samples));
            }
        });
    }

    /// The two structures whose outlines are nearest to a pixel, with their signed distances in pixels.
    struct Nearest {
        int structure[2] = {-1, -1};
        float away[2] = {kFar, kFar};

        void take(int n, float distance) {
            const int rank = std::abs(distance) < std::abs(away[0]) ? 0 : 1;
            if (std::abs(distance) >= std::abs(away[rank])) return;
            if (rank == 0) structure[1] = structure[0], away[1] = away[0];
            structure[rank] = n;
            away[rank] = distance;
        }
    };

    /// Adds the distances from the outline of structure n, the zero of its level set: the value divided by the slope
    /// within the plane.
    void find_outline(int n, std::vector<Nearest>& nearest) const {
        const int width = at_.width + 2, height = at_.height + 2;  // one more pixel on every side, for slopes
        std::vector<float> values(std::size_t(width) * height);
        tbb::enumerable_thread_specific<SmoothField> fields([&] { return SmoothField(*scene_.structures[n].surface); });
        tbb::parallel_for(0, height, [&](int y) {
            SmoothField& field = fields.local();
            for (int x = 0; x < width && !run_.cancelled(); ++x)
                values[std::size_t(y) * width + x] = float(field.value(world(at_.x + x - 0.5, at_.y + y - 0.5)));
        });
        const float minimum = float(kFlat * style_.pixel);
        tbb::parallel_for(0, at_.height, [&](int y) {
            for (int x = 0; x < at_.width; ++x) {
                const float* const v = values.data() + std::size_t(y + 1) * width + x + 1;
                const float slope = 0.5F * std::hypot(v[1] - v[-1], v[width] - v[-width]);
                nearest[std::size_t(y) * at_.width + x].take(n, v[0] / std::max(slope, minimum));
            }
        });
    }

    /// Draws the outlines with the same width everywhere. Along a common border of two structures, each outline lies on
    /// the side of its own structure, so that both are visible.
    void draw_outlines() const {
        std::vector<Nearest> nearest(std::size_t(at_.width) * at_.height);
        for (int n = 0; n < int(scene_.structures.size()); ++n) find_outline(n, nearest);
        const double half = std::max(0.8, 0.075 * style_.text), rim = std::max(0.5, 0.03 * style_.text);
        tbb::parallel_for(0, at_.height, [&](int y) {
            for (int x = 0; x < at_.width; ++x) {
                const Nearest& near = nearest[std::size_t(y) * at_.width + x];
                const double apart = std::abs(std::abs(near.away[0]) - std::abs(near.away[1]));
                const double shared = std::clamp(2 - 2 * apart / half, 0.0, 1.0);
                const auto covered = [&](double away, double more) {
                    const double own_side = std::clamp(0.5 - away, 0.0, 1.0);
                    return std::lerp(std::clamp(half + more - std::abs(away), 0.0, 1.0),
                                     own_side * std::clamp(2 * half + more - std::abs(away), 0.0, 1.0), shared);
                };
                const auto draw = [&](int rank, bool is_rim) {
                    if (near.structure[rank] < 0) return;
                    const double fraction = covered(near.away[rank], is_rim ? rim + 0.5 : 0.5);
                    const Color color = is_rim ? gray(0) : to_color(scene_.structures[near.structure[rank]].color);
                    canvas_.blend(at_.x + x, at_.y + y, color, is_rim ? 0.55 * fraction : fraction);
                };
                const int under = near.structure[0] < near.structure[1] ? 0 : 1;
                for (const bool is_rim : {true, false})
                    for (const int rank : {under, 1 - under}) draw(rank, is_rim);
            }
        });
    }

    /// Intersections with the other planes, as faint dashed lines.
    void draw_planes() const {
        const double dash = std::max(4.0, 0.5 * style_.text), width = std::max(1.0, 0.07 * style_.text);
        for (const Plane& other : style_.others) {
            if (other.axis == plane_.axis) continue;
            Vec3 index = region_.min;
            index[other.axis] = other.index;
            const auto [x, y] = place_on(at_, plane_, region_, style_.pixel, index, geometry_);
            const bool upright = other.axis == plane_.across;
            const double from = upright ? at_.y : at_.x, to = upright ? at_.bottom() : at_.right();
            for (double t = from; t < to; t += 2 * dash) {
                const double end = std::min(to, t + dash);
                if (upright)
                    canvas_.line({x, t}, {x, end}, width, gray(1), 0.45, at_);
                else
                    canvas_.line({t, y}, {end, y}, width, gray(1), 0.45, at_);
            }
        }
    }

    void draw_marks(const std::vector<Vec3>& marks, const Color& color) const {
        std::vector<std::array<double, 2>> places;
        for (const Vec3& mark : marks) {
            const Vec3 index = geometry_.world_to_index(mark);
            if (std::abs(index[plane_.axis] - plane_.index) <= 0.5)
                places.push_back(place_on(at_, plane_, region_, style_.pixel, index, geometry_));
        }
        // Draws only every n-th mark if there are very many, because they would hide the outline.
        const std::size_t stride = places.size() / kMaxMarks + 1;
        for (std::size_t n = 0; n < places.size(); n += stride) {
            const auto [x, y] = places[n];
            canvas_.disc(x, y, style_.mark_radius + std::max(0.6, 0.05 * style_.text), gray(0.05), 0.9, at_);
            canvas_.disc(x, y, style_.mark_radius, color, 1, at_);
        }
    }

    void draw_labels() const {
        const double size = style_.text, pad = 0.45 * size, rim = std::max(1.0, 0.11 * size);
        TextStyle style{size, gray(1), Align::Left, rim, gray(0)};
        const std::string name = name_of(plane_, scene_);
        const double cap = kCapHeight * size;
        const double available = at_.width - 2 * pad;
        if (text_width(name, size) <= available && at_.height > 2 * size)
            draw_text(canvas_, at_.x + pad, at_.y + pad + cap, name, style);
        if (!scene_.is_anatomical || std::min(at_.width, at_.height) < 5 * size) return;
        const auto across = letters_of(plane_.across, geometry_), down = letters_of(plane_.down, geometry_);
        const double middle_x = at_.x + 0.5 * at_.width, middle_y = at_.y + 0.5 * (at_.height + cap);
        draw_text(canvas_, at_.x + pad, middle_y, across[plane_.mirror_across ? 0 : 1], style);
        style.align = Align::Right;
        draw_text(canvas_, at_.right() - pad, middle_y, across[plane_.mirror_across ? 1 : 0], style);
        style.align = Align::Center;
        draw_text(canvas_, middle_x, at_.bottom() - pad, down[plane_.mirror_down ? 1 : 0], style);
        // If the plane's name extends to the middle, the upper letter is placed below the name.
        const bool under = at_.x + 2 * pad + text_width(name, size) > middle_x - 0.5 * size;
        draw_text(canvas_, middle_x, at_.y + pad + cap + (under ? 1.2 * size : 0), down[plane_.mirror_down ? 0 : 1],
                  style);
    }

    Canvas& canvas_;
    const Rect& at_;
    const Plane& plane_;
    const Region& region_;
    const RenderScene& scene_;
    const ImageGeometry& geometry_;
    const SliceStyle& style_;
    const RunContext& run_;
};

}  // namespace

void draw_slice(Canvas& canvas, const Rect& at, const Plane& plane, const Region& region, const RenderScene& scene,
                const SliceStyle& style, const RunContext& run) {
    run.check();
    Panel(canvas, at, plane, region, scene, style, run).go();
}

}  // namespace covol::figure
