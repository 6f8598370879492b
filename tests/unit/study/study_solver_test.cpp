#include "covol/study_solver.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <mutex>
#include <vector>

#include "covol/segment_structures.h"

using namespace covol;

namespace {

using Stage = StudyResult::Stage;
constexpr int kSize = 40;
constexpr double kRadius = 9;
const Vec3 kCenter{20, 19, 21};

Image scene() {
    ImageGeometry geometry;
    geometry.size = {kSize, kSize, kSize};
    std::vector<float> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i) {
                const double d = std::hypot(i - kCenter[0], j - kCenter[1], k - kCenter[2]) - kRadius;
                values.push_back(float(100 * std::clamp(0.5 - d, 0.0, 1.0)));
            }
    return Image::from_values(geometry, values.data());
}

std::shared_ptr<const StudyStructure> ball(StudyId id, int count) {
    auto structure = std::make_shared<StudyStructure>();
    structure->id = id;
    structure->name = "ball " + std::to_string(id);
    for (int n = 0; n < count; ++n) {
        const double z = 1 - (2 * n + 1.0) / count, r = std::sqrt(1 - z * z), turn = 2.399963 * n;
        structure->marks.push_back({n + 1,
                                    MarkKind::Surface,
                                    {kCenter[0] + kRadius * r * std::cos(turn),
                                     kCenter[1] + kRadius * r * std::sin(turn), kCenter[2] + kRadius * z}});
    }
    return structure;
}

/// Records the results of a solver.
struct ResultRecorder {
    std::mutex mutex;
    std::vector<StudyResult> results;
    std::function<void(const StudyResult&)> on_result() {
        return [this](const StudyResult& result) {
            const std::lock_guard lock(mutex);
            results.push_back(result);
        };
    }
    [[nodiscard]] std::vector<StudyResult> of(StudyId structure, Stage stage) {
        const std::lock_guard lock(mutex);
        std::vector<StudyResult> found;
        std::copy_if(results.begin(), results.end(), std::back_inserter(found),
                     [&](const StudyResult& r) { return r.structure == structure && r.stage == stage; });
        return found;
    }
};

}  // namespace

TEST_CASE("A structure gets a first surface, and then the surface that segment_structures() computes") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    solver.solve(ball(3, 25), 11);
    solver.wait();
    const auto first = recorder.of(3, Stage::First), refined = recorder.of(3, Stage::Refined);
    REQUIRE(first.size() == 1);
    REQUIRE(refined.size() == 1);
    CHECK(first[0].version < refined[0].version);
    CHECK(refined[0].sequence == 11);
    REQUIRE(refined[0].surface);
    CHECK(solver.surface(3) == refined[0].surface);
    const StructuresResult expected = segment_structures(scene(), {marks_of(*ball(3, 25), {scene().geometry(), {}})});
    CHECK(refined[0].surface->mesh.vertices == expected.structures.front().result.mesh.vertices);
    CHECK(refined[0].surface->report.surface.volume == Approx(4.0 / 3 * M_PI * std::pow(kRadius, 3)).epsilon(0.05));
}

TEST_CASE("A confirmed structure is recomputed after all others, and without a first surface") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    solver.confirm(ball(1, 25), 5);
    solver.confirm(ball(2, 24), 5);
    solver.confirm(ball(3, 23), 5);
    solver.solve(ball(4, 22), 6);
    solver.solve(ball(3, 22), 7);  // replaces the confirmed state of structure 3
    solver.wait();
    CHECK(recorder.of(1, Stage::First).empty());
    REQUIRE(recorder.of(1, Stage::Refined).size() == 1);
    REQUIRE(recorder.of(3, Stage::Refined).size() == 1);
    CHECK(recorder.of(3, Stage::Refined)[0].sequence == 7);
    CHECK(recorder.of(2, Stage::Refined)[0].version > recorder.of(4, Stage::Refined)[0].version);
    const StructuresResult expected = segment_structures(scene(), {marks_of(*ball(1, 25), {scene().geometry(), {}})});
    CHECK(solver.surface(1)->mesh.vertices == expected.structures.front().result.mesh.vertices);
}

TEST_CASE("Too few marks are reported, and the previous surface is removed") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    solver.solve(ball(1, 20), 1);
    solver.wait();
    CHECK(solver.surface(1) != nullptr);
    solver.solve(ball(1, 3), 2);
    solver.wait();
    const auto empty = recorder.of(1, Stage::Empty);
    REQUIRE(empty.size() == 1);
    CHECK(empty[0].message == "1 more mark is needed for a surface");
    CHECK(solver.surface(1) == nullptr);
}

TEST_CASE("The first surface after a change is the last one, corrected to the marks") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    solver.solve(ball(1, 25), 1);
    solver.wait();
    auto moved = std::make_shared<StudyStructure>(*ball(1, 25));
    moved->marks.push_back({99, MarkKind::Surface, {kCenter[0] + kRadius + 2, kCenter[1], kCenter[2]}});
    solver.solve(moved, 2);
    solver.wait();
    const auto first = recorder.of(1, Stage::First);
    REQUIRE(first.size() == 2);
    CHECK(first[1].surface->correction != nullptr);
}

