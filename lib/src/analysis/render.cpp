#include "covol/render.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/RayIntersector.h>
#include <png.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "base/file.h"
#include "base/valid.h"
#include "covol/error.h"

namespace covol {
namespace {

using Vec = openvdb::Vec3d;
using Color = openvdb::Vec3d;  // r, g, b in [0,1]
using Sampler = openvdb::tools::GridSampler<FloatGrid::ConstAccessor, openvdb::tools::BoxSampler>;

constexpr int kSupersample = 2;  // rays per pixel and axis
constexpr int kGap = 4;          // pixels between panels
constexpr double kFrameMargin = 0.08;
constexpr double kLow = 0.005, kHigh = 0.995;  // intensity percentiles shown as black and white
constexpr double kOutlineWidth = 1.2;          // pixels to either side
constexpr double kDotRadius = 2.5;             // pixels
const Color kBackground(0.16, 0.17, 0.19), kSurface(0.93, 0.70, 0.42), kOutline(1.0, 0.62, 0.1), kDot(0.2, 0.85, 1.0);

/// A part of the picture; (0,0) is its upper left corner.
class Panel {
public:
    Panel(Picture& picture, int x, int y, int width, int height)
        : picture_(picture), x_(x), y_(y), width_(width), height_(height) {}
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    void set(int x, int y, const Color& color) const {
        std::uint8_t* to = picture_.rgb.data() + 3 * (std::size_t(y_ + y) * picture_.width + x_ + x);
        for (int c = 0; c < 3; ++c) to[c] = std::uint8_t(std::lround(255.0 * std::clamp(color[c], 0.0, 1.0)));
    }

private:
    Picture& picture_;
    int x_, y_, width_, height_;
};

/// World box of the voxels inside.
openvdb::BBoxd solid_box(const FloatGrid& surface) {
    const openvdb::CoordBBox box = surface.evalActiveVoxelBoundingBox();
    if (box.empty())
        throw Error(Errc::InvalidInput, "render: grid '" + surface.getName() + "': expected active voxels, got none");
    return surface.transform().indexToWorld(openvdb::BBoxd(box.min().asVec3d(), box.max().asVec3d()));
}

// A key light over the left shoulder, a weaker one from the right, and some from everywhere.
Color shade(const Vec& normal, const Vec& right, const Vec& up, const Vec& to_eye) {
    const Vec key = (to_eye - 0.6 * right + 0.8 * up).unit(), fill = (0.6 * to_eye + right - 0.2 * up).unit();
    const double light = 0.16 + 0.72 * std::max(0.0, normal.dot(key)) + 0.22 * std::max(0.0, normal.dot(fill));
    const double shine = std::pow(std::max(0.0, normal.dot((key + to_eye).unit())), 40.0);
    return kSurface * light + Color(0.18 * shine);
}

/// Orthographic view along -to_eye, framed on the solid.
void draw_surface(const FloatGrid& surface, const Vec& to_eye, const Panel& panel) {
    using Intersector = openvdb::tools::LevelSetRayIntersector<FloatGrid>;
    const openvdb::BBoxd box = solid_box(surface);
    const Vec center = 0.5 * (box.min() + box.max());
    const Vec right = Vec(0, 0, 1).cross(to_eye).unit(), up = to_eye.cross(right).unit();
    double half_width = 0, half_height = 0;
    for (int c = 0; c < 8; ++c) {
        const Vec corner(c & 1 ? box.max()[0] : box.min()[0], c & 2 ? box.max()[1] : box.min()[1],
                         c & 4 ? box.max()[2] : box.min()[2]);
        half_width = std::max(half_width, std::abs((corner - center).dot(right)));
        half_height = std::max(half_height, std::abs((corner - center).dot(up)));
    }
    const double pixel = (1 + kFrameMargin) * 2 * std::max(half_width / panel.width(), half_height / panel.height());
    const double distance = 2.0 * (box.max() - box.min()).length();
    const Intersector intersector(surface);
    tbb::parallel_for(tbb::blocked_range<int>(0, panel.height(), 8), [&](const tbb::blocked_range<int>& rows) {
        // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): it keeps the ray that it follows
        Intersector local(intersector);
        for (int y = rows.begin(); y != rows.end(); ++y)
            for (int x = 0; x < panel.width(); ++x) {
                Color sum(0.0);
                for (int s = 0; s < kSupersample * kSupersample; ++s) {
                    const double px = x + (s % kSupersample + 0.5) / kSupersample - 0.5 * panel.width();
                    const double py = 0.5 * panel.height() - y - (s / kSupersample + 0.5) / kSupersample;
                    const openvdb::math::Ray<double> ray(center + pixel * (px * right + py * up) + distance * to_eye,
                                                         -to_eye);
                    Vec hit, normal;
                    sum += local.intersectsWS(ray, hit, normal) ? shade(normal, right, up, to_eye) : kBackground;
                }
                panel.set(x, y, sum / (kSupersample * kSupersample));
            }
    });
}

/// The image's indices that the solid covers.
struct IndexRange {
    Vec3 min, max;
};
IndexRange covered(const ImageGeometry& geometry, const openvdb::BBoxd& box) {
    IndexRange range{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
    for (int c = 0; c < 8; ++c) {
        const Vec3 index =
            geometry.world_to_index({c & 1 ? box.max()[0] : box.min()[0], c & 2 ? box.max()[1] : box.min()[1],
                                     c & 4 ? box.max()[2] : box.min()[2]});
        for (int a = 0; a < 3; ++a) {
            range.min[a] = std::min(range.min[a], index[a]);
            range.max[a] = std::max(range.max[a], index[a]);
        }
    }
    for (int a = 0; a < 3; ++a) {
        range.min[a] = std::clamp(range.min[a], 0.0, geometry.size[a] - 1.0);
        range.max[a] = std::clamp(range.max[a], 0.0, geometry.size[a] - 1.0);
    }
    return range;
}

/// Slice k of the image in true proportions, with the outline and the points that lie within half a slice.
void draw_slice(const FloatGrid& surface, const Image& image, const std::vector<Vec3>& points, int k,
                const IndexRange& range, const std::array<double, 2>& window, const Panel& panel) {
    const ImageGeometry& g = image.geometry();
    double width = 0, height = 0;
    const double center[2] = {0.5 * (range.min[0] + range.max[0]), 0.5 * (range.min[1] + range.max[1])};
    width = (1 + 2 * kFrameMargin) * (range.max[0] - range.min[0] + 1) * g.spacing[0];
    height = (1 + 2 * kFrameMargin) * (range.max[1] - range.min[1] + 1) * g.spacing[1];
    const double pixel = std::max(width / panel.width(), height / panel.height());  // world units
    const auto i_of = [&](double x) { return center[0] + (x - 0.5 * panel.width()) * pixel / g.spacing[0]; };
    const auto j_of = [&](double y) { return center[1] + (y - 0.5 * panel.height()) * pixel / g.spacing[1]; };

    std::vector<std::array<double, 2>> dots;
    for (const Vec3& p : points) {
        const Vec3 index = g.world_to_index(p);
        if (std::abs(index[2] - k) > 0.5) continue;
        dots.push_back({0.5 * panel.width() + (index[0] - center[0]) * g.spacing[0] / pixel,
                        0.5 * panel.height() + (index[1] - center[1]) * g.spacing[1] / pixel});
    }
    const double scale = window[1] > window[0] ? 1.0 / (window[1] - window[0]) : 0.0;
    tbb::parallel_for(0, panel.height(), [&](int y) {
        const auto accessor = surface.getConstAccessor();
        const Sampler sampler(accessor, surface.transform());
        for (int x = 0; x < panel.width(); ++x) {
            const double i = i_of(x + 0.5), j = j_of(y + 0.5);
            Color color = kBackground;
            if (i >= -0.5 && j >= -0.5 && i < g.size[0] - 0.5 && j < g.size[1] - 0.5) {
                const double value = image.at(int(std::lround(i)), int(std::lround(j)), k);
                color = Color(std::clamp((value - window[0]) * scale, 0.0, 1.0));
            }
            const Vec3 world = g.index_to_world({i, j, double(k)});
            const double away = std::abs(sampler.wsSample(Vec(world[0], world[1], world[2]))) / pixel;
            const double outline = std::clamp(kOutlineWidth + 0.5 - away, 0.0, 1.0);
            color = (1 - outline) * color + outline * kOutline;
            for (const auto& dot : dots) {
                const double in =
                    std::clamp(kDotRadius + 0.5 - std::hypot(x + 0.5 - dot[0], y + 0.5 - dot[1]), 0.0, 1.0);
                color = (1 - in) * color + in * kDot;
            }
            panel.set(x, y, color);
        }
    });
}

Picture draw(const FloatGrid& surface, const Image* image, const std::vector<Vec3>& points,
             const RenderOptions& options, const RunContext& run) {
    detail::require_valid(options, "render");
    Picture picture{options.width, options.height,
                    std::vector<std::uint8_t>(3 * std::size_t(options.width) * options.height, 255)};
    const int slices = image != nullptr ? options.slices : 0;
    const int left = (options.width - kGap) / 2, right = options.width - left - kGap;
    with_threads(run, [&] {
        const Vec front = Vec(0.45, -0.8, 0.4).unit(), back = Vec(-0.7, 0.6, 0.35).unit();
        try {
            draw_surface(surface, front, Panel(picture, 0, 0, left, options.height));
            if (slices == 0) draw_surface(surface, back, Panel(picture, left + kGap, 0, right, options.height));
        } catch (const openvdb::Exception& e) {
            throw Error(Errc::InvalidInput, "render: grid '" + surface.getName() + "': " + e.what());
        }
        if (slices == 0) return;
        const IndexRange range = covered(image->geometry(), solid_box(surface));
        const auto window = image->percentiles(kLow, kHigh);
        const int height = (options.height - (slices - 1) * kGap) / slices;
        for (int n = 0; n < slices; ++n) {
            run.check();
            const double at = range.min[2] + (range.max[2] - range.min[2]) * (n + 1.0) / (slices + 1.0);
            draw_slice(surface, *image, points, int(std::lround(at)), range, window,
                       Panel(picture, left + kGap, n * (height + kGap), right, height));
        }
    });
    return picture;
}

}  // namespace

std::string RenderOptions::why_invalid() const {
    detail::FieldChecks checks;
    checks.expect(width >= 64 && width <= 16384, "width", "64 to 16384", width);
    checks.expect(height >= 64 && height <= 16384, "height", "64 to 16384", height);
    checks.expect(slices >= 0 && slices <= 16, "slices", "0 to 16", slices);
    return checks.lines();
}

Picture render(const FloatGrid& surface, const Image& image, const std::vector<Vec3>& points,
               const RenderOptions& options, const RunContext& run) {
    return draw(surface, &image, points, options, run);
}

Picture render(const FloatGrid& surface, const RenderOptions& options, const RunContext& run) {
    return draw(surface, nullptr, {}, options, run);
}

void write_png(const std::string& path, const Picture& picture) {
    detail::write_atomically(path, [&](const std::string& temporary) {
        png_image png{};
        png.version = PNG_IMAGE_VERSION;
        png.width = static_cast<png_uint_32>(picture.width);
        png.height = static_cast<png_uint_32>(picture.height);
        png.format = PNG_FORMAT_RGB;
        if (png_image_write_to_file(&png, temporary.c_str(), 0, picture.rgb.data(), 0, nullptr) == 0)
            throw Error(Errc::Io, "write_png: " + path + ": " + png.message);
    });
}

}  // namespace covol
