#include "covol/compare.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "base/matrix.h"
#include "base/number.h"
#include "covol/domain.h"
#include "covol/error.h"
#include "covol/surface.h"
#include "mesh/triangle.h"
#include "meshing/mesh_distance.h"
#include "meshing/mesh_rows.h"

namespace covol {
namespace {

// [voxels] along the longest side of the lattice on which two meshes are compared
constexpr int kMeshLatticeVoxels = 256;
constexpr std::int64_t kSlabVoxels = 1 << 26;  // maximum number of voxels of each solid in memory
constexpr double kMaxLatticeVoxels = 1e12;
constexpr double kMaxSamples = 4e6;  // approximate maximum number of samples on a surface

double voxel_volume(const ImageGeometry& g) {
    return g.spacing[0] * g.spacing[1] * g.spacing[2] * std::abs(detail::determinant(g.direction));
}

bool is_label(double value, int label) { return label == 0 ? value != 0 : value == label; }

// ------------------------------------------------------------------------------------------------- surfaces of masks

/// The boundary of a mask in world units: the isosurface at 1/2 of the function that is 1 in the voxels with the label
/// and 0 in the others.
class MaskSurface {
public:
    MaskSurface(const Image& mask, int label) : mask_(mask), label_(label), size_(mask.geometry().size) {}

    TriangleMesh extract(const RunContext& run) {
        const FloatGridPtr grid = level_set();
        TriangleMesh mesh = extract_mesh(*grid, {}, run);
        const ImageGeometry& geometry = mask_.geometry();
        const Vec3 &s = geometry.spacing,
                   origin = choose_mesh_origin(geometry.world_box(), std::min({s[0], s[1], s[2]}));
        for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
            mesh.vertices[v] = meshing::to_position(minus(geometry.index_to_world(mesh.place(v)), origin));
        mesh.origin = origin;
        if (detail::determinant(geometry.direction) < 0)
            for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
        return mesh;
    }

private:
    using Tree = FloatGrid::TreeType;

    /// The level set of the mask's boundary, in index space: -0.5 in the voxels with the label and 0.5 in the others.
    FloatGridPtr level_set() {
        FloatGridPtr grid = make_grid({}, 0.5F, "mask");
        std::array<std::size_t, 3> blocks{};
        for (int a = 0; a < 3; ++a) blocks[a] = std::size_t(size_[a] + 7) / 8;
        const std::size_t nj = blocks[1], nk = blocks[2];
        std::vector<std::int8_t> inside(blocks[0] * nj * nk);
        const auto origin = [nj, nk](std::size_t b) {
            return openvdb::Coord(int(b / (nj * nk)) * 8, int(b / nk % nj) * 8, int(b % nk) * 8);
        };
        tbb::parallel_for(std::size_t(0), inside.size(), [&](std::size_t b) { inside[b] = classify(origin(b)); });
        std::vector<Tree::LeafNodeType*> leaves;
        for (std::size_t b = 0; b < inside.size(); ++b) {
            if (inside[b] == kInside) grid->tree().addTile(1, origin(b), -0.5F, false);
            if (inside[b] == kMixed) leaves.push_back(grid->tree().touchLeaf(origin(b)));
        }
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t l) {
            for (unsigned n = 0; n < Tree::LeafNodeType::SIZE; ++n)
                leaves[l]->setValueOn(n, is_inside(leaves[l]->offsetToGlobalCoord(n)) ? -0.5F : 0.5F);
        });
        return grid;
    }

    enum : std::int8_t { kOutside, kInside, kMixed };

    [[nodiscard]] std::int8_t classify(const openvdb::Coord& origin) const {
        const bool first = is_inside(origin);
        for (int n = 1; n < 512; ++n)
            if (is_inside(origin.offsetBy(n >> 6, n >> 3 & 7, n & 7)) != first) return kMixed;
        return first ? kInside : kOutside;
    }

    [[nodiscard]] bool is_inside(const openvdb::Coord& c) const {
        return c.x() < size_[0] && c.y() < size_[1] && c.z() < size_[2] &&
               is_label(mask_.at(c.x(), c.y(), c.z()), label_);
    }

