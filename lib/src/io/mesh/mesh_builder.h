#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "covol/domain.h"
#include "covol/mesh.h"
#include "io/mesh/mesh_source.h"
#include "mesh/missing_vertex.h"
#include "mesh/polygon.h"
#include "mesh/triangle.h"

namespace covol::mesh_io {

using Face = std::array<std::uint32_t, 3>;

/// Builds a mesh from vertices and faces, and checks them.
class MeshBuilder final : public Receiver {
public:
    explicit MeshBuilder(const Source& source) : source_(source) {}

    [[nodiscard]] std::size_t vertex_count() const { return mesh_.vertices.size(); }

    [[nodiscard]] bool wants_faces() const override { return true; }
    void expect_vertices(std::size_t count, bool) override { mesh_.vertices.reserve(count); }

    void vertex(const Vec3& position) override {
        source_.check_finite(vertex_count(), float(position[0]), float(position[1]), float(position[2]));
        const std::array<float, 3> p = held(position);
        if (vertex_count() >= std::numeric_limits<std::uint32_t>::max()) source_.fail("more than 2^32 vertices");
        mesh_.vertices.push_back(p);
    }

    /// Converts a position to a vertex relative to the mesh's origin. If the first vertex is far from 0, the origin is
    /// a point near it with integer coordinates. Positions in single precision are not rounded, because their
    /// differences from the origin are representable in single precision, too.
    std::array<float, 3> held(const Vec3& position) {
        if (vertex_count() == 0) mesh_.origin = choose_mesh_origin({position, position}, 1);
        return {float(position[0] - mesh_.origin[0]), float(position[1] - mesh_.origin[1]),
                float(position[2] - mesh_.origin[2])};
    }

    /// Adds a face, cut into triangles. Triangles with a repeated corner have no area and are omitted.
    void face(const std::vector<std::uint32_t>& corners) override {
        if (corners.size() == 3) return triangle(corners[0], corners[1], corners[2]);
        for (const std::uint32_t v : corners)
            if (v >= vertex_count()) {  // vertex v may follow later in the file; finish() then adds the face
                waiting_.push_back(corners);
                return;
            }
        polygon(corners);
    }

    /// Adds the polygons that preceded their vertices in the file, and checks the indices of all triangles.
    TriangleMesh finish() {
        for (const std::vector<std::uint32_t>& corners : waiting_) {
            for (const std::uint32_t v : corners) check(v);
            polygon(corners);
        }
        for (const Face& t : mesh_.triangles)
            for (const std::uint32_t v : t) check(v);
        return std::move(mesh_);
    }

private:
    void check(std::uint32_t v) const {
        if (v >= vertex_count()) source_.fail("a face " + detail::refers_to_missing(v, vertex_count()));
    }
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a) mesh_.triangles.push_back({a, b, c});
    }
    void polygon(const std::vector<std::uint32_t>& corners) {
        if (corners.size() < 3) return;
        std::vector<Vec3> places;
        places.reserve(corners.size());
        for (const std::uint32_t v : corners) places.push_back(meshing::to_vec3(mesh_.vertices[v]));
        const auto pieces = meshing::cut_polygon(places);
        if (pieces.empty())
            source_.fail("expected concave faces of at most " + std::to_string(meshing::kMaxPolygonCorners) +
                         " corners, got one of " + std::to_string(corners.size()) +
                         "; triangulate the mesh in the program that made it");
        for (const auto& t : pieces) triangle(corners[t[0]], corners[t[1]], corners[t[2]]);
    }

    const Source& source_;
    TriangleMesh mesh_;
    std::vector<std::vector<std::uint32_t>> waiting_;  ///< polygons that refer to vertices not read yet
};

}  // namespace covol::mesh_io
