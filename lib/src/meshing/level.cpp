#include "meshing/level.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "base/heuristics.h"
#include "grid/leaf_band.h"

namespace covol::meshing {
namespace {

constexpr int kSteps = 6;            // maximum; Newton's method in project() converges in fewer steps or not at all
constexpr double kConverged = 1e-4;  // [voxels] maximum distance of project()'s result from the surface
constexpr double kNearFace = 0.01;   // [voxels] twice the width of the chamfers that extract_mesh() makes

/// Calls visit(point) for points of a triangle that are at most `step` apart: for small triangles the corners, the
/// midpoints of the sides and the centre.
template <typename Visit>
void for_each_sample(const Vec3& a, const Vec3& b, const Vec3& c, double step, const Visit& visit) {
    const double longest = std::max({length(minus(b, a)), length(minus(c, b)), length(minus(a, c))});
    const int n = std::max(2, int(std::ceil(longest / step)));
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
            const double s = double(i) / n, t = double(j) / n;
            visit(plus(plus(a, s, minus(b, a)), t, minus(c, a)));
        }
    visit(plus(plus(a, 1.0 / 3, minus(b, a)), 1.0 / 3, minus(c, a)));
}

/// The one of two adjacent second differences that has the smaller magnitude, 0 if their signs differ: a second
/// difference across a crease of the distance is large, but describes the values on neither side of the crease.
double minmod(double a, double b) {
    if (a * b <= 0) return 0;
    return std::abs(a) < std::abs(b) ? a : b;
}

}  // namespace

Level::Level(const FloatGrid& grid, const detail::LatticeClip& clip, double isovalue, const Vec3& origin)
    : accessor_(grid.getConstAccessor()), clip_(clip), domain_(domain_of(grid)), isovalue_(isovalue) {
    for (int a = 0; a < 3; ++a) {
        domain_.origin[a] -= origin[a];
        face_[a] = {float(domain_.origin[a] + domain_.voxel_size * clip_.low[a]),
                    float(domain_.origin[a] + domain_.voxel_size * clip_.high[a])};
        clipped_ = clipped_ || std::isfinite(face_[a][0]) || std::isfinite(face_[a][1]);
    }
}

/// Converts a position along an axis, in voxels, to a fractional layer of the grid: the inverse of
/// LatticeClip::position(). The two differ only next to a face of the clip, because the layer that represents the face
/// is not exactly one voxel from the last layer inside. @param stretch  receives the derivative
double Level::lattice(int axis, double index, double& stretch) const {
    stretch = 1;
    for (const bool upper : {false, true}) {
        const double face = upper ? clip_.high[axis] : clip_.low[axis];
        if (std::isinf(face)) continue;
        const int layer = clip_.face_layer(axis, upper), inner = layer + (upper ? -1 : 1);
        if (upper ? index <= inner : index >= inner) continue;
        stretch = (layer - inner) / (face - inner);
        return inner + (index - inner) * stretch;
    }
    return index;
}

const Level::Cell& Level::cell_at(const openvdb::Coord& base) const {
    Cell& cell = cells_[std::size_t((base[0] & 3) * 16 + (base[1] & 3) * 4 + (base[2] & 3))];
    if (cell.base != base) {
        cell.base = base;
        load_cell(cell);
    }
    return cell;
}

void Level::load_cell(Cell& cell) const {
    const openvdb::Coord& base = cell.base;
    float v[4][4][4];  // values at the cell's corners and their neighbours along the axes; other entries are not read
    const auto fill = [&](const auto& value) {
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                for (int k = 0; k < 4; ++k)
                    if ((i % 3 == 0) + (j % 3 == 0) + (k % 3 == 0) < 2) v[i][j][k] = value(i - 1, j - 1, k - 1);
    };
    const int i = base[0] & 7, j = base[1] & 7, k = base[2] & 7;
    const auto* leaf = accessor_.probeConstLeaf(base);
    if (leaf != nullptr && std::min({i, j, k}) >= 1 && std::max({i, j, k}) <= 5) {
        const float* data = leaf->buffer().data() + detail::leaf_offset(i, j, k);
        fill([data](int x, int y, int z) { return data[64 * x + 8 * y + z]; });
    } else {
        fill([&](int x, int y, int z) { return accessor_.getValue(base.offsetBy(x, y, z)); });
    }
    for (int c = 0; c < 8; ++c) cell.corner[c] = v[1 + (c >> 2)][1 + (c >> 1 & 1)][1 + (c & 1)];
    const auto bend = [](double before, double from, double to, double after) {
        return minmod(before - 2 * from + to, from - 2 * to + after);
    };
    for (int q = 0; q < 4; ++q) {
        const int s = 1 + (q >> 1), t = 1 + (q & 1);
        cell.bend[0][q] = bend(v[0][s][t], v[1][s][t], v[2][s][t], v[3][s][t]);
        cell.bend[1][q] = bend(v[s][0][t], v[s][1][t], v[s][2][t], v[s][3][t]);
        cell.bend[2][q] = bend(v[s][t][0], v[s][t][1], v[s][t][2], v[s][t][3]);
    }
}