    const Image& mask_;
    const int label_;
    const Index3 size_;
};

// ----------------------------------------------------------------------------------------------- solids on a lattice

/// The part of a lattice that consists of geometry.size[2] slices, beginning with the slice `first`. `geometry` is that
/// of this part.
struct Slab {
    ImageGeometry geometry;
    int first = 0;
};

using Voxels = std::vector<std::uint8_t>;

void fill_from_mask(const Image& mask, int label, const ImageGeometry& slab, Voxels& out) {
    const auto to_mask = [&](double i, double j, double k) {
        return mask.geometry().world_to_index(slab.index_to_world({i, j, k}));
    };
    const Vec3 zero = to_mask(0, 0, 0);
    std::array<Vec3, 3> step{to_mask(1, 0, 0), to_mask(0, 1, 0), to_mask(0, 0, 1)};
    for (Vec3& s : step)
        for (int a = 0; a < 3; ++a) s[a] -= zero[a];
    const Index3 size = mask.geometry().size;
    tbb::parallel_for(0, slab.size[2], [&](int k) {
        std::size_t n = std::size_t(k) * std::size_t(slab.size[0]) * std::size_t(slab.size[1]);
        for (int j = 0; j < slab.size[1]; ++j)
            for (int i = 0; i < slab.size[0]; ++i, ++n) {
                Index3 at{};
                bool within = true;
                for (int a = 0; a < 3; ++a) {
                    const double x = std::floor(zero[a] + i * step[0][a] + j * step[1][a] + k * step[2][a] + 0.5);
                    within = within && x >= 0 && x < size[a];
                    at[a] = within ? int(x) : 0;
                }
                out[n] = within && is_label(mask.at(at[0], at[1], at[2]), label);
            }
    });
}

class Shape {
public:
    Shape(const Solid& solid, const char* name, const RunContext& run) : solid_(solid) {
        if (int(solid.mask.has_value()) + int(solid.mesh.has_value()) + int(solid.level_set != nullptr) != 1)
            throw Error(Errc::InvalidInput,
                        std::string("compare: solid ") + name + ": expected one of mask, mesh and level set");
        if (solid.mask) {
            own_surface_ = MaskSurface(*solid.mask, solid.label).extract(run);
            lattice_ = solid.mask->geometry();
        } else if (solid.level_set) {
            own_surface_ = extract_mesh(*solid.level_set, {}, run);
            const Domain domain = domain_of(*solid.level_set);
            lattice_.emplace();
            lattice_->spacing.fill(domain.voxel_size);
            lattice_->origin = domain.origin;
        }
        if (surface().empty())
            throw Error(
                Errc::InvalidInput,
                std::string("compare: solid ") + name + " is empty" +
                    (solid.mask && solid.label != 0 ? ": no voxel has label " + std::to_string(solid.label) : ""));
    }

    [[nodiscard]] const TriangleMesh& surface() const { return solid_.mesh ? *solid_.mesh : own_surface_; }
    [[nodiscard]] bool is_mask() const { return solid_.mask.has_value(); }
    [[nodiscard]] const std::optional<ImageGeometry>& lattice() const { return lattice_; }

    [[nodiscard]] double volume() const {
        if (!solid_.mask) return measure(surface()).volume;
        const auto [ni, nj, nk] = solid_.mask->geometry().size;
        std::int64_t count = 0;
        for (int k = 0; k < nk; ++k)
            for (int j = 0; j < nj; ++j)
                for (int i = 0; i < ni; ++i) count += is_label(solid_.mask->at(i, j, k), solid_.label);
        return double(count) * voxel_volume(*lattice_);
    }

    void prepare(const ImageGeometry& lattice) {
        if (solid_.mesh) rows_.emplace(*solid_.mesh, lattice);
    }
    void fill(const Slab& slab, Voxels& out, const RunContext& run) const {
        if (solid_.mask)
            fill_from_mask(*solid_.mask, solid_.label, slab.geometry, out);
        else if (solid_.mesh)
            rows_->fill(slab.first, slab.geometry.size, out,
                        "compare: a mesh is not closed, so it has no inside; repair it first");
        else
            out = rasterize(*solid_.level_set, slab.geometry, 1, run);
    }

private:
    const Solid& solid_;
    TriangleMesh own_surface_;
    std::optional<ImageGeometry> lattice_;
    std::optional<meshing::MeshRows> rows_;
};

