#include "mesh/corner_table.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <numeric>
#include <string>

#include "covol/error.h"

namespace covol::meshing {

CornerTable::CornerTable(std::vector<Triangle>& triangles, std::size_t vertices)
    : triangles_(triangles),
      opposite_(corner_count(triangles.size()), kNone),
      corner_of_(vertices, kNone),
      on_boundary_(vertices, 0) {
    // Each corner c also numbers the side from vertex(c) to the next vertex of the triangle; `leaving` contains the
    // sides sorted by vertex(c).
    const auto corners = std::uint32_t(opposite_.size());
    std::vector<std::uint32_t> first(vertices + 1, 0), leaving(corners);
    for (std::uint32_t c = 0; c < corners; ++c) ++first[vertex(c) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
    for (std::uint32_t c = 0; c < corners; ++c) {
        leaving[fill[vertex(c)]++] = c;
        corner_of_[vertex(c)] = c;
    }
    std::atomic<std::uint32_t> twice = kNone;
    tbb::parallel_for(std::uint32_t(0), corners, [&](std::uint32_t c) {
        // The side opposite to c leads from vertex(next(c)) to vertex(previous(c)); in the adjacent triangle, the same
        // edge has the opposite direction, which is that of `from` and `to`.
        const std::uint32_t from = vertex(previous(c)), to = vertex(next(c));
        for (std::uint32_t n = first[from]; n < first[from + 1]; ++n) {
            if (vertex(next(leaving[n])) != to) continue;
            if (opposite_[c] != kNone) twice = c;
            opposite_[c] = previous(leaving[n]);
        }
        for (std::uint32_t n = first[to]; n < first[to + 1]; ++n)
            if (vertex(next(leaving[n])) == from && leaving[n] != next(c)) twice = c;
    });
    if (twice != kNone)
        throw Error(
            Errc::InvalidInput,
            "expected a consistently oriented manifold mesh, got several triangles on one side of the edge between "
            "the vertices " +
                std::to_string(vertex(next(twice))) + " and " + std::to_string(vertex(previous(twice))) +
                "; repair it first");
    for (std::uint32_t c = 0; c < corners; ++c) {
        if (opposite_[c] != kNone) continue;
        on_boundary_[vertex(next(c))] = on_boundary_[vertex(previous(c))] = 1;
        corner_of_[vertex(next(c))] = next(c);  // the vertex's first corner: no triangle follows clockwise
    }
}

bool CornerTable::adjacent(std::uint32_t v, std::uint32_t w) const {
    bool found = false;
    around(v, [&](std::uint32_t c) { found = found || vertex(next(c)) == w || vertex(previous(c)) == w; });
    return found;
}

int CornerTable::valence(std::uint32_t v) const {
    int triangles = 0;
    around(v, [&](std::uint32_t) { ++triangles; });
    return triangles;
}

bool CornerTable::can_flip(std::uint32_t corner) const {
    const std::uint32_t across = opposite_[corner];
    return across != kNone && vertex(corner) != vertex(across) && !adjacent(vertex(corner), vertex(across));
}

void CornerTable::flip(std::uint32_t corner) {
    const std::uint32_t c = corner, o = opposite_[c];
    const std::uint32_t a = vertex(next(c)), b = vertex(previous(c)), v = vertex(c), w = vertex(o);
    const std::uint32_t beyond_vb = opposite_[next(c)], beyond_wa = opposite_[next(o)];
    triangles_[c / 3][previous(c) % 3] = w;
    triangles_[o / 3][previous(o) % 3] = v;
    link(c, beyond_wa);
    link(o, beyond_vb);
    link(next(c), next(o));
    if (corner_of_[a] == previous(o)) corner_of_[a] = next(c);
    if (corner_of_[b] == previous(c)) corner_of_[b] = next(o);
}

void CornerTable::unflip(std::uint32_t corner) {
    const std::uint32_t c = corner, o = previous(opposite_[next(c)]);
    const std::uint32_t b = vertex(next(o)), a = vertex(next(c)), v = vertex(c), w = vertex(o);
    const std::uint32_t beyond_wa = opposite_[c], beyond_vb = opposite_[o];
    triangles_[c / 3][previous(c) % 3] = b;
    triangles_[o / 3][previous(o) % 3] = a;
    link(next(c), beyond_vb);
    link(next(o), beyond_wa);
    link(c, o);
    if (corner_of_[w] == previous(c)) corner_of_[w] = o;
    if (corner_of_[v] == previous(o)) corner_of_[v] = c;
    if (corner_of_[a] == next(c)) corner_of_[a] = previous(o);  // corner_of_ must be the first corner at a boundary
    if (corner_of_[b] == next(o)) corner_of_[b] = previous(c);
}

bool CornerTable::can_collapse(std::uint32_t corner) const {
    const std::uint32_t across = opposite_[corner], a = vertex(next(corner)), b = vertex(previous(corner));
    if (across == kNone || is_boundary(a) || is_boundary(b)) return false;
    const std::uint32_t v = vertex(corner), w = vertex(across);
    if (v == w) return false;
    int common = 0;
    around(a, [&](std::uint32_t c) { common += adjacent(b, vertex(next(c))); });
    // The two vertices opposite to the edge lose a triangle each; an inner vertex must keep at least three.
    return common == 2 && (is_boundary(v) || valence(v) > 3) && (is_boundary(w) || valence(w) > 3);
}

void CornerTable::collapse(std::uint32_t corner) {
    const std::uint32_t c = corner, o = opposite_[c];
    const std::uint32_t a = vertex(next(c)), b = vertex(previous(c)), v = vertex(c), w = vertex(o);
    std::vector<std::uint32_t> at_b;
    around(b, [&](std::uint32_t at) { at_b.push_back(at); });
    for (const std::uint32_t at : at_b) triangles_[at / 3][at % 3] = a;
    // c: (v, a, b), o: (w, b, a); the triangles beyond their other sides become adjacent.
    const std::uint32_t beyond_vb = opposite_[next(c)], beyond_va = opposite_[previous(c)];
    const std::uint32_t beyond_wa = opposite_[next(o)], beyond_wb = opposite_[previous(o)];
    link(beyond_vb, beyond_va);
    link(beyond_wa, beyond_wb);
    // Because the ends a and b of the edge are not on the boundary, these four sides have a triangle beyond them. If v
    // or w is on the boundary, its first corner is in another triangle and remains valid.
    const auto corner_beside = [&](std::uint32_t vertex_at, std::uint32_t beyond) {
        const std::uint32_t at = next(beyond);
        return vertex(at) == vertex_at ? at : previous(beyond);
    };
    corner_of_[a] = corner_beside(a, beyond_va);
    if (!is_boundary(v)) corner_of_[v] = corner_beside(v, beyond_va);
    if (!is_boundary(w)) corner_of_[w] = corner_beside(w, beyond_wa);
    corner_of_[b] = kNone;
    triangles_[c / 3] = triangles_[o / 3] = {kNone, kNone, kNone};
}

void remove_gone(std::vector<Triangle>& triangles, Positions& positions) {
    std::erase_if(triangles, [](const Triangle& t) { return t[0] == CornerTable::kNone; });
    std::vector<std::uint32_t> renumbered(positions.size(), CornerTable::kNone);
    for (const Triangle& t : triangles)
        for (const std::uint32_t v : t) renumbered[v] = 0;
    std::uint32_t count = 0;
    for (std::size_t v = 0; v < renumbered.size(); ++v) {
        if (renumbered[v] == CornerTable::kNone) continue;
        positions[count] = positions[v];
        renumbered[v] = count++;
    }
    positions.resize(count);
    for (Triangle& t : triangles)
        for (std::uint32_t& v : t) v = renumbered[v];
}

}  // namespace covol::meshing
