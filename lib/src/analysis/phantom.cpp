#include "covol/phantom.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "base/geometry.h"

namespace covol {
namespace {

constexpr double kHalfSide = 1.3;  ///< [world units] half the side of the domain, a cube centred on the origin
constexpr double kPi = std::numbers::pi;
const double kShellRadius = std::sqrt(3.0) / 2.0;  // [world units] radius of the paper's spheres with holes (section 5)
constexpr double kShellThickness = 0.04;
constexpr double kContrast = 255.0;

// A generator whose distributions are the same everywhere, unlike those of <random>, which differ between standard
// libraries.
class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    /// In [0, 1).
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    Vec3 on_sphere(double radius) {
        const double z = uniform(-1, 1), angle = uniform(0, 2 * kPi), r = std::sqrt(1 - z * z);
        return {radius * r * std::cos(angle), radius * r * std::sin(angle), radius * z};
    }

private:
    std::mt19937_64 engine_;
};

/// Standard normal deviate number `index` of the stream `seed`; any order of calls gives the same values.
double gaussian(std::uint64_t seed, std::uint64_t index) {
    const auto mix = [](std::uint64_t x) {  // splitmix64 (Steele, Lea, Flood 2014)
        x += 0x9e3779b97f4a7c15ULL;
        x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ULL;
        x = (x ^ x >> 27) * 0x94d049bb133111ebULL;
        return x ^ x >> 31;
    };
    const std::uint64_t a = mix(mix(seed) + 2 * index), b = mix(mix(seed) + 2 * index + 1);
    const double u = static_cast<double>((a >> 11) + 1) * 0x1p-53, v = static_cast<double>(b >> 11) * 0x1p-53;
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * v);  // Box and Muller 1958
}

/// The definition of a kind of phantom.
struct PhantomShape {
    const char* name;
    std::function<double(const Vec3&)> distance;             ///< to the true surface, negative inside
    std::function<double(const Vec3&, double h)> intensity;  ///< of a voxel of edge h at a position, in [0,1]
    std::function<Vec3(Random&)> point;                      ///< on the true surface
};

/// A bright solid. The intensity of a voxel is the fraction of it that lies inside, estimated from the distance at its
/// centre.
PhantomShape solid(const char* name, const std::function<double(const Vec3&)>& distance,
                   std::function<Vec3(Random&)> point) {
    auto intensity = [distance](const Vec3& p, double h) { return std::clamp(0.5 - distance(p) / h, 0.0, 1.0); };
    return {name, distance, intensity, std::move(point)};
}

/// A thin bright spherical shell with holes where the axes intersect it; the points lie in the holes.
/// @param in_hole  whether a position near an axis is in the hole on this axis, from its other two coordinates: (y, z)
///     for the x axis, (z, x) for the y axis and (x, y) for the z axis
PhantomShape sphere_with_holes(const char* name, const std::function<bool(double, double)>& in_hole) {
    const auto is_open = [in_hole](const Vec3& p) {
        for (int axis = 0; axis < 3; ++axis) {
            const double a = p[(axis + 1) % 3], b = p[(axis + 2) % 3];
            if (std::abs(p[axis]) > std::max(std::abs(a), std::abs(b)) && in_hole(a, b)) return true;
        }
        return false;
    };
    return {name, [](const Vec3& p) { return length(p) - kShellRadius; },
            [is_open](const Vec3& p, double) {
                return std::abs(length(p) - kShellRadius) <= kShellThickness / 2 && !is_open(p) ? 1.0 : 0.0;
            },
            [is_open](Random& random) {
                Vec3 p;
                do p = random.on_sphere(kShellRadius);
                while (!is_open(p));
                return p;
            }};
}

double distance_to_box(const Vec3& p, const Vec3& half) {
    double inside = -1e300;
    Vec3 outside{};
    for (int a = 0; a < 3; ++a) {
        const double d = std::abs(p[a]) - half[a];
        inside = std::max(inside, d);
        outside[a] = std::max(0.0, d);
    }
    return inside > 0 ? length(outside) : inside;
}

Vec3 point_on_box(const Vec3& half, Random& random) {
    // Chooses an axis with a probability proportional to the area of its two faces.
    const Vec3 area = {half[1] * half[2], half[2] * half[0], half[0] * half[1]};
    double at = random.uniform(0, area[0] + area[1] + area[2]);
    int axis = 0;
    while (axis < 2 && at >= area[axis]) at -= area[axis++];
    Vec3 p;
    for (int a = 0; a < 3; ++a) p[a] = random.uniform(-half[a], half[a]);
    p[axis] = std::copysign(half[axis], p[axis]);
    return p;
}

