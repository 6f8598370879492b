#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "covol/mesh.h"
#include "io/mesh/mesh_source.h"

namespace covol::mesh_io {

using Face = std::array<std::uint32_t, 3>;

/// Makes triangles of vertices and faces, and checks them.
class MeshBuilder final : public Receiver {
public:
    explicit MeshBuilder(const Source& source) : source_(source) {}

    [[nodiscard]] std::size_t vertex_count() const { return mesh_.vertices.size(); }

    [[nodiscard]] bool wants_faces() const override { return true; }
    void expect_vertices(std::size_t count, bool) override { mesh_.vertices.reserve(count); }

    void vertex(const Vec3& position) override {
        if (vertex_count() == 0) choose_origin(position);
        std::array<float, 3> p{};
        for (int a = 0; a < 3; ++a) p[a] = float(position[a] - mesh_.origin[a]);
        source_.check_finite(vertex_count(), p[0], p[1], p[2]);
        if (vertex_count() >= std::numeric_limits<std::uint32_t>::max()) source_.fail("more than 2^32 vertices");
        mesh_.vertices.push_back(p);
    }

    /// A fan; pieces with a repeated corner have no area and are left out.
    void face(const std::vector<std::uint32_t>& corners) override {
        for (std::size_t i = 2; i < corners.size(); ++i)
            if (corners[0] != corners[i - 1] && corners[i - 1] != corners[i] && corners[i] != corners[0])
                mesh_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }

    /// Faces may come before the vertices that they name, so their numbers are checked here.
    TriangleMesh finish() {
        for (const Face& t : mesh_.triangles)
            for (const std::uint32_t v : t)
                if (v >= vertex_count())
                    source_.fail("a face refers to vertex " + std::to_string(v) + " (from 0), the file has " +
                                 std::to_string(vertex_count()));
        return std::move(mesh_);
    }

private:
    /// Coordinates far from 0 are kept from a whole number near the first vertex on: those in single precision without
    /// loss, for their differences are such numbers too.
    void choose_origin(const Vec3& first) {
        constexpr double kFar = 1 << 17;
        const bool is_far = std::any_of(first.begin(), first.end(), [](double c) { return std::abs(c) > kFar; });
        for (int a = 0; a < 3; ++a)
            if (is_far && std::isfinite(first[a])) mesh_.origin[a] = std::round(first[a]);
    }

    const Source& source_;
    TriangleMesh mesh_;
};

}  // namespace covol::mesh_io