WorldBox box_of(const TriangleMesh& mesh, const std::function<Vec3(const Vec3&)>& map) {
    WorldBox box;
    box.min.fill(std::numeric_limits<double>::max());
    box.max.fill(std::numeric_limits<double>::lowest());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const Vec3 p = map(mesh.place(v));
        for (int a = 0; a < 3; ++a) {
            box.min[a] = std::min(box.min[a], p[a]);
            box.max[a] = std::max(box.max[a], p[a]);
        }
    }
    return box;
}

WorldBox box_of(const Shape& a, const Shape& b, const std::function<Vec3(const Vec3&)>& map) {
    WorldBox box = box_of(a.surface(), map);
    const WorldBox other = box_of(b.surface(), map);
    for (int c = 0; c < 3; ++c) {
        box.min[c] = std::min(box.min[c], other.min[c]);
        box.max[c] = std::max(box.max[c], other.max[c]);
    }
    return box;
}

/// The lattice for the overlap, restricted to the box of both solids. It has the orientation, spacing and alignment of
/// the finer lattice of two masks or two level sets, else of the mask, else of the level set. For two meshes it is
/// parallel to the world's axes.
ImageGeometry common_lattice(const Shape& a, const Shape& b) {
    const auto finer = [](const Shape& p, const Shape& q) {
        return voxel_volume(*p.lattice()) <= voxel_volume(*q.lattice()) ? *p.lattice() : *q.lattice();
    };
    ImageGeometry lattice;
    if (a.is_mask() == b.is_mask() && a.lattice() && b.lattice())
        lattice = finer(a, b);
    else if (a.is_mask() || !b.lattice())
        lattice = a.lattice().value_or(ImageGeometry{});
    else
        lattice = *b.lattice();
    if (!a.lattice() && !b.lattice()) {
        const WorldBox box = box_of(a, b, [](const Vec3& p) { return p; });
        const double longest = std::max({box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]});
        if (!(longest > 0)) throw Error(Errc::InvalidInput, "compare: the meshes have no extent");
        lattice.spacing.fill(longest / kMeshLatticeVoxels);
        for (int c = 0; c < 3; ++c) lattice.origin[c] = box.min[c] + 0.5 * lattice.spacing[c];
    }
    const WorldBox box = box_of(a, b, [&](const Vec3& p) { return lattice.world_to_index(p); });
    double total = 1;
    Vec3 first{};
    for (int c = 0; c < 3; ++c) {
        first[c] = std::ceil(box.min[c]);
        const double size = std::max(1.0, std::floor(box.max[c]) - first[c] + 1);
        total *= size;
        lattice.size[c] = int(std::min(size, 1e9));
    }
    if (!(total < kMaxLatticeVoxels) || double(lattice.size[0]) * lattice.size[1] > 1e9)
        throw Error(Errc::InvalidInput, "compare: the solids together span " + detail::number(total) +
                                            " voxels of the finer one, expected less than 1e12 in slices of at most "
                                            "1e9; do they lie in the same space?");
    lattice.origin = lattice.index_to_world(first);
    return lattice;
}

void compare_overlap(Shape& a, Shape& b, const ImageGeometry& lattice, const RunContext& run, CompareReport& report) {
    a.prepare(lattice);
    b.prepare(lattice);
    const std::int64_t slice = std::int64_t(lattice.size[0]) * lattice.size[1];
    const int slices = int(std::clamp<std::int64_t>(kSlabVoxels / slice, 1, lattice.size[2]));
    Voxels in_a, in_b;
    std::int64_t count_a = 0, count_b = 0, both = 0;
    for (int k = 0; k < lattice.size[2]; k += slices) {
        Slab slab{lattice, k};
        slab.geometry.size[2] = std::min(slices, lattice.size[2] - k);
        slab.geometry.origin = lattice.index_to_world({0, 0, double(k)});
        in_a.resize(std::size_t(slice * slab.geometry.size[2]));
        in_b.resize(in_a.size());
        a.fill(slab, in_a, run);
        b.fill(slab, in_b, run);
        for (std::size_t n = 0; n < in_a.size(); ++n) {
            count_a += in_a[n];
            count_b += in_b[n];
            both += in_a[n] & in_b[n];
        }
        run.report("overlap", double(k + slab.geometry.size[2]) / lattice.size[2]);
        run.check();
    }
    if (count_a + count_b > 0) {
        report.dice = 2.0 * double(both) / double(count_a + count_b);
        report.jaccard = double(both) / double(count_a + count_b - both);
    }
}

