#include "render/surface_view.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/RayIntersector.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "covol/error.h"
#include "render/level_set.h"
#include "render/shading.h"

namespace covol::figure {
namespace {

using Intersector = openvdb::tools::LevelSetRayIntersector<FloatGrid>;

constexpr int kMaxHits = 12;  // maximum number of intersections of one ray with one translucent body
// [voxels] Distance up to which a position counts as on the surface, and step of the search along a grazing ray.
constexpr double kOnSurface = 0.02, kFinestStep = 0.25;
constexpr double kOneWall = 1;  // [voxels] walls of two bodies that are closer to each other count as one
// Cosine between the ray and the normal: below it, the ray grazes the surface.
constexpr double kGrazing = 0.2;
constexpr int kFiner = 4;          // number of rays along each side of a pixel at an edge
constexpr double kOpaque = 0.999;  // fraction of a pixel from which on everything behind the surface is hidden
constexpr auto kMissing = -std::numeric_limits<float>::infinity();
constexpr double kCosEdge = 0.8;  // cosine between neighbouring pixels' normals: below it, there is an edge
constexpr int kRows = 8;

struct Hit {
    double depth = kMissing;  // from the camera's center towards the eye, world units
    Vec3 normal{0, 0, 0};
    int body = -1;
    bool enters = true;  ///< whether the ray enters the body here
};

/// The result of one ray.
struct Seen {
    Color color{0, 0, 0};
    float fraction = 0, depth = kMissing, solid = kMissing;
    std::array<float, 3> normal{0, 0, 0};
    int body = -1;
};

/// Traces the rays of one thread.
class Tracer {
public:
    Tracer(const std::vector<Body>& bodies, std::vector<Intersector> intersectors, const Camera& camera, double reach)
        : bodies_(bodies),
          intersectors_(std::move(intersectors)),
          camera_(camera),
          reach_(reach),
          lights_(camera.basis) {
        for (const Body& body : bodies) fields_.emplace_back(*body.surface);
    }

    Seen operator()(double x, double y) {
        hits_.clear();
        const Vec3 middle = camera_.place(x, y);
        for (std::size_t n = 0; n < bodies_.size(); ++n) find_hits(int(n), middle);
        std::sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) { return a.depth > b.depth; });
        Seen seen;
        for (const Hit& hit : hits_) {
            if (is_behind_neighbour(hit)) continue;
            const Body& body = bodies_[hit.body];
            const double facing = std::abs(dot(hit.normal, camera_.basis.to_eye));
            // A surface that the ray meets obliquely is more opaque, because the ray's path through it is longer.
            const double fraction = body.opacity >= 1 ? 1 : 1 - std::pow(1 - body.opacity, 1 / std::max(0.2, facing));
            const double adds = (1 - seen.fraction) * fraction;
            seen.color = sum(seen.color, scaled(lights_.shade(body.color, hit.normal), adds));
            seen.fraction += float(adds);
            if (seen.body < 0) {
                seen.body = hit.body;
                seen.depth = float(hit.depth);
                seen.normal = {float(hit.normal[0]), float(hit.normal[1]), float(hit.normal[2])};
            }
            if (seen.fraction > kOpaque) {
                seen.solid = float(hit.depth);
                break;
            }
        }
        return seen;
    }

private:
    /// Whether the ray leaves a body through a wall in common with a body that it enters: only the latter is drawn.
    [[nodiscard]] bool is_behind_neighbour(const Hit& hit) const {
        if (hit.enters) return false;
        return std::any_of(hits_.begin(), hits_.end(), [&](const Hit& other) {
            const double apart = std::abs(other.depth - hit.depth) * std::abs(dot(other.normal, camera_.basis.to_eye));
            return other.enters && other.body != hit.body && apart < kOneWall * fields_[hit.body].voxel_size();
        });
    }

    void find_hits(int n, const Vec3& middle) {
        const Vec3 &to_eye = camera_.basis.to_eye, origin = plus(middle, times(reach_, to_eye));
        double from = openvdb::math::Delta<double>::value();  // start of the ray, before everything that it meets
        const double h = fields_[n].voxel_size();
        const int maximum = bodies_[n].opacity >= 1 ? 1 : kMaxHits;
        for (int tries = 0, found = 0; tries < kMaxHits && found < maximum; ++tries) {
            const openvdb::math::Ray<double> ray(to_vdb(origin), to_vdb(times(-1, to_eye)), from, 2 * reach_);
            openvdb::Vec3d at;
            if (!intersectors_[n].intersectsWS(ray, at)) return;
            const double t = reach_ - (to_vdb(to_eye).dot(at - to_vdb(middle)));
            from = t + 0.3 * h;
            const Hit hit = refined(n, origin, t);
            if (hit.body < 0) continue;
            hits_.push_back(hit);
            ++found;
        }
    }

    /// The intersection of the ray with the zero of the smooth field, close to its intersection at t with the linearly
    /// interpolated voxels. The result has no body (-1) if the ray grazes only the latter surface: otherwise single
    /// voxels would be visible at the outline.
    Hit refined(int n, const Vec3& origin, double t) {
        SmoothField& field = fields_[n];
        const Vec3 along = times(-1, camera_.basis.to_eye);
        const double h = field.voxel_size(), first = t;
        SmoothField::Sample sample = field.at(plus(origin, times(t, along)));
        for (int step = 0; step < 2; ++step) {
            const double slope = dot(sample.gradient, along);
            if (std::abs(slope) < kGrazing || std::abs(sample.value) < kOnSurface * h) break;
            t = std::clamp(t - sample.value / slope, first - h, first + h);
            sample = field.at(plus(origin, times(t, along)));
        }
        if (sample.value > kOnSurface * h && std::abs(dot(sample.gradient, along)) < 2 * kGrazing) {
            double last = sample.value;
            bool meets = false;
            for (double ahead = kFinestStep * h; ahead < 2 * h && !meets; ahead += kFinestStep * h) {
                sample = field.at(plus(origin, times(first + ahead, along)));
                if (sample.value > last) break;
                meets = sample.value <= 0;
                last = sample.value;
                t = first + ahead;
            }
            if (!meets) return {};
        }
        Vec3 normal = unit(sample.gradient);
        const bool enters = dot(normal, along) <= 0;
        if (!enters) normal = times(-1, normal);
        return {reach_ - t, normal, n, enters};
    }

