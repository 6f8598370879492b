// Streams meshes from the tree to a file, one layer of leaves at a time.
#include <tbb/parallel_for.h>

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "base/disjoint_sets.h"
#include "base/file.h"
#include "covol/error.h"
#include "covol/mesh_stream.h"
#include "files/atomic.h"
#include "io/mesh/mesh_formats.h"
#include "io/mesh/mesh_stream.h"
#include "mesh/vertex_normals.h"
#include "redistance/no_surface.h"
#include "surface/marching_cubes.h"
#include "surface/mesh_pieces.h"

namespace covol {
namespace {

using meshing::Triangle;

/// The measures of measure(), for a mesh that arrives in pieces.
class Totals {
public:
    explicit Totals(std::uint64_t vertices) : vertices_(vertices), pieces_(vertices) {}

    void add(const detail::MeshPiece& piece) {
        if (piece.triangles.empty()) return;
        if (triangles_ == 0) origin_ = meshing::to_vec3(piece.positions[piece.triangles.front()[0] - piece.first]);
        triangles_ += piece.triangles.size();
        parts_.resize(piece.triangles.size());
        tbb::parallel_for(std::size_t(0), parts_.size(),
                          [&](std::size_t n) { parts_[n] = add(piece, piece.triangles[n]); });
        // Summed in the same order as in measure(), because the rounding of a sum depends on the order.
        for (const Part& part : parts_) {
            sum_.volume += part.volume;
            sum_.area += part.area;
            sum_.edges += part.edges;
        }
    }

    [[nodiscard]] MeshMeasures measures() {
        MeshMeasures m;
        m.volume = sum_.volume;
        m.area = sum_.area;
        for (std::uint32_t v = 0; v < vertices_; ++v) m.components += pieces_.root(v) == v;
        m.closed = sum_.edges == 0;
        m.manifold = m.closed;
        const auto euler = std::int64_t(vertices_) - std::int64_t(triangles_ / 2);
        m.genus = m.closed ? int(m.components - euler / 2) : -1;
        return m;
    }

private:
    struct Part {
        double volume = 0, area = 0;
        std::uint64_t edges = 0;
    };

    Part add(const detail::MeshPiece& piece, const Triangle& t) {
        Part part;
        std::array<Vec3, 3> p{};
        for (std::size_t k = 0; k < 3; ++k) p[k] = meshing::to_vec3(piece.positions[t[k] - piece.first]);
        part.volume = meshing::six_volumes(p, origin_) / 6;
        part.area = length(meshing::area_normal(p[0], p[1], p[2])) / 2;
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            part.edges += a < b ? mixed(a, b) : -mixed(b, a);
        }
        pieces_.unite(t[0], t[1]);
        pieces_.unite(t[1], t[2]);
        return part;
    }

    /// A hash of an edge by splitmix64 (https://prng.di.unimi.it/splitmix64.c). The sum of the hashes of all triangles'
    /// edges, with a sign for the direction, is 0 in a closed mesh; in others it is 0 with a probability of 2^-64.
    static std::uint64_t mixed(std::uint64_t low, std::uint64_t high) {
        std::uint64_t z = (low << 32 | high) + 0x9e3779b97f4a7c15;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
        z = (z ^ z >> 27) * 0x94d049bb133111eb;
        return z ^ z >> 31;
    }

    std::uint64_t vertices_, triangles_ = 0;
    Vec3 origin_{};
    Part sum_;
    std::vector<Part> parts_;  // for each triangle of a piece
    detail::DisjointSets pieces_;
};

/// Takes pieces of the mesh and writes their triangles and the vertices that no later triangle uses.
class Writer {
public:
    Writer(const std::string& temporary, const std::string& path, const StreamedMesh& mesh,
           const WriteMeshOptions& options)
        : options_(options),
          file_(mesh_io::MeshStream::open(temporary, path, mesh.vertices, mesh.triangles,
                                          mesh_io::placed(mesh.origin, options),
                                          mesh_io::one_line_each(options.comments))) {}

