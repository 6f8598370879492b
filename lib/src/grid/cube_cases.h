#pragma once
#include <array>
#include <cstdint>

// The 256 cases of marching cubes as closed loops of edge vertices, derived instead of tabulated.
//
// Each face of a cube is cut by segments that depend only on the signs of its four corners, so that the two cubes that
// share a face agree. On a face with two inside corners on a diagonal, both are cut off: inside is 6-connected, outside
// 18-connected. Tracing the segments around a cube gives loops; each is filled by a fan of triangles around one of its
// vertices. The surface is a closed manifold without self-intersection for every input because:
// - a vertex lies strictly inside its edge, belongs to one loop in each of the four cubes around its edge, and a face
//   segment belongs to the two cubes that share its face. So the surface is closed, and the triangles around each
//   vertex form a single umbrella;
// - an apex is used only if none of its diagonals lies in a face. Then the fan meets the faces only in its segments,
//   and because the faces of a cube that do not contain the apex are seen from it without overlap, a fan does not
//   intersect itself;
// - two loops of one cube are separated by a plane: with inside corners cut off, different loops belong to inside
//   corners that no edge joins, or (one case) to two opposite outside corners.

namespace covol::detail {

/// Corner c of a cube lies at (c>>2 & 1, c>>1 & 1, c & 1). Edge e runs along axis e/4 from corner kEdgeStart[e].
inline constexpr std::array<std::uint8_t, 12> kEdgeStart{0, 1, 2, 3, 0, 1, 4, 5, 0, 2, 4, 6};
inline constexpr int edge_axis(int edge) { return edge / 4; }
inline constexpr int axis_bit(int axis) { return 4 >> axis; }
inline constexpr int edge_end(int edge) { return kEdgeStart[edge] | axis_bit(edge_axis(edge)); }

/// One loop of a case: its edges in order, counter-clockwise seen from outside (values >= isovalue).
struct CubeLoop {
    std::int8_t size = 0;
    std::array<std::int8_t, 12> edges{};
    std::uint16_t apexes = 0;  ///< bit i: a fan around edges[i] is allowed
};
struct CubeCase {
    std::int8_t loop_count = 0;
    std::int8_t triangle_count = 0;
    std::array<CubeLoop, 4> loops{};
};

namespace cube_detail {

constexpr int edge_between(int a, int b) {
    for (int e = 0; e < 12; ++e)
        if ((kEdgeStart[e] == a && edge_end(e) == b) || (kEdgeStart[e] == b && edge_end(e) == a)) return e;
    return -1;
}

constexpr bool on_face(int edge, int axis, int side) {
    const int bit = axis_bit(axis);
    return ((kEdgeStart[edge] & bit) != 0) == (side != 0) && ((edge_end(edge) & bit) != 0) == (side != 0);
}

constexpr bool have_common_face(int e, int f) {
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            if (on_face(e, axis, side) && on_face(f, axis, side)) return true;
    return false;
}

/// next[e]: the edge that follows e on its loop, -1 if the surface does not cut e.
constexpr std::array<int, 12> trace_faces(int inside) {
    std::array<int, 12> next{};
    next.fill(-1);
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            // The face's corners, counter-clockwise seen from outside the cube.
            const int u = axis_bit((axis + 1) % 3);
            const int v = axis_bit((axis + 2) % 3);
            const int base = side != 0 ? axis_bit(axis) : 0;
            const std::array<int, 4> ring = side != 0 ? std::array{base, base | u, base | u | v, base | v}
                                                      : std::array{base, base | v, base | u | v, base | u};
            // Each run of inside corners is cut off, from the edge where the walk enters it to the one where it leaves
            // it.
            for (int i = 0; i < 4; ++i) {
                const bool before = inside >> ring[i] & 1;
                const bool after = inside >> ring[(i + 1) % 4] & 1;
                if (before || !after) continue;
                int last = (i + 1) % 4;
                while (inside >> ring[(last + 1) % 4] & 1) last = (last + 1) % 4;
                next[edge_between(ring[i], ring[(i + 1) % 4])] = edge_between(ring[last], ring[(last + 1) % 4]);
            }
        }
    return next;
}

constexpr std::uint16_t allowed_apexes(const CubeLoop& loop) {
    std::uint16_t allowed = 0;
    for (int i = 0; i < loop.size; ++i) {
        bool good = true;
        for (int step = 2; step < loop.size - 1; ++step)
            good = good && !have_common_face(loop.edges[i], loop.edges[(i + step) % loop.size]);
        if (good) allowed |= std::uint16_t(1U << i);
    }
    return allowed;
}

constexpr CubeCase make_case(int inside) {
    CubeCase result;
    std::array<int, 12> next = trace_faces(inside);
    for (int first = 0; first < 12; ++first) {
        if (next[first] < 0) continue;
        CubeLoop& loop = result.loops[result.loop_count++];
        for (int e = first; next[e] >= 0;) {
            loop.edges[loop.size++] = std::int8_t(e);
            const int following = next[e];
            next[e] = -1;
            e = following;
        }
        loop.apexes = allowed_apexes(loop);
        result.triangle_count = std::int8_t(result.triangle_count + loop.size - 2);
    }
    return result;
}

constexpr std::array<CubeCase, 256> make_cases() {
    std::array<CubeCase, 256> cases{};
    for (int inside = 0; inside < 256; ++inside) cases[inside] = make_case(inside);
    return cases;
}

}  // namespace cube_detail

/// Indexed by the bits of the inside corners (value < isovalue).
inline constexpr std::array<CubeCase, 256> kCubeCases = cube_detail::make_cases();

constexpr bool every_loop_has_an_apex() {
    for (const CubeCase& c : kCubeCases)
        for (int i = 0; i < c.loop_count; ++i)
            if (c.loops[i].apexes == 0) return false;
    return true;
}
static_assert(every_loop_has_an_apex());

}  // namespace covol::detail
