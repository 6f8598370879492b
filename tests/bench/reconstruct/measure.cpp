#include "measure.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Triangle = Kernel::Triangle_3;
using Triangles = std::vector<Triangle>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
using Neighbours = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Kernel>>;
using json = nlohmann::ordered_json;  // keeps the order of the keys, which are the columns of the table

constexpr std::size_t samples = 200'000;

Point point(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

double diagonal(const Ply& ply) {
    CGAL::Bbox_3 box;
    for (const auto& p : ply.points) box += point(p).bbox();
    return std::hypot(box.xmax() - box.xmin(), box.ymax() - box.ymin(), box.zmax() - box.zmin());
}

Triangles solid_triangles(const Ply& ply) {
    Triangles found;
    for (const auto& [a, b, c] : ply.triangles) {
        const Triangle t(point(ply.points.at(a)), point(ply.points.at(b)), point(ply.points.at(c)));
        if (t.squared_area() > 0) found.push_back(t);
    }
    if (found.empty()) throw std::runtime_error("a mesh without triangles");
    return found;
}

Vector unit_normal(const Triangle& t) {
    const Vector n = t.supporting_plane().orthogonal_vector();
    return n / std::sqrt(n.squared_length());
}

struct Sample {
    Point p;
    Vector normal;
};

/// Random samples, uniform by area. The seed is constant, so that the samples of a mesh are always the same.
std::vector<Sample> sample(const Triangles& triangles) {
    std::mt19937_64 random(1);
    std::vector<double> area;
    for (const Triangle& t : triangles) area.push_back(std::sqrt(t.squared_area()));
    std::discrete_distribution<std::size_t> pick(area.begin(), area.end());
    std::uniform_real_distribution<double> fraction(0, 1);
    std::vector<Sample> found;
    for (std::size_t n = 0; n < samples; ++n) {
        const Triangle& t = triangles[pick(random)];
        const double root = std::sqrt(fraction(random)), v = fraction(random);
        found.push_back({t[0] + root * (1 - v) * (t[1] - t[0]) + root * v * (t[2] - t[0]), unit_normal(t)});
    }
    return found;
}

double mean(const std::vector<double>& numbers) {
    return std::accumulate(numbers.begin(), numbers.end(), 0.0) / double(numbers.size());
}

double largest(const std::vector<double>& numbers) { return *std::max_element(numbers.begin(), numbers.end()); }

struct OneWay {
    std::vector<double> lengths, angles;
};

/// Distances from samples of the surface `from` to the surface `to`, and the angles between their normals, in degrees.
OneWay one_way(const Triangles& from, const Tree& to) {
    OneWay found;
    for (const Sample& s : sample(from)) {
        const auto [nearest, triangle] = to.closest_point_and_primitive(s.p);
        found.lengths.push_back(std::sqrt((nearest - s.p).squared_length()));
        found.angles.push_back(180 / std::numbers::pi *
                               std::acos(std::min(1.0, std::abs(s.normal * unit_normal(*triangle)))));
    }
    return found;
}

/// Mean distances in both directions, and the maximum of all distances, in % of `unit`.
json distances(const std::vector<double>& to, const std::vector<double>& from, double unit) {
    return {{"mean_to", 100 / unit * mean(to)},
            {"mean_from", 100 / unit * mean(from)},
            {"hausdorff", 100 / unit * std::max(largest(to), largest(from))}};
}

class Sets {
public:
    explicit Sets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
    std::size_t of(std::size_t n) {
        while (parent_[n] != n) n = parent_[n] = parent_[parent_[n]];
        return n;
    }
    void unite(std::size_t a, std::size_t b) { parent_[of(a)] = of(b); }

private:
    std::vector<std::size_t> parent_;
};

/// Topology of the mesh: vertices are equal if their indices are equal. If the mesh is a manifold (no edge with more
/// than two triangles, no vertex with two separate fans of triangles), its genus follows from
/// V - E + F = 2 components - 2 genus - boundary loops.
json topology(const Ply& ply) {
    struct Edge {
        std::uint32_t a, b;              // a < b
        std::size_t corner_a, corner_b;  // 3 * triangle + corner
    };
    std::vector<Edge> edges;
    for (std::size_t t = 0; t < ply.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t from = 3 * t + k, to = 3 * t + (k + 1) % 3;
            const auto a = ply.triangles[t][k], b = ply.triangles[t][(k + 1) % 3];
            edges.push_back(a < b ? Edge{a, b, from, to} : Edge{b, a, to, from});
        }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& x, const Edge& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); });

    Sets fans(3 * ply.triangles.size()), pieces(ply.points.size()), loops(ply.points.size());
    std::size_t edge_count = 0, open = 0, crowded = 0;
    std::set<std::uint32_t> rim;
    for (std::size_t n = 0, next = 0; n < edges.size(); n = next) {
        while (next < edges.size() && edges[next].a == edges[n].a && edges[next].b == edges[n].b) ++next;
        ++edge_count;
        pieces.unite(edges[n].a, edges[n].b);
        for (std::size_t m = n + 1; m < next; ++m) {
            fans.unite(edges[n].corner_a, edges[m].corner_a);
            fans.unite(edges[n].corner_b, edges[m].corner_b);
        }
        if (next == n + 1) {
            ++open;
            loops.unite(edges[n].a, edges[n].b);
            rim.insert({edges[n].a, edges[n].b});
        } else if (next > n + 2) {
            ++crowded;
        }
    }
    std::vector<std::size_t> fan_of(ply.points.size(), std::size_t(-1));
    std::set<std::uint32_t> pinched;
    for (std::size_t c = 0; c < 3 * ply.triangles.size(); ++c) {
        const auto v = ply.triangles[c / 3][c % 3];
        if (fan_of[v] == std::size_t(-1)) fan_of[v] = fans.of(c);
        if (fan_of[v] != fans.of(c)) pinched.insert(v);
    }
    std::set<std::size_t> components, rims;
    long vertices = 0;
    for (std::size_t v = 0; v < ply.points.size(); ++v)
        if (fan_of[v] != std::size_t(-1)) {
            ++vertices;
            components.insert(pieces.of(v));
        }
    for (const auto v : rim) rims.insert(loops.of(v));
    const bool manifold = crowded == 0 && pinched.empty();
    const long euler = vertices - long(edge_count) + long(ply.triangles.size());
    const long genus = (2 * long(components.size()) - long(rims.size()) - euler) / 2;
    return {{"genus", manifold ? json(genus) : json("no manifold")},
            {"components", components.size()},
            {"closed", open == 0 ? "yes" : "no"},
            {"triangles", ply.triangles.size()}};
}

