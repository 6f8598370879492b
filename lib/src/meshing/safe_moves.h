#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstdint>
#include <vector>

#include "covol/mesh.h"
#include "mesh/corner_table.h"
#include "meshing/contacts.h"

// Moves of vertices that are undone if triangles turn too far or touch.
namespace covol::meshing {

/// Whether a corner of the triangle has moved.
[[nodiscard]] inline bool has_moved(const Triangle& t, const Positions& before, const Positions& after) {
    return before[t[0]] != after[t[0]] || before[t[1]] != after[t[1]] || before[t[2]] != after[t[2]];
}

/// Whether the normal of the triangle turns by more than the angle with this cosine.
[[nodiscard]] inline bool is_turned(const Triangle& t, const Positions& before, const Positions& after, double cosine) {
    const Vec3 was = area_normal(before, t), is = area_normal(after, t);
    return has_moved(t, before, after) && !(dot(was, is) > cosine * length(was) * length(is));
}

/// The triangles among `some` for which bad(number) is true; `bad` is called from many threads.
template <typename Bad>
[[nodiscard]] std::vector<std::uint32_t> those(const std::vector<std::uint32_t>& some, const Bad& bad) {
    std::vector<std::uint8_t> found(some.size(), 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, some.size(), 1024), [&](const auto& range) {
        for (std::size_t n = range.begin(); n < range.end(); ++n) found[n] = bad(some[n]);
    });
    std::vector<std::uint32_t> result;
    for (std::size_t n = 0; n < some.size(); ++n)
        if (found[n] != 0) result.push_back(some[n]);
    return result;
}

/// Moves the corners of the triangles `some` back to `before`. @return all triangles that this changes, sorted
std::vector<std::uint32_t> restore(const CornerTable& table, const std::vector<std::uint32_t>& some,
                                   const Positions& before, Positions& after);

/// Moves the corners of the triangles `some` back to `before`, and then those of changed triangles for which
/// bad(number) is true, until there are none. bad(number) must be false for triangles at their positions in `before`.
/// @return the triangles that this changes
template <typename Bad>
std::vector<std::uint32_t> restore_all(const CornerTable& table, const std::vector<std::uint32_t>& some,
                                       const Positions& before, Positions& after, const Bad& bad) {
    std::vector<std::uint32_t> all, now = restore(table, some, before, after);
    for (; !now.empty(); now = restore(table, those(now, bad), before, after))
        all.insert(all.end(), now.begin(), now.end());
    return all;
}

/// Moves all vertices to `goal`, except those whose triangles would turn by more than the angle of kCommon.turn or
/// touch others that they did not touch before. @return the number of vertices that do not move. @throws Error
/// InvalidInput (a mesh that is not manifold)
std::size_t move_where_free(TriangleMesh& mesh, const Positions& goal);

}  // namespace covol::meshing