Vec3 point_on_torus(double major, double minor, Random& random) {
    // The area of the torus is proportional to the distance from its axis. The angle b around the tube is drawn from
    // this distribution by rejection sampling.
    double b;
    do b = random.uniform(0, 2 * kPi);
    while (random.uniform(0, major + minor) > major + minor * std::cos(b));
    const double a = random.uniform(0, 2 * kPi), r = major + minor * std::cos(b);
    return {r * std::cos(a), r * std::sin(a), minor * std::sin(b)};
}

std::vector<PhantomShape> shapes() {
    constexpr double kRadius = 0.8, kMajor = 0.75, kMinor = 0.3, kTwin = 0.45;
    constexpr Vec3 kBox = {0.9, 0.7, 0.5};
    constexpr Vec3 kTwinCenter = {0.55, 0.1, 0.05};
    const auto twin_distance = [=](const Vec3& p, int side) {
        return length({p[0] - side * kTwinCenter[0], p[1] - side * kTwinCenter[1], p[2] - side * kTwinCenter[2]}) -
               kTwin;
    };
    return {
        solid(
            "sphere", [=](const Vec3& p) { return length(p) - kRadius; },
            [=](Random& random) { return random.on_sphere(kRadius); }),
        solid(
            "torus", [=](const Vec3& p) { return std::hypot(std::hypot(p[0], p[1]) - kMajor, p[2]) - kMinor; },
            [=](Random& random) { return point_on_torus(kMajor, kMinor, random); }),
        solid(
            "box", [=](const Vec3& p) { return distance_to_box(p, kBox); },
            [=](Random& random) { return point_on_box(kBox, random); }),
        solid(
            "two-spheres", [=](const Vec3& p) { return std::min(twin_distance(p, 1), twin_distance(p, -1)); },
            [=](Random& random) {
                const double side = random.uniform() < 0.5 ? -1 : 1;
                Vec3 p = random.on_sphere(kTwin);
                for (int a = 0; a < 3; ++a) p[a] += side * kTwinCenter[a];
                return p;
            }),
        sphere_with_holes("sphere-round", [](double a, double b) { return a * a + b * b <= 0.30 * 0.30; }),
        sphere_with_holes("sphere-square",
                          [](double a, double b) { return std::max(std::abs(a), std::abs(b)) <= 0.25; }),
        sphere_with_holes("sphere-slit",
                          [](double a, double b) { return std::abs(a) <= 0.308 && std::abs(b) <= 0.11; }),
    };
}

}  // namespace

std::vector<std::string> list_phantom_kinds() {
    std::vector<std::string> names;
    for (const PhantomShape& shape : shapes()) names.emplace_back(shape.name);
    return names;
}

Phantom make_phantom(const PhantomOptions& options) {
    const std::vector<PhantomShape> all = shapes();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const PhantomShape& s) { return s.name == options.kind; });
    if (found == all.end()) {
        std::string kinds;
        for (const PhantomShape& s : all) kinds += (kinds.empty() ? "" : ", ") + std::string(s.name);
        throw Error(Errc::InvalidOptions, "kind: expected one of " + kinds + ", got '" + options.kind + "'", "kind");
    }
    require_valid(options, "make_phantom");
    const PhantomShape& shape = *found;

    const int n = options.size;
    const double h = 2 * kHalfSide / n;
    ImageGeometry geometry;
    geometry.size = {n, n, n};
    geometry.spacing = {h, h, h};
    const double first = -kHalfSide + h / 2;
    geometry.origin = {first, first, first};

    std::vector<std::uint8_t> values(std::size_t(n) * n * n);
    Phantom phantom;
    phantom.labels.resize(values.size());
    tbb::parallel_for(0, n, [&](int k) {
        std::size_t at = std::size_t(k) * n * n;
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i, ++at) {
                const Vec3 p = {first + h * i, first + h * j, first + h * k};
                double value = kContrast * shape.intensity(p, h);
                if (options.noise > 0) value += kContrast * options.noise * gaussian(options.seed, at);
                values[at] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, kContrast)));
                phantom.labels[at] = shape.distance(p) < 0;
            }
    });
    phantom.image = Image::from_values(geometry, values.data());

    Random random(options.seed);
    phantom.points.resize(static_cast<std::size_t>(options.point_count));
    for (Vec3& p : phantom.points) p = shape.point(random);
    return phantom;
}

}  // namespace covol
