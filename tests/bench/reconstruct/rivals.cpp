// Methods of CGAL for surfaces from points, with which covol reconstruct is compared; CGAL's normals, which some of
// them need; and the measurement of a result. Without arguments, the program prints its usage. Points and meshes are
// PLY files. Parameters have the values of CGAL's manual as defaults.
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Scale_space_reconstruction_3/Jet_smoother.h>
#include <CGAL/Scale_space_reconstruction_3/Weighted_PCA_smoother.h>
#include <CGAL/Scale_space_surface_reconstruction_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/compute_average_spacing.h>
#include <CGAL/jet_estimate_normals.h>
#include <CGAL/mst_orient_normals.h>
#include <CGAL/poisson_surface_reconstruction.h>
#include <CGAL/property_map.h>

#include <cmath>
#include <iostream>
#include <map>
#include <string>

#include "measure.h"
#include "ply.h"

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Oriented = std::pair<Point, Vector>;
using PointMap = CGAL::First_of_pair_property_map<Oriented>;
using NormalMap = CGAL::Second_of_pair_property_map<Oriented>;
using Options = std::map<std::string, double>;

std::vector<Point> points_of(const Ply& ply) {
    std::vector<Point> points;
    for (const auto& p : ply.points) points.emplace_back(p[0], p[1], p[2]);
    return points;
}

template <class Points>
void set_points(Ply& ply, const Points& points) {
    ply.points.clear();
    for (const auto& p : points) ply.points.push_back({p.x(), p.y(), p.z()});
}

void add_triangle(Ply& ply, const std::array<std::size_t, 3>& t) {
    ply.triangles.push_back({std::uint32_t(t[0]), std::uint32_t(t[1]), std::uint32_t(t[2])});
}

Ply ply_of(const Mesh& mesh) {
    Ply ply;
    set_points(ply, mesh.points());
    for (const auto f : mesh.faces()) {
        auto& triangle = ply.triangles.emplace_back();
        int k = 0;
        for (const auto v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) triangle.at(k++) = v;
    }
    return ply;
}

double diagonal(const std::vector<Point>& points) {
    const CGAL::Bbox_3 box = CGAL::bbox_3(points.begin(), points.end());
    return std::hypot(box.xmax() - box.xmin(), box.ymax() - box.ymin(), box.zmax() - box.zmin());
}

double spacing(const std::vector<Point>& points) {
    return CGAL::compute_average_spacing<CGAL::Parallel_if_available_tag>(points, 6);
}

Ply normals(const Ply& given, const Options& options) {
    const unsigned k = unsigned(options.at("k"));
    std::vector<Oriented> points;
    for (const Point& p : points_of(given)) points.emplace_back(p, Vector());
    const auto maps = CGAL::parameters::point_map(PointMap()).normal_map(NormalMap());
    CGAL::jet_estimate_normals<CGAL::Parallel_if_available_tag>(points, k, maps);
    points.erase(CGAL::mst_orient_normals(points, k, maps), points.end());
    Ply oriented;
    for (const auto& [p, n] : points) {
        oriented.points.push_back({p.x(), p.y(), p.z()});
        oriented.normals.push_back({n.x(), n.y(), n.z()});
    }
    return oriented;
}

Ply poisson(const Ply& given, const Options&) {
    if (given.normals.empty()) throw std::runtime_error("poisson: expected points with normals; see `rivals normals`");
    std::vector<Oriented> points;
    const auto places = points_of(given);
    for (std::size_t n = 0; n < places.size(); ++n)
        points.emplace_back(places[n], Vector(given.normals[n][0], given.normals[n][1], given.normals[n][2]));
    Mesh mesh;
    if (!CGAL::poisson_surface_reconstruction_delaunay(points.begin(), points.end(), PointMap(), NormalMap(), mesh,
                                                       spacing(places)))
        throw std::runtime_error("poisson: found no surface");
    return ply_of(mesh);
}

Ply scale_space(const Ply& given, const Options& options) {
    const auto points = points_of(given);
    CGAL::Scale_space_surface_reconstruction_3<Kernel> space(points.begin(), points.end());
    space.increase_scale(std::size_t(options.at("scales")));
    space.reconstruct_surface();
    Ply mesh = given;
    mesh.normals.clear();
    if (options.at("smoothed") != 0) set_points(mesh, std::vector<Point>(space.points_begin(), space.points_end()));
    for (auto f = space.facets_begin(); f != space.facets_end(); ++f) add_triangle(mesh, *f);
    return mesh;
}

Ply advancing_front(const Ply& given, const Options&) {
    const auto points = points_of(given);
    std::vector<std::array<std::size_t, 3>> triangles;
    CGAL::advancing_front_surface_reconstruction(points.begin(), points.end(), std::back_inserter(triangles));
    Ply mesh = given;
    mesh.normals.clear();
    for (const auto& t : triangles) add_triangle(mesh, t);
    return mesh;
}

Ply alpha_wrap(const Ply& given, const Options& options) {
    const auto points = points_of(given);
    const double alpha = diagonal(points) * options.at("alpha") / 100;
    Mesh mesh;
    CGAL::alpha_wrap_3(points, alpha, alpha / options.at("alpha-per-offset"), mesh);
    return ply_of(mesh);
}

struct Method {
    Ply (*run)(const Ply&, const Options&);
    Options options;  // {parameter: its default value}
    const char* help;
};

const std::map<std::string, Method> methods = {
    {"normals",
     {normals,
      {{"k", 18}},
      "jets over k neighbours, oriented along a minimum spanning tree; unoriented points are dropped"}},
    {"poisson", {poisson, {}, "from points with normals"}},
    {"scale-space", {scale_space, {{"scales", 4}, {"smoothed", 0}}, "--smoothed 1: through the smoothed points"}},
    {"advancing-front", {advancing_front, {}, "through the points"}},
    {"alpha-wrap", {alpha_wrap, {{"alpha", 2}, {"alpha-per-offset", 10}}, "alpha in % of the diagonal"}},
};

int usage() {
    std::cerr << "rivals measure MESH TRUTH   JSON; lengths in % of the truth's diagonal\n"
                 "rivals points MESH POINTS   JSON; lengths in % of the points' diagonal\n";
    for (const auto& [name, method] : methods) {
        std::cerr << "rivals " << name << " POINTS OUT";
        for (const auto& [option, value] : method.options) std::cerr << " [--" << option << " " << value << "]";
        std::cerr << "   " << method.help << "\n";
    }
    return 2;
}

int run(int count, char** words) {
    if (count < 4) return usage();
    const std::string what = words[1];
    const bool measures = what == "measure" || what == "points";
    if (!measures && !methods.count(what)) return usage();
    Options options = measures ? Options{} : methods.at(what).options;
    for (int n = 4; n + 1 < count; n += 2) {
        const std::string option = words[n];
        if (option.size() < 3 || !options.count(option.substr(2))) return usage();
        options[option.substr(2)] = std::stod(words[n + 1]);
    }
    const Ply given = read_ply(words[2]);
    if (what == "measure") {
        std::cout << measure(given, read_ply(words[3])).dump(1) << "\n";
    } else if (what == "points") {
        std::cout << measure_points(given, read_ply(words[3])).dump(1) << "\n";
    } else {
        const Ply result = methods.at(what).run(given, options);
        if (what != "normals" && result.triangles.empty()) throw std::runtime_error(what + ": found no surface");
        write_ply(words[3], result);
    }
    return 0;
}

}  // namespace

int main(int count, char** words) {
    try {
        return run(count, words);
    } catch (const std::exception& error) {
        std::cerr << "rivals: " << error.what() << "\n";
        return 1;
    }
}