TEST_CASE("Every structure is finally solved with its newest marks, although earlier runs were cancelled") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    for (std::uint64_t n = 1; n <= 12; ++n)
        for (const StudyId id : {1, 2, 3}) solver.solve(ball(id, 15 + int(n)), n);
    solver.forget(2);
    solver.wait();
    CHECK(solver.surface(2) == nullptr);
    for (const StudyId id : {1, 3}) {
        const auto refined = recorder.of(id, Stage::Refined);
        REQUIRE_FALSE(refined.empty());
        CHECK(refined.back().sequence == 12);
        CHECK(refined.back().surface == solver.surface(id));
        CHECK(recorder.of(id, Stage::Failed).empty());
    }
}

TEST_CASE("A guess gives a surface without marks, and marks correct it as in segment_structures()") {
    ResultRecorder recorder;
    const ImageGeometry geometry = scene().geometry();
    std::vector<std::uint8_t> values;
    for (int k = 0; k < kSize; ++k)
        for (int j = 0; j < kSize; ++j)
            for (int i = 0; i < kSize; ++i)
                values.push_back(std::hypot(i - kCenter[0], j - kCenter[1], k - kCenter[2]) < kRadius - 2 ? 1 : 0);
    const Image mask = Image::from_values(geometry, values.data());
    const auto reader = [&](const StudyGuess& guess, const RunContext& /*unused*/) {
        CHECK(guess.path == "mask.nrrd");
        return make_guess(mask, 0, geometry);
    };
    StudySolver solver(scene, {}, recorder.on_result(), {}, reader);
    auto structure = std::make_shared<StudyStructure>();
    structure->id = 1;
    structure->name = "mask";
    structure->guess = StudyGuess{"mask.nrrd", "xxh128:0", 0};
    solver.solve(structure, 1);
    solver.wait();
    REQUIRE(recorder.of(1, Stage::Refined).size() == 1);
    const double volume = recorder.of(1, Stage::Refined)[0].surface->report.surface.volume;
    CHECK(std::cbrt(volume * 3 / (4 * M_PI)) == Approx(kRadius - 2).margin(0.3));
    auto corrected = std::make_shared<StudyStructure>(*structure);
    corrected->marks.push_back({2, MarkKind::Surface, {kCenter[0] + kRadius, kCenter[1], kCenter[2]}});
    solver.solve(corrected, 2);
    solver.wait();
    const StructuresResult expected = segment_structures(scene(), {marks_of(*corrected, {geometry, reader})});
    CHECK(recorder.of(1, Stage::Refined).back().surface->mesh.vertices ==
          expected.structures.front().result.mesh.vertices);
    CHECK(recorder.of(1, Stage::Refined).back().surface->correction != nullptr);
}

TEST_CASE("Paint on one slice requests a second one, and paint on three slices gives a surface") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    auto structure = std::make_shared<StudyStructure>();
    structure->id = 1;
    structure->name = "painted";
    const auto section_radius = [](int k) {
        return std::sqrt(kRadius * kRadius - (k - kCenter[2]) * (k - kCenter[2]));
    };
    structure->strokes.push_back({2, false, section_radius(20), 2, 20, {{kCenter[0], kCenter[1], 20}}});
    solver.solve(structure, 1);
    solver.wait();
    REQUIRE(recorder.of(1, Stage::Empty).size() == 1);
    CHECK(recorder.of(1, Stage::Empty)[0].message.starts_with("paint a second slice"));
    auto more = std::make_shared<StudyStructure>(*structure);
    for (const int k : {15, 25})
        more->strokes.push_back({k, false, section_radius(k), 2, k, {{kCenter[0], kCenter[1], double(k)}}});
    solver.solve(more, 2);
    solver.wait();
    REQUIRE(recorder.of(1, Stage::Refined).size() == 1);
    CHECK(recorder.of(1, Stage::Refined)[0].surface->report.surface.volume ==
          Approx(4.0 / 3 * M_PI * std::pow(kRadius, 3)).epsilon(0.1));
}

TEST_CASE("Changed options apply to the next surface") {
    ResultRecorder recorder;
    StudySolver solver(scene, {}, recorder.on_result());
    solver.solve(ball(1, 25), 1);
    solver.wait();
    SegmentOptions options;
    options.voxel_size = 2;
    solver.set_options(options);
    solver.solve(ball(1, 25), 2);
    solver.wait();
    const auto refined = recorder.of(1, Stage::Refined);
    REQUIRE(refined.size() == 2);
    CHECK(refined[0].surface->report.resolved.voxel_size == 1);
    CHECK(refined[1].surface->report.resolved.voxel_size == 2);
}

TEST_CASE("Destroying the solver stops its runs before they give a refined surface") {
    ResultRecorder recorder;
    {
        StudySolver solver(scene, {}, recorder.on_result());
        for (const StudyId id : {1, 2, 3, 4, 5}) solver.solve(ball(id, 30), 1);
    }
    CHECK(recorder.of(1, Stage::Refined).empty());
}