// ---------------------------------------------------------------------------------------------------------- distances

/// Points on a surface, each with the area that it represents. The mesh's vertices are included with area 0, so that
/// they affect only the maximum distance.
struct Samples {
    std::vector<Vec3> points;
    std::vector<double> areas;
};

Samples sample_surface(const TriangleMesh& mesh, double spacing) {
    spacing = std::max(spacing, std::sqrt(2 * measure(mesh).area / kMaxSamples));
    Samples samples;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        samples.points.push_back(mesh.place(v));
        samples.areas.push_back(0);
    }
    for (const auto& t : mesh.triangles) {
        const Vec3 a{samples.points[t[0]]}, b{samples.points[t[1]]}, c{samples.points[t[2]]};
        const double ab = length(minus(b, a)), bc = length(minus(c, b)), ca = length(minus(a, c));
        const double half = (ab + bc + ca) / 2;
        const double area = std::sqrt(std::max(0.0, half * (half - ab) * (half - bc) * (half - ca)));
        // The triangle is divided into n^2 congruent triangles, with one sample at the centroid of each.
        const int n = int(std::clamp(std::ceil(std::max({ab, bc, ca}) / spacing), 1.0, 1000.0));
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < 2 * (n - i) - 1; ++j) {
                const double shift = j % 2 == 0 ? 1.0 / 3 : 2.0 / 3;
                const double u = (i + shift) / n, v = (j / 2 + shift) / n;
                Vec3 p{};
                for (int k = 0; k < 3; ++k) p[k] = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
                samples.points.push_back(p);
                samples.areas.push_back(area / (double(n) * n));
            }
    }
    return samples;
}

/// For each sample on the surface `from`, appends its distance to the surface `to` and the area that it represents.
void append_distances(const TriangleMesh& from, const TriangleMesh& to, double spacing,
                      std::vector<std::pair<double, double>>& distances) {
    const Samples samples = sample_surface(from, spacing);
    const std::vector<double> away = detail::distances_to(to, samples.points);
    for (std::size_t i = 0; i < away.size(); ++i) distances.emplace_back(away[i], samples.areas[i]);
}

void compare_surfaces(const TriangleMesh& a, const TriangleMesh& b, double spacing, const RunContext& run,
                      CompareReport& report) {
    std::vector<std::pair<double, double>> distances;
    append_distances(a, b, spacing, distances);
    run.report("distances", 0.5);
    run.check();
    append_distances(b, a, spacing, distances);
    run.report("distances", 1.0);
    std::sort(distances.begin(), distances.end());
    double total = 0, sum = 0;
    for (const auto& [distance, area] : distances) {
        total += area;
        sum += area * distance;
    }
    report.hausdorff = distances.back().first;
    report.assd = total > 0 ? sum / total : 0;
    double below = 0;
    for (const auto& [distance, area] : distances) {
        below += area;
        report.hd95 = distance;
        if (below >= 0.95 * total) break;
    }
}

}  // namespace

CompareReport compare(const Solid& a, const Solid& b, const RunContext& run) {
    CompareReport report;
    with_threads(run, [&] {
        Shape first(a, "A", run), second(b, "B", run);
        run.check();
        const ImageGeometry lattice = common_lattice(first, second);
        report.volume_a = first.volume();
        report.volume_b = second.volume();
        compare_overlap(first, second, lattice, run, report);
        compare_surfaces(first.surface(), second.surface(), 2 * lattice.smallest_spacing(), run, report);
    });
    return report;
}

}  // namespace covol