double spacing_of(const Neighbours::Tree& tree) {
    double sum = 0;
    for (const Point& p : tree) {
        Neighbours search(tree, p, 7);  // 7: the point itself, which is found first, and 6 neighbours
        double own = 0;
        for (const auto& [q, squared] : search) own += std::sqrt(squared);
        sum += own / 6;
    }
    return sum / double(tree.size());
}

}  // namespace

json measure(const Ply& mesh, const Ply& truth) {
    const Triangles a = solid_triangles(mesh), b = solid_triangles(truth);
    const Tree tree_a(a.begin(), a.end()), tree_b(b.begin(), b.end());
    const OneWay to = one_way(a, tree_b), from = one_way(b, tree_a);
    json report = distances(to.lengths, from.lengths, diagonal(truth));
    report["normals"] = (mean(to.angles) + mean(from.angles)) / 2;
    report["genus_truth"] = topology(truth)["genus"];
    report.update(topology(mesh));
    return report;
}

json measure_points(const Ply& mesh, const Ply& points) {
    const Triangles triangles = solid_triangles(mesh);
    const Tree surface(triangles.begin(), triangles.end());
    Neighbours::Tree cloud;
    std::vector<double> to, from;
    for (const auto& p : points.points) {
        cloud.insert(point(p));
        from.push_back(std::sqrt(surface.squared_distance(point(p))));
    }
    cloud.build();
    for (const Sample& s : sample(triangles)) to.push_back(std::sqrt(Neighbours(cloud, s.p, 1).begin()->second));
    json report = distances(to, from, diagonal(points));
    const double spacing = spacing_of(cloud);
    report["beyond_points"] =
        100 * double(std::count_if(to.begin(), to.end(), [=](double d) { return d > 3 * spacing; })) / double(samples);
    report.update(topology(mesh));
    return report;
}
