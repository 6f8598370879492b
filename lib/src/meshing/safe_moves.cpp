#include "meshing/safe_moves.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "base/heuristics.h"

namespace covol::meshing {

std::vector<std::uint32_t> restore(const CornerTable& table, const std::vector<std::uint32_t>& some,
                                   const Positions& before, Positions& after) {
    std::vector<std::uint32_t> changed;
    for (const std::uint32_t t : some)
        for (const std::uint32_t v : table.triangles()[t]) {
            if (after[v] == before[v]) continue;
            after[v] = before[v];
            table.around(v, [&](std::uint32_t c) { changed.push_back(c / 3); });
        }
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    return changed;
}

std::size_t move_where_free(TriangleMesh& mesh, const Positions& goal) {
    const CornerTable table(mesh.triangles, mesh.vertices.size());
    const Positions before = mesh.vertices;
    mesh.vertices = goal;
    std::vector<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    const auto turned = [&](std::uint32_t t) {
        return is_turned(mesh.triangles[t], before, mesh.vertices, kCommon.turn);
    };
    restore_all(table, those(all, turned), before, mesh.vertices, turned);
    ContactFinder finder(mesh.vertices, mesh.triangles);
    for (std::vector<ContactFinder::Pair> contacts = finder.contacts(table.is_closed()); !contacts.empty();) {
        std::vector<std::uint32_t> offending;
        for (const auto& [s, t] : contacts) {
            offending.push_back(s);
            offending.push_back(t);
        }
        const std::vector<std::uint32_t> changed = restore_all(table, offending, before, mesh.vertices, turned);
        finder.update();
        contacts = finder.contacts_of(changed);
        std::erase_if(contacts, [&](const ContactFinder::Pair& pair) {
            return !has_moved(mesh.triangles[pair.first], before, mesh.vertices) &&
                   !has_moved(mesh.triangles[pair.second], before, mesh.vertices);
        });
    }
    return std::transform_reduce(before.begin(), before.end(), mesh.vertices.begin(), std::size_t(0), std::plus<>(),
                                 std::equal_to<>());
}

}  // namespace covol::meshing
