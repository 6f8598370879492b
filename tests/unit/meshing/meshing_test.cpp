// Tests of the parts of relaxation and decimation: adjacency, contacts, and moves that are undone.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "covol/error.h"
#include "covol/mesh_cleanup.h"
#include "covol/mesh_relax.h"
#include "mesh/corner_table.h"
#include "meshing/contacts.h"
#include "meshing/edge_collapser.h"
#include "meshing/safe_moves.h"
#include "support/random_solids.h"

using namespace covol;
using namespace covol::meshing;

namespace {

TriangleMesh solid_mesh(unsigned seed) { return extract_mesh(*test::random_solid(seed).level_set); }

/// Compares the table's opposite corners with those that are computed anew from the triangles that the table has not
/// marked as gone.
void check_table(const CornerTable& table, std::vector<Triangle> triangles) {
    std::vector<std::size_t> numbers;
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < triangles.size(); ++t)
        if (!table.is_gone(std::uint32_t(t))) {
            numbers.push_back(t);
            kept.push_back(triangles[t]);
        }
    const CornerTable fresh(kept, table.vertices());
    std::size_t wrong = 0;
    for (std::uint32_t c = 0; c < 3 * kept.size(); ++c) {
        const std::uint32_t o = fresh.opposite(c);
        const std::uint32_t expected = o == CornerTable::kNone ? o : std::uint32_t(3 * numbers[o / 3] + o % 3);
        wrong += table.opposite(std::uint32_t(3 * numbers[c / 3] + c % 3)) != expected;
    }
    CHECK(wrong == 0);
    std::size_t inconsistent = 0;
    for (std::uint32_t v = 0; v < table.vertices(); ++v) {
        inconsistent +=
            table.valence(v) != fresh.valence(v) || (fresh.valence(v) > 0 && table.vertex(table.corner_of(v)) != v);
        inconsistent += table.is_boundary(v) && fresh.valence(v) > 0 &&
                        table.opposite(CornerTable::previous(table.corner_of(v))) != CornerTable::kNone;
    }
    CHECK(inconsistent == 0);
}

TriangleMesh open_mesh() {
    TriangleMesh mesh = solid_mesh(1);
    double middle = 0;
    for (const auto& v : mesh.vertices) middle += v[2] / double(mesh.vertices.size());
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.vertices[v][2] < middle; });
    });
    return mesh;
}

}  // namespace

TEST_CASE("Corner table: flips, undone flips and collapses keep the adjacency consistent, also with a boundary") {
    for (TriangleMesh mesh : {solid_mesh(0), open_mesh()}) {
        REQUIRE(measure(mesh).manifold);
        CornerTable table(mesh.triangles, mesh.vertices.size());
        const std::vector<Triangle> before = mesh.triangles;
        std::mt19937 random(3);
        std::uniform_int_distribution<std::uint32_t> any(0, std::uint32_t(3 * mesh.triangles.size() - 1));
        std::vector<std::uint32_t> flipped;
        for (int n = 0; n < 2000; ++n)
            if (const std::uint32_t c = any(random); table.can_flip(c)) {
                table.flip(c);
                flipped.push_back(c);
            }
        REQUIRE(flipped.size() > 500);
        check_table(table, mesh.triangles);
        for (std::size_t n = flipped.size(); n-- > 0;) table.unflip(flipped[n]);
        CHECK(mesh.triangles == before);
        check_table(table, mesh.triangles);
        const int genus = measure(mesh).genus, components = measure(mesh).components;
        int collapsed = 0;
        for (int n = 0; n < 1000; ++n)
            if (const std::uint32_t c = any(random); !table.is_gone(c / 3) && table.can_collapse(c)) {
                table.collapse(c);
                ++collapsed;
            }
        REQUIRE(collapsed > 300);
        check_table(table, mesh.triangles);
        remove_gone(mesh.triangles, mesh.vertices);
        CHECK(mesh.triangles.size() == before.size() - 2 * std::size_t(collapsed));
        CHECK(measure(mesh).manifold);
        CHECK(measure(mesh).genus == genus);
        CHECK(measure(mesh).components == components);
    }
}