    const std::vector<Body>& bodies_;
    // One for each body. They store the current ray, so that each thread needs its own.
    std::vector<Intersector> intersectors_;
    const Camera& camera_;
    double reach_;
    Lights lights_;
    std::vector<SmoothField> fields_;
    std::vector<Hit> hits_;
};

bool is_edge(const Seen& a, const Seen& b, double pixel) {
    if (a.body != b.body) return true;
    if (a.body < 0) return false;
    const float cosine = a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] + a.normal[2] * b.normal[2];
    return cosine < kCosEdge || std::abs(a.depth - b.depth) > 12 * pixel || std::abs(a.fraction - b.fraction) > 0.08;
}

class View {
public:
    View(const std::vector<Body>& bodies, const Camera& camera, const RunContext& run)
        : camera_(camera), run_(run), width_(camera.at.width), height_(camera.at.height) {
        double reach = 0;
        std::vector<Intersector> intersectors;
        for (const Body& body : bodies) {
            try {
                intersectors.emplace_back(*body.surface);
            } catch (const openvdb::Exception& e) {
                throw Error(Errc::InvalidInput, "render: grid '" + body.surface->getName() + "': " + e.what());
            }
            const Extent extent = surface_extent(*body.surface, camera.basis);
            const double center = dot(camera.center, camera.basis.to_eye), h = body.surface->voxelSize()[0];
            reach = std::max({reach, extent.max[2] - center + 8 * h, center - extent.min[2] + 8 * h});
        }
        make_ = [&bodies, intersectors, &camera, reach] { return Tracer(bodies, intersectors, camera, reach); };
    }

    Layer go() {
        tbb::enumerable_thread_specific<Tracer> tracers(make_);
        first_.resize(std::size_t(width_) * height_);
        for_rows([&](int y) {
            Tracer& trace = tracers.local();
            for (int x = 0; x < width_; ++x) first(x, y) = trace(camera_.at.x + x + 0.5, camera_.at.y + y + 0.5);
        });
        Layer layer{width_, height_, {}, {}, {}, {}};
        layer.color.resize(first_.size());
        for (auto* values : {&layer.fraction, &layer.depth, &layer.solid}) values->resize(first_.size());
        for_rows([&](int y) {
            Tracer& trace = tracers.local();
            for (int x = 0; x < width_; ++x) {
                const Seen seen = at_edge(x, y) ? finer(trace, x, y) : first(x, y);
                const std::size_t n = std::size_t(y) * width_ + x;
                layer.color[n] = seen.color;
                layer.fraction[n] = seen.fraction;
                layer.depth[n] = first_[n].depth;
                layer.solid[n] = first_[n].solid;
            }
        });
        run_.check();
        return layer;
    }

private:
    Seen& first(int x, int y) { return first_[std::size_t(y) * width_ + x]; }

    template <typename Row>
    void for_rows(const Row& row) const {
        tbb::parallel_for(tbb::blocked_range<int>(0, height_, kRows), [&](const tbb::blocked_range<int>& rows) {
            for (int y = rows.begin(); y != rows.end() && !run_.cancelled(); ++y) row(y);
        });
    }

    bool at_edge(int x, int y) {
        const Seen& own = first(x, y);
        return (x > 0 && is_edge(own, first(x - 1, y), camera_.pixel)) ||
               (y > 0 && is_edge(own, first(x, y - 1), camera_.pixel)) ||
               (x + 1 < width_ && is_edge(own, first(x + 1, y), camera_.pixel)) ||
               (y + 1 < height_ && is_edge(own, first(x, y + 1), camera_.pixel));
    }

    [[nodiscard]] Seen finer(Tracer& trace, int x, int y) const {
        Seen mean;
        for (int s = 0; s < kFiner * kFiner; ++s) {
            const Seen one =
                trace(camera_.at.x + x + (s % kFiner + 0.5) / kFiner, camera_.at.y + y + (s / kFiner + 0.5) / kFiner);
            mean.color = sum(mean.color, scaled(one.color, 1.0 / (kFiner * kFiner)));
            mean.fraction += one.fraction / (kFiner * kFiner);
        }
        return mean;
    }

    const Camera& camera_;
    const RunContext& run_;
    int width_, height_;
    std::function<Tracer()> make_;
    std::vector<Seen> first_;
};

}  // namespace

Layer cast_surfaces(const std::vector<Body>& bodies, const Camera& camera, const RunContext& run) {
    return View(bodies, camera, run).go();
}

void compose(const Layer& layer, const Rect& at, Canvas& canvas) {
    tbb::parallel_for(0, layer.height, [&](int y) {
        for (int x = 0; x < layer.width; ++x) {
            const std::size_t n = std::size_t(y) * layer.width + x;
            Color& pixel = canvas.at(at.x + x, at.y + y);
            pixel = sum(layer.color[n], scaled(pixel, 1 - layer.fraction[n]));
        }
    });
}

}  // namespace covol::figure
