#pragma once
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "covol/band.h"
#include "covol/contours.h"
#include "covol/distance.h"

// Contours that tests draw on the slices of an image.
namespace covol::test {

inline const double kPi = std::acos(-1.0);

/// Builds lines of marks whose coordinates are voxel indices of one image.
class Drawing {
public:
    explicit Drawing(ImageGeometry geometry) : geometry_(std::move(geometry)) {
        cloud_.space = PointSpace::Index;
        cloud_.source = "marks.csv";
    }

    Drawing& add(const std::vector<Vec3>& marks, bool closed = true) {
        MarkLine line;
        line.begin = cloud_.points.size();
        cloud_.points.insert(cloud_.points.end(), marks.begin(), marks.end());
        line.end = cloud_.points.size();
        line.closed = closed;
        cloud_.lines.push_back(line);
        return *this;
    }
    /// A circle of world radius r around the voxel position (x, y) in slice k; `axis` is the normal of the slices.
    Drawing& circle(double x, double y, double k, double r, int axis = 2, int count = 96) {
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        std::vector<Vec3> marks;
        for (int n = 0; n < count; ++n) {
            Vec3 p;
            p[axis] = k;
            p[u] = x + r * std::cos(2 * kPi * n / count) / geometry_.spacing[u];
            p[v] = y + r * std::sin(2 * kPi * n / count) / geometry_.spacing[v];
            marks.push_back(p);
        }
        return add(marks);
    }
    Drawing& loose(const Vec3& mark) {
        cloud_.points.push_back(mark);
        return *this;
    }

    [[nodiscard]] Contours densify(double step, ContourCurve curve = ContourCurve::Lines,
                                   const RunContext& run = {}) const {
        return covol::densify({cloud_}, geometry_, {step, curve}, run);
    }
    [[nodiscard]] const ImageGeometry& geometry() const { return geometry_; }
    [[nodiscard]] const PointCloud& cloud() const { return cloud_; }

private:
    ImageGeometry geometry_;
    PointCloud cloud_;
};

inline ImageGeometry cube(int size, double spacing = 1) {
    ImageGeometry g;
    g.size = {size, size, size};
    g.spacing = {spacing, spacing, spacing};
    return g;
}

inline double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

inline double nearest(const Vec3& from, const std::vector<Vec3>& points) {
    double best = std::numeric_limits<double>::max();
    for (const Vec3& p : points) best = std::min(best, distance(from, p));
    return best;
}

inline std::vector<Vec3> all_points(const Contours& c) {
    std::vector<Vec3> points = c.along;
    points.insert(points.end(), c.between.begin(), c.between.end());
    return points;
}

/// The report of tag_interior(): a flood fill from outside through {d > D}, with a test for leaks.
inline BandReport flood(const std::vector<Vec3>& points, double h, double D) {
    const Domain domain = make_domain(bounding_box(points, D + 6 * h), h);
    const FloatGridPtr d = covol::compute_distance(points, domain, {D + 6 * h}).grid;
    return tag_interior(*d, {D, {}}).report;
}

struct Warnings {
    std::vector<std::string> lines;
    RunContext run;
    Warnings() {
        run.log = [this](LogLevel level, const std::string& line) {
            if (level == LogLevel::Warning) lines.push_back(line);
        };
    }
};

}  // namespace covol::test