    void take(const detail::MeshPiece& piece) {
        for (std::size_t n = placed_.size(); n < piece.positions.size(); ++n) {
            placed_.push_back(mesh_io::placed(piece.positions[n], options_));
            sums_.push_back({0, 0, 0});
        }
        for (const Triangle& t : piece.triangles) {
            std::array<std::array<float, 3>, 3> corners{};
            std::array<Vec3, 3> there{};
            std::array<Vec3*, 3> sums{};
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t n = t[k] - piece.first;
                corners[k] = placed_[n];
                there[k] = meshing::to_vec3(corners[k]);
                sums[k] = &sums_[n];
            }
            meshing::add_normals(meshing::corner_normals(there), sums);
            file_->triangle(t, corners);
        }
        const auto done = std::ptrdiff_t(piece.done - piece.first);
        for (std::ptrdiff_t n = 0; n < done; ++n)
            file_->vertex(placed_[std::size_t(n)], meshing::unit_normal(sums_[std::size_t(n)]));
        placed_.erase(placed_.begin(), placed_.begin() + done);
        sums_.erase(sums_.begin(), sums_.begin() + done);
    }

    void finish() { file_->finish(); }

private:
    const WriteMeshOptions& options_;
    std::unique_ptr<mesh_io::MeshStream> file_;
    // Positions and sums of normals, both from the piece's first vertex on.
    std::vector<std::array<float, 3>> placed_;
    std::vector<Vec3> sums_;
};

/// Computes the mesh of a level set in pieces, and its measures.
/// @param begin  called with the numbers of vertices and triangles, before the first piece
StreamedMesh stream(const FloatGrid& surface, double isovalue, const RunContext& run,
                    const std::function<void(const StreamedMesh&)>& begin,
                    const std::function<void(const StreamedMesh&, const detail::MeshPiece&)>& take) {
    if (!std::isfinite(isovalue))
        throw Error(Errc::InvalidOptions, "isovalue: expected a finite number, got " + std::to_string(isovalue));
    StreamedMesh made;
    with_threads(run, [&] {
        std::optional<detail::Uncut> whole;
        if (isovalue == 0) whole = detail::uncut(surface, detail::FaceLayer::OnFace);
        detail::MarchingCubes cubes(whole ? *whole->distance : surface, whole ? whole->clip : detail::LatticeClip{},
                                    isovalue, run);
        std::optional<Totals> totals;
        cubes.stream(
            [&](std::uint64_t vertices, std::uint64_t triangles) {
                if (triangles == 0) throw NoSurface("grid '" + surface.getName() + "': no surface at this level");
                made.origin = cubes.origin();
                made.vertices = vertices;
                made.triangles = triangles;
                totals.emplace(vertices);
                begin(made);
            },
            [&](const detail::MeshPiece& piece) {
                totals->add(piece);
                take(made, piece);
            });
        made.measures = totals->measures();
    });
    return made;
}

}  // namespace

bool can_stream_mesh(const std::string& path) {
    const std::string end = detail::extension(path);
    return end == ".ply" || end == ".stl" || end == ".obj";
}

StreamedMesh stream_mesh(const std::string& path, const FloatGrid& surface, double isovalue,
                         const WriteMeshOptions& options, const RunContext& run) {
    require_valid(options, "stream_mesh");
    if (!options.binary || !options.attributes.empty())
        throw Error(Errc::Unsupported, "expected a binary file without attributes");
    StreamedMesh made;
    detail::write_atomically(path, [&](const std::string& temporary) {
        std::optional<Writer> writer;
        made = stream(
            surface, isovalue, run, [&](const StreamedMesh& mesh) { writer.emplace(temporary, path, mesh, options); },
            [&](const StreamedMesh&, const detail::MeshPiece& piece) { writer->take(piece); });
        writer->finish();
    });
    mesh_io::report_origin(path, made.origin, options);
    return made;
}

StreamedMesh measure_surface(const FloatGrid& surface, double isovalue, const RunContext& run) {
    return detail::measure_pieces(surface, isovalue, run, [](const StreamedMesh&, const detail::MeshPiece&) {});
}

StreamedMesh detail::measure_pieces(const FloatGrid& surface, double isovalue, const RunContext& run,
                                    const std::function<void(const StreamedMesh&, const MeshPiece&)>& take) {
    return stream(
        surface, isovalue, run, [](const StreamedMesh&) {}, take);
}

}  // namespace covol