TEST_CASE("Corner table: an edge with three triangles is rejected") {
    std::vector<Triangle> fan{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
    CHECK_THROWS_AS(CornerTable(fan, 5), Error);
}

TEST_CASE("Contact test: no contact of random triangles is missed, and none is reported for separate ones") {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(0, 1);
    int touching = 0, false_alarms = 0;
    for (int n = 0; n < 4000; ++n) {
        // Two triangles that share 0, 1 or 2 corners, every third pair in one plane.
        TriangleMesh pair;
        const int shared = n % 3;
        const bool flat = n / 3 % 3 == 0;
        for (int v = 0; v < 6 - shared; ++v)
            pair.vertices.push_back({uniform(random), uniform(random), flat ? 0.5F : uniform(random)});
        const std::array<Triangle, 3> second{Triangle{3, 4, 5}, Triangle{3, 0, 4}, Triangle{1, 0, 3}};
        pair.triangles = {{0, 1, 2}, second[std::size_t(shared)]};
        const bool touch = count_self_intersections(pair) > 0;
        const bool apart = are_apart(pair.vertices, pair.triangles[0], pair.triangles[1]);
        INFO("pair " << n);
        REQUIRE_FALSE((touch && apart));
        touching += touch;
        false_alarms += !touch && !apart;
    }
    CHECK(touching > 500);
    CHECK(false_alarms == 0);
}

TEST_CASE("Contacts of a tangled mesh: more than 99 percent are confirmed by exact predicates") {
    for (const unsigned seed : {0U, 1U, 7U}) {
        TriangleMesh mesh = solid_mesh(seed);
        INFO("seed " << seed);
        // At most two contacts may be reported, because extracted triangles can be smaller than rounding errors.
        CHECK(ContactFinder(mesh.vertices, mesh.triangles).contacts(false).size() <= 2);
        std::mt19937 random(seed);
        std::normal_distribution<float> shift(
            0, float(std::sqrt(measure(mesh).area / double(mesh.triangles.size()))) * 0.4F);
        for (auto& v : mesh.vertices)
            for (float& c : v) c += shift(random);
        // The result is the same if no triangle is skipped for being part of a simple sheet (`true`).
        const auto contacts = ContactFinder(mesh.vertices, mesh.triangles).contacts(false);
        CHECK(contacts == ContactFinder(mesh.vertices, mesh.triangles).contacts(true));
        int touching = 0;
        for (const auto& [s, t] : contacts) {
            TriangleMesh pair{mesh.vertices, {mesh.triangles[s], mesh.triangles[t]}};
            touching += count_self_intersections(pair);
        }
        CHECK(touching > 0.99 * double(contacts.size()));
        std::vector<std::uint32_t> all;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) all.push_back(t);
        CHECK(ContactFinder(mesh.vertices, mesh.triangles).contacts_of(all) == contacts);
    }
}

TEST_CASE("Moves that would make triangles touch are undone, and the other moves are kept") {
    TriangleMesh mesh = solid_mesh(4);
    const Positions before = mesh.vertices;
    Positions goal = before;
    std::mt19937 random(2);
    std::normal_distribution<float> shift(0,
                                          float(std::sqrt(measure(mesh).area / double(mesh.triangles.size()))) * 0.2F);
    for (auto& v : goal)
        for (float& c : v) c += shift(random);
    TriangleMesh tangled = mesh;
    tangled.vertices = goal;
    REQUIRE(count_self_intersections(tangled) > 10);
    const std::size_t undone = move_where_free(mesh, goal);
    CHECK(count_self_intersections(mesh) == 0);
    CHECK(measure(mesh).closed);
    CHECK(undone > 0);
    CHECK(undone < before.size());
    for (std::size_t v = 0; v < before.size(); ++v)
        CHECK((mesh.vertices[v] == before[v] || mesh.vertices[v] == goal[v]));
}

TEST_CASE("Relaxation of an open mesh keeps its boundary and increases the smallest angle") {
    const auto solid = test::random_solid(1);
    TriangleMesh mesh = open_mesh();
    REQUIRE(measure(mesh).manifold);
    const CornerTable table(mesh.triangles, mesh.vertices.size());
    std::vector<Position> rim;
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
        if (table.is_boundary(v)) rim.push_back(mesh.vertices[v]);
    REQUIRE(rim.size() > 20);
    std::sort(rim.begin(), rim.end());
    const RelaxReport report = relax_mesh(mesh, *solid.level_set);
    CHECK(report.smallest_angle > 10 * report.smallest_angle_before);
    CHECK(measure(mesh).manifold);
    CHECK(count_self_intersections(mesh) == 0);
    const CornerTable after(mesh.triangles, mesh.vertices.size());
    std::vector<Position> rim_after;
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
        if (after.is_boundary(v)) rim_after.push_back(mesh.vertices[v]);
    std::sort(rim_after.begin(), rim_after.end());
    CHECK(rim_after == rim);
}

TEST_CASE("Relaxation: invalid options are rejected, and zero rounds leave the mesh unchanged") {
    const auto solid = test::random_solid(0);
    TriangleMesh mesh = extract_mesh(*solid.level_set);
    const TriangleMesh before = mesh;
    RelaxOptions options;
    options.rounds = 0;
    relax_mesh(mesh, *solid.level_set, options);
    CHECK(mesh.vertices == before.vertices);
    options.rounds = -1;
    options.tolerance = -1;
    CHECK_THAT(why_invalid(options), Catch::Contains("rounds") && Catch::Contains("tolerance"));
    CHECK_THROWS_AS(relax_mesh(mesh, *solid.level_set, options), Error);
}