Level::Sample Level::sample(const Vec3& world) const {
    using openvdb::Coord;
    Vec3 at, stretch{1, 1, 1};
    for (int a = 0; a < 3; ++a) {
        at[a] = (world[a] - domain_.origin[a]) / domain_.voxel_size;
        if (clipped_) at[a] = lattice(a, at[a], stretch[a]);
    }
    const openvdb::Coord base(int(std::floor(at[0])), int(std::floor(at[1])), int(std::floor(at[2])));
    const Cell& cell = cell_at(base);
    const double t[3] = {at[0] - base[0], at[1] - base[1], at[2] - base[2]};

    const auto& v = cell.corner;
    double along_z[4], slope_z[4];
    for (int c = 0; c < 4; ++c) {
        slope_z[c] = v[2 * c + 1] - v[2 * c];
        along_z[c] = v[2 * c] + t[2] * slope_z[c];
    }
    const double low = along_z[0] + t[1] * (along_z[1] - along_z[0]),
                 high = along_z[2] + t[1] * (along_z[3] - along_z[2]);
    double value = low + t[0] * (high - low);
    Vec3 slope{high - low, (1 - t[0]) * (along_z[1] - along_z[0]) + t[0] * (along_z[3] - along_z[2]),
               (1 - t[0]) * ((1 - t[1]) * slope_z[0] + t[1] * slope_z[1]) +
                   t[0] * ((1 - t[1]) * slope_z[2] + t[1] * slope_z[3])};

    // Corrects the trilinear value: subtracts, for each axis, t (1 - t) / 2 times the second difference along it, where
    // t is the position in the cell, 0 to 1.
    for (int a = 0; a < 3; ++a) {
        const int b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
        const auto& bend = cell.bend[a];
        const double first = bend[0] + t[c] * (bend[1] - bend[0]), second = bend[2] + t[c] * (bend[3] - bend[2]);
        const double whole = first + t[b] * (second - first), weight = 0.5 * t[a] * (1 - t[a]);
        value -= weight * whole;
        slope[a] -= (0.5 - t[a]) * whole;
        slope[b] -= weight * (second - first);
        slope[c] -= weight * ((1 - t[b]) * (bend[1] - bend[0]) + t[b] * (bend[3] - bend[2]));
    }
    Sample result{value - isovalue_, slope};
    for (int a = 0; a < 3; ++a) result.gradient[a] *= stretch[a] / domain_.voxel_size;
    return result;
}

std::optional<Vec3> Level::project(const Vec3& world, unsigned held) const {
    const double h = domain_.voxel_size;
    Vec3 p = world;
    double gone = 0;
    for (int step = 0; step <= kSteps; ++step) {
        const Sample here = sample(p);
        Vec3 g = here.gradient;
        for (int a = 0; a < 3; ++a)
            if (held >> a & 1) g[a] = 0;
        const double steep = dot(g, g);
        if (std::abs(here.value) <= kConverged * h * std::sqrt(steep) || here.value == 0) return p;
        if (step == kSteps || !(steep > 0)) return {};
        const double whole = here.value / std::sqrt(steep);
        const double move = std::clamp(whole, -kCommon.precision_voxels * h, kCommon.precision_voxels * h);
        gone += std::abs(move);
        if (!(gone <= h)) return {};  // a zero more than a voxel away may belong to another sheet
        p = plus(p, -move / std::sqrt(steep), g);
    }
    return {};
}

