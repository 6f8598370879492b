#include "measure.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/box_intersection_d.h>

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
using nlohmann::json;

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

/// Uniform by area; the same for the same triangles.
std::vector<Sample> sample(const Triangles& triangles) {
    std::mt19937_64 random(1);
    std::vector<double> area;
    for (const Triangle& t : triangles) area.push_back(std::sqrt(t.squared_area()));
    std::discrete_distribution<std::size_t> pick(area.begin(), area.end());
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<Sample> found;
    for (std::size_t n = 0; n < samples; ++n) {
        const Triangle& t = triangles[pick(random)];
        const double root = std::sqrt(share(random)), v = share(random);
        found.push_back({t[0] + root * (1 - v) * (t[1] - t[0]) + root * v * (t[2] - t[0]), unit_normal(t)});
    }
    return found;
}

/// Numbers of a set of lengths, in % of `unit`.
json told(std::vector<double> lengths, double unit) {
    std::sort(lengths.begin(), lengths.end());
    const auto at = [&](double share) { return 100 / unit * lengths[std::size_t(share * double(lengths.size() - 1))]; };
    return {{"mean", 100 / unit * std::accumulate(lengths.begin(), lengths.end(), 0.0) / double(lengths.size())},
            {"median", at(0.5)},
            {"p95", at(0.95)},
            {"max", at(1)}};
}

/// One way: from samples of a surface to the triangles of the other.
json one_way(const Triangles& from, const Tree& to, double unit) {
    std::vector<double> lengths;
    double angles = 0;
    for (const Sample& s : sample(from)) {
        const auto [nearest, triangle] = to.closest_point_and_primitive(s.p);
        lengths.push_back(std::sqrt((nearest - s.p).squared_length()));
        angles += std::acos(std::min(1.0, std::abs(s.normal * unit_normal(*triangle))));
    }
    json report = told(std::move(lengths), unit);
    report["angle"] = angles / double(samples) * 180 / std::numbers::pi;
    return report;
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

/// Of the triangles by their indices. Genus: from V - E + F = 2 components - 2 genus - boundary loops; null where the mesh is no
/// manifold (an edge of more than two triangles, two fans at a vertex).
json topology(const Ply& ply) {
    struct Edge {
        std::uint32_t a, b;              // a < b
        std::size_t corner_a, corner_b;  // 3 * triangle + corner
        bool forward;
    };
    std::vector<Edge> edges;
    for (std::size_t t = 0; t < ply.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t from = 3 * t + k, to = 3 * t + (k + 1) % 3;
            const auto a = ply.triangles[t][k], b = ply.triangles[t][(k + 1) % 3];
            edges.push_back(a < b ? Edge{a, b, from, to, true} : Edge{b, a, to, from, false});
        }
    std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); });

    Sets fans(3 * ply.triangles.size()), pieces(ply.points.size()), loops(ply.points.size());
    std::size_t edge_count = 0, open = 0, crowded = 0, turned = 0;
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
        } else if (edges[n].forward == edges[n + 1].forward) {
            ++turned;
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
    json report = {{"vertices", vertices},
                   {"triangles", ply.triangles.size()},
                   {"euler", euler},
                   {"components", components.size()},
                   {"boundary_loops", rims.size()},
                   {"closed", open == 0},
                   {"manifold", manifold},
                   {"oriented", turned == 0}};
    if (manifold) report["genus"] = (2 * long(components.size()) - long(rims.size()) - euler) / 2;
    return report;
}

/// Pairs of triangles that meet elsewhere than in the corners they share. (Two on one edge that lie folded onto each other are not
/// found.)
std::size_t crossing_pairs(const Ply& ply) {
    using Exact = CGAL::Exact_predicates_inexact_constructions_kernel;
    using Corner = std::uint32_t;
    using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::array<Corner, 3>>;
    const auto at = [&](Corner v) {
        const auto& p = ply.points[v];
        return Exact::Point_3(p[0], p[1], p[2]);
    };
    const auto triangle = [&](const std::array<Corner, 3>& t) { return Exact::Triangle_3(at(t[0]), at(t[1]), at(t[2])); };
    std::vector<Box> boxes;
    for (const auto& t : ply.triangles)
        if (!triangle(t).is_degenerate()) boxes.emplace_back(triangle(t).bbox(), t);

    std::size_t found = 0;
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& one, const Box& two) {
        const auto s = one.info(), t = two.info();
        const auto shared_by = [](const std::array<Corner, 3>& corners) {
            return [&corners](Corner v) { return std::find(corners.begin(), corners.end(), v) != corners.end(); };
        };
        const auto shared = std::count_if(s.begin(), s.end(), shared_by(t));
        if (shared == 0) {
            found += CGAL::do_intersect(triangle(s), triangle(t));
        } else if (shared == 1) {
            const auto opposite = [&](const std::array<Corner, 3>& own, const std::array<Corner, 3>& other) {
                const auto k = std::find_if(own.begin(), own.end(), shared_by(other)) - own.begin();
                return Exact::Segment_3(at(own[(k + 1) % 3]), at(own[(k + 2) % 3]));
            };
            found += CGAL::do_intersect(opposite(s, t), triangle(t)) || CGAL::do_intersect(opposite(t, s), triangle(s));
        }
    });
    return found;
}

double spacing_of(const Neighbours::Tree& tree) {
    double sum = 0;
    for (const Point& p : tree) {
        Neighbours search(tree, p, 7);  // itself comes first
        double own = 0;
        for (const auto& [q, squared] : search) own += std::sqrt(squared);
        sum += own / 6;
    }
    return sum / double(tree.size());
}

}  // namespace

json measure(const Ply& mesh, const Ply& truth, bool self_intersections) {
    const double unit = diagonal(truth);
    const Triangles a = solid_triangles(mesh), b = solid_triangles(truth);
    const Tree tree_a(a.begin(), a.end()), tree_b(b.begin(), b.end());
    json report = {{"topology", topology(mesh)},
                   {"to_truth", one_way(a, tree_b, unit)},
                   {"from_truth", one_way(b, tree_a, unit)}};
    report["angle"] = (report["to_truth"]["angle"].get<double>() + report["from_truth"]["angle"].get<double>()) / 2;
    if (self_intersections) report["self_intersections"] = crossing_pairs(mesh);
    return report;
}

json measure_points(const Ply& mesh, const Ply& points) {
    const double unit = diagonal(points);
    const Triangles triangles = solid_triangles(mesh);
    const Tree surface(triangles.begin(), triangles.end());
    Neighbours::Tree cloud;
    std::vector<double> to_mesh, to_points;
    for (const auto& p : points.points) {
        cloud.insert(point(p));
        to_mesh.push_back(std::sqrt(surface.squared_distance(point(p))));
    }
    cloud.build();
    for (const Sample& s : sample(triangles)) to_points.push_back(std::sqrt(Neighbours(cloud, s.p, 1).begin()->second));
    const double spacing = spacing_of(cloud);
    const auto far = std::count_if(to_points.begin(), to_points.end(), [=](double d) { return d > 3 * spacing; });
    return {{"topology", topology(mesh)},
            {"points_to_mesh", told(std::move(to_mesh), unit)},
            {"mesh_to_points", told(std::move(to_points), unit)},
            {"spacing", 100 * spacing / unit},
            {"share_beyond_3_spacings", double(far) / double(samples)}};
}