double Level::distance(const Vec3& world) const {
    const Sample here = sample(world);
    // Value divided by slope. The slope of a distance is 1, but vanishes midway between two walls: the lower bound
    // prevents a division by 0 there.
    return std::abs(here.value) / std::max(length(here.gradient), kCommon.minority);
}

bool Level::is_farther(const Vec3& a, const Vec3& b, const Vec3& c, double voxels) const {
    bool farther = false;
    // Samples a voxel apart suffice, because the level set is interpolated within cells of this size.
    for_each_sample(a, b, c, voxel_size(),
                    [&](const Vec3& p) { farther = farther || distance(p) > voxels * voxel_size(); });
    return farther;
}

unsigned Level::faces(const Position& p) const {
    unsigned on = 0;
    for (int a = 0; a < 3; ++a) on |= unsigned(p[a] == face_[a][0] || p[a] == face_[a][1]) << a;
    return on;
}

bool Level::on_chamfer(const Position& p) const {
    int near = 0;
    for (int a = 0; a < 3; ++a)
        near += std::abs(p[a] - face_[a][0]) < kNearFace * domain_.voxel_size ||
                std::abs(p[a] - face_[a][1]) < kNearFace * domain_.voxel_size;
    return near > 1;
}

Surface::Surface(const FloatGrid& level_set, double isovalue, const Vec3& origin)
    : whole_(isovalue == 0 ? detail::uncut(level_set, detail::FaceLayer::OnFace) : std::nullopt),
      grid_(whole_ ? *whole_->distance : level_set),
      clip_(whole_ ? whole_->clip : detail::LatticeClip{}),
      isovalue_(isovalue),
      origin_(origin) {}

MeshDeviation Surface::deviation(const TriangleMesh& mesh) const {
    struct Sum {
        double max = 0, whole = 0, area = 0;
    };
    // Sums over pieces of a fixed size are added in a fixed order, so that the result is bitwise equal for any number
    // of threads.
    constexpr std::size_t kPiece = 4096;
    std::vector<Sum> sums((mesh.triangles.size() + kPiece - 1) / kPiece);
    tbb::parallel_for(std::size_t(0), sums.size(), [&](std::size_t piece) {
        const Level level = this->level();
        Sum& sum = sums[piece];
        for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, mesh.triangles.size()); ++n) {
            const Triangle& t = mesh.triangles[n];
            if ((level.faces(mesh.vertices[t[0]]) & level.faces(mesh.vertices[t[1]]) &
                 level.faces(mesh.vertices[t[2]])) != 0)
                continue;
            const Vec3 a = to_vec3(mesh.vertices[t[0]]), b = to_vec3(mesh.vertices[t[1]]),
                       c = to_vec3(mesh.vertices[t[2]]);
            double distances = 0;
            int count = 0;
            for_each_sample(a, b, c, level.voxel_size(), [&](const Vec3& p) {
                const double distance = level.distance(p);
                sum.max = std::max(sum.max, distance);
                distances += distance;
                ++count;
            });
            const double area = length(area_normal(a, b, c));
            sum.whole += area * distances / count;
            sum.area += area;
        }
    });
    Sum all;
    for (const Sum& sum : sums) all = {std::max(all.max, sum.max), all.whole + sum.whole, all.area + sum.area};
    const double h = level().voxel_size();
    return {all.max / h, all.area > 0 ? all.whole / all.area / h : 0.0};
}

std::vector<std::uint8_t> holds_of(const CornerTable& table, const Positions& positions, const Level& level) {
    std::vector<std::uint8_t> faces(positions.size()), holds(positions.size());
    for (std::size_t v = 0; v < faces.size(); ++v) faces[v] = std::uint8_t(level.faces(positions[v]));
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(holds.size()), [&](std::uint32_t v) {
        bool within = faces[v] != 0;
        table.around(v, [&](std::uint32_t c) {
            within = within && (faces[table.vertex(CornerTable::next(c))] & faces[v]) == faces[v];
        });
        holds[v] = faces[v];
        if (!within) holds[v] |= kOnLevel;
        if (level.on_chamfer(positions[v])) holds[v] |= kChamfer;
        if (table.corner_of(v) == CornerTable::kNone || table.is_boundary(v)) holds[v] |= kFixed;
    });
    return holds;
}

}  // namespace covol::meshing
