#include "covol/study.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "covol/error.h"

using namespace covol;
using act = StudyActions;
namespace fs = std::filesystem;

namespace {

ImageGeometry image_of(int size = 20) {
    ImageGeometry geometry;
    geometry.size = {size, size, size};
    return geometry;
}

/// A folder that is removed with this object.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("covol_study_" + std::to_string(::getpid()));
    Folder() { fs::remove_all(path); }
    ~Folder() { fs::remove_all(path); }
    [[nodiscard]] std::string text() const { return path.string(); }
    [[nodiscard]] fs::path journal() const { return path / "journal.jsonl"; }
};

std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

bool is_same(const StudyState& a, const StudyState& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) { return *x == *y; });
}

/// A random action, sensible or not.
StudyAction any_action(const StudyHistory& history, std::mt19937& rng) {
    const auto below = [&](std::size_t n) { return std::size_t(rng() % n); };
    // Some of the positions lie outside of the image.
    const auto place = [&] { return Vec3{double(below(20)), double(below(20)), double(below(22))}; };
    StudyId structure = 1 + StudyId(below(5)), to = structure, mark = 1;
    if (!history.state().empty() && below(10) > 0) {
        const StudyStructure& s = *history.state()[below(history.state().size())];
        structure = s.id;
        to = history.state()[below(history.state().size())]->id;
        if (!s.marks.empty()) mark = s.marks[below(s.marks.size())].id;
        if (s.marks.empty() && !s.outlines.empty()) mark = s.outlines[below(s.outlines.size())].id;
    }
    switch (below(33)) {
        case 0: return act::AddStructure{"s" + std::to_string(below(30)), {}};
        case 1: return act::RemoveStructure{structure};
        case 2: return act::Rename{structure, "t" + std::to_string(below(30))};
        case 3: return act::Recolor{structure, {std::uint8_t(below(256)), 2, 3}};
        case 4: return act::Lock{structure, below(4) == 0};
        case 5: return act::Show{structure, below(2) == 0};
        case 6: return act::Duplicate{structure};
        case 7: return act::MoveMark{structure, mark, place()};
        case 8: return act::RemoveMark{structure, mark};
        case 9: return act::GiveMark{structure, mark, to};
        case 10:
            return act::AddOutline{structure, {0, int(below(3)), double(below(20)), true, {place(), place(), place()}}};
        case 11: return act::RemoveOutline{structure, mark};
        case 24:
            return act::AddMarks{structure,
                                 MarkKind(below(3)),
                                 {place(), place(), place()},
                                 {place()},
                                 {},
                                 {{0, 1, 3, false, {place(), place()}}}};
        case 25:
        case 26: {
            StudyStroke stroke{0, below(3) == 0, 0.5 + double(below(4)), {}, 0, {place(), place()}};
            if (below(2) == 0) {
                stroke.axis = int(below(3));
                stroke.at = int(below(22));
            }
            return act::AddStroke{structure, stroke};
        }
        case 27: return act::ClearPaint{structure};
        case 28: return act::SetGuess{structure, {"../mask.nrrd", "xxh128:" + std::to_string(below(9)), int(below(3))}};
        case 29: return act::RemoveGuess{structure};
        case 30:
            return act::AddLabels{
                "l.nrrd", "xxh128:0", {{1, "l" + std::to_string(below(20))}, {2, "m" + std::to_string(below(20))}}};
        case 31: return act::SetOptions{{1.0 + double(below(3)), {}, {}, Model(below(2))}};
        case 12:
        case 13:
        case 14:
        case 15: return act::Undo{};
        case 16:
        case 17: return act::Redo{};
        default: return act::AddMark{structure, MarkKind(below(3)), place()};
    }
}

}  // namespace

TEST_CASE("Undo and redo restore every state, and a replay of all actions gives the same state") {
    const unsigned seed = GENERATE(1U, 2U, 3U);
    std::mt19937 rng(seed);
    StudyHistory history(image_of());
    std::vector<StudyAction> carried_out;
    std::vector<StudyState> states{history.state()};  // the stack of states, as undo goes back through them
    std::vector<StudyOptions> options{history.options()};
    std::size_t at = 0;
    int refused = 0;
    for (int n = 0; n < 5000; ++n) {
        const StudyAction action = any_action(history, rng);
        const StudyState before = history.state();
        try {
            (void)history.apply(action);
        } catch (const Error&) {
            REQUIRE(is_same(history.state(), before));
            ++refused;
            continue;
        }
        carried_out.push_back(action);
        if (std::holds_alternative<act::Undo>(action)) {
            if (at > 0) --at;
        } else if (std::holds_alternative<act::Redo>(action)) {
            if (at + 1 < states.size()) ++at;
        } else {
            states.resize(++at);
            states.push_back(history.state());
            options.resize(at);
            options.push_back(history.options());
        }
        REQUIRE(is_same(history.state(), states[at]));
        REQUIRE(history.options() == options[at]);
        REQUIRE(history.can_undo() == (at > 0));
        REQUIRE(history.can_redo() == (at + 1 < states.size()));
    }
    CHECK(refused > 100);
    CHECK(states.size() > 100);
    StudyHistory restored(image_of());
    for (const StudyAction& action : carried_out)
        restored.apply(
            parse_study_action(to_json({"", action})).action);  // written as text and parsed, as in the journal
    CHECK(is_same(restored.state(), history.state()));
    CHECK(restored.options() == history.options());
}

TEST_CASE("Options, guesses and labels are undone and redone, and invalid ones are rejected") {
    StudyHistory history(image_of());
    CHECK(history.apply(act::SetOptions{{0.5, 0.25, {}, Model::Paper}}).options);
    (void)history.apply(act::SetOptions{{}});
    CHECK(history.options() == StudyOptions{});
    CHECK(history.apply(act::Undo{}).options);
    CHECK(history.options().voxel_size == 0.5);
    SegmentOptions applied = history.options().applied_to({});
    CHECK(applied.voxel_size == 0.5);
    CHECK(applied.evolve.rho == 0.25);
    CHECK(applied.model == Model::Paper);
    (void)history.apply(act::Undo{});
    CHECK(history.options() == StudyOptions{});

    const auto made = history.apply(act::AddLabels{"../labels.nrrd", "xxh128:12", {{2, "two"}, {7, "seven"}}});
    CHECK(made.structures == std::vector<StudyId>{1, 2});
    REQUIRE(history.state().size() == 2);
    CHECK(history.state()[1]->guess == StudyGuess{"../labels.nrrd", "xxh128:12", 7});
    (void)history.apply(act::Undo{});
    CHECK(history.state().empty());
    (void)history.apply(act::Redo{});
    CHECK(history.state()[0]->name == "two");
    CHECK(history.state()[1]->name == "seven");
    CHECK_THROWS_AS(history.apply(act::AddLabels{"l", "d", {{1, "two"}}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddLabels{"l", "d", {{1, "a"}, {2, "a"}}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddLabels{"", "d", {{1, "a"}}}), Error);
    CHECK_THROWS_AS(history.apply(act::SetGuess{1, {"a", "", 0}}), Error);
    CHECK_THROWS_AS(history.apply(act::SetOptions{{0.0, {}, {}, {}}}), Error);
    CHECK_THROWS_AS(history.apply(act::SetOptions{{{}, 1.5, {}, {}}}), Error);
    CHECK(history.state().size() == 2);
    // The value of a label in the label image is also its value in masks.
    const std::vector<Marks> marks =
        marks_of(history.state(), {image_of(), [](const StudyGuess&, const RunContext&) { return GivenGuess{}; }});
    REQUIRE(marks.size() == 2);
    CHECK(marks[1].label == 7);
    CHECK_THROWS_AS(marks_of(history.state(), {image_of(), {}}), Error);
}

namespace {

/// The painted volume of the image.
double painted_volume(const StudyStructure& structure, const ImageGeometry& image) {
    const std::optional<Image> paint = paint_of(structure, image);
    if (!paint) return 0;
    double voxels = 0;
    const Index3 size = paint->geometry().size;
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i) voxels += paint->at(i, j, k);
    return voxels * image.spacing[0] * image.spacing[1] * image.spacing[2];
}

}  // namespace

TEST_CASE("A brush paints balls, discs and cylinders between positions, and an eraser removes them") {
    ImageGeometry image = image_of(60);
    image.spacing = {0.5, 0.5, 0.8};
    image.origin = {-4, 3, 1};
    image.direction = {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}};
    const auto at = [&](double i, double j, double k) { return image.index_to_world({i, j, k}); };
    StudyStructure structure;
    CHECK_FALSE(paint_of(structure, image));
    structure.strokes.push_back({1, false, 5, {}, 0, {at(30, 30, 30)}});
    const double ball = 4.0 / 3 * M_PI * 125;
    CHECK(painted_volume(structure, image) == Approx(ball).epsilon(0.03));
    // Painting the same position again adds nothing; a line adds a cylinder.
    structure.strokes.push_back({2, false, 5, {}, 0, {at(30, 30, 30), at(38, 30, 30)}});
    CHECK(painted_volume(structure, image) == Approx(ball + 25 * M_PI * 4).epsilon(0.03));
    structure.strokes.push_back({3, true, 100, {}, 0, {at(30, 30, 30)}});
    CHECK_FALSE(paint_of(structure, image));
    structure.strokes.push_back({4, false, 5, 2, 12, {at(30, 30, 12.4)}});
    CHECK(painted_volume(structure, image) == Approx(25 * M_PI * 0.8).epsilon(0.03));
    CHECK(paint_of(structure, image)->geometry().index_to_world({0, 0, 0})[2] < at(0, 0, 12)[2]);
    structure.strokes.push_back({5, true, 5, 0, 30, {at(30, 30, 12)}});
    CHECK(painted_volume(structure, image) == Approx(25 * M_PI * 0.8 - 10 * 0.5 * 0.8).epsilon(0.05));
}

TEST_CASE("A painted ball is round in world coordinates also if the image's axes are not perpendicular") {
    ImageGeometry image = image_of(60);
    const double lean = 0.6, steep = std::sqrt(1 - lean * lean);
    image.direction = {{{1, lean, 0}, {0, steep, 0.28}, {0, 0, 0.96}}};
    const double voxel = steep * 0.96;
    StudyStructure structure;
    structure.strokes.push_back({1, false, 9, {}, 0, {image.index_to_world({30, 30, 30})}});
    CHECK(painted_volume(structure, image) * voxel == Approx(4.0 / 3 * M_PI * 729).epsilon(0.02));
    structure.strokes = {{1, false, 9, 2, 30, {image.index_to_world({30, 30, 30})}}};
    CHECK(painted_volume(structure, image) * steep == Approx(81 * M_PI).epsilon(0.04));
}

TEST_CASE("Marks of a file are added by one action, with all kinds and lines") {
    StudyHistory history(image_of());
    (void)history.apply(act::AddStructure{"one", {}});
    const StudyOutline line{0, 2, 4, true, {{1, 1, 4}, {5, 1, 4}, {5, 6, 4}}};
    const act::AddMarks marks{1, MarkKind::Surface, {{1, 2, 3}}, {{4, 5, 6}}, {{7, 8, 9}, {1, 1, 1}}, {line}};
    // The action is written as its line in the journal, and parsed from it.
    const KeyedAction restored = parse_study_action(to_json({"k", marks}));
    (void)history.apply(restored.action);
    const StudyStructure& one = *history.state().front();
    REQUIRE(one.marks.size() == 4);
    CHECK(one.marks[1].kind == MarkKind::Inside);
    CHECK(one.marks[3].kind == MarkKind::Outside);
    CHECK(one.marks[3].world == Vec3{1, 1, 1});
    REQUIRE(one.outlines.size() == 1);
    CHECK(one.outlines[0].world == line.world);
    CHECK(one.outlines[0].id > one.marks[3].id);
    (void)history.apply(act::Undo{});
    CHECK(history.state().front()->marks.empty());
    CHECK(history.state().front()->outlines.empty());
    CHECK_THROWS_AS(history.apply(act::AddMarks{1, MarkKind::Surface, {}, {}, {}, {}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddMarks{1, MarkKind::Surface, {}, {{1, 1, 99}}, {}, {}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddMarks{1, MarkKind::Surface, {}, {}, {}, {{0, 2, 4, true, {{1, 1, 4}}}}}),
                    Error);
}

TEST_CASE("Strokes that are invalid or need too much time or memory are rejected, and nothing is painted") {
    ImageGeometry image = image_of(2000);
    StudyHistory history(image);
    (void)history.apply(act::AddStructure{"one", {}});
    const auto stroke = [](double radius, std::vector<Vec3> world) {
        return act::AddStroke{1, {0, false, radius, {}, 0, std::move(world)}};
    };
    CHECK_THROWS_WITH(history.apply(stroke(1e4, {{5, 5, 5}})), Catch::Matchers::Contains("too many voxels"));
    CHECK_THROWS_WITH(history.apply(stroke(1e-9, {{5, 5, 5}, {900, 5, 5}})),
                      Catch::Matchers::Contains("such a thin brush"));
    CHECK_THROWS_WITH(history.apply(stroke(0, {{5, 5, 5}})), Catch::Matchers::Contains("radius > 0"));
    CHECK_THROWS_WITH(history.apply(stroke(1, {})), Catch::Matchers::Contains("needs at least one position"));
    CHECK_THROWS_WITH(history.apply(stroke(1, {{5, 5, 5000}})), Catch::Matchers::Contains("outside of the image"));
    CHECK_THROWS_WITH(history.apply(act::AddStroke{1, {0, false, 1, 2, 2000, {{5, 5, 5}}}}),
                      Catch::Matchers::Contains("does not lie on a slice"));
    (void)history.apply(stroke(3, {{5, 5, 5}}));
    CHECK_THROWS_WITH(history.apply(stroke(3, {{1900, 1900, 1900}})), Catch::Matchers::Contains("268 million voxels"));
    CHECK(history.state().front()->strokes.size() == 1);
    CHECK_THROWS_AS(history.apply(act::ClearPaint{2}), Error);
    (void)history.apply(act::ClearPaint{1});
    CHECK_THROWS_WITH(history.apply(act::ClearPaint{1}), Catch::Matchers::Contains("has no paint"));
}

TEST_CASE("Paint becomes seeds of its own structure alone") {
    StudyHistory history(image_of(40));
    (void)history.apply(act::AddStructure{"one", {}});
    (void)history.apply(act::AddStructure{"two", {}});
    (void)history.apply(act::AddStroke{1, {0, false, 2, {}, 0, {{10, 10, 10}, {20, 10, 10}}}});
    (void)history.apply(act::AddMark{2, MarkKind::Surface, {30, 30, 30}});
    const std::vector<Marks> marks = marks_of(history.state(), {image_of(40), {}});
    REQUIRE(marks.size() == 2);
    REQUIRE(marks[0].paint.size() == 1);
    CHECK_FALSE(marks[0].paint[0].image->is_shared);
    SegmentOptions options;
    options.voxel_size = 1;
    const auto inputs = prepare_marks(marks, image_of(40), options);
    CHECK_FALSE(inputs[0].options.inside.empty());
    CHECK(inputs[1].options.outside.empty());
    CHECK(inputs[1].label == 2);
}

TEST_CASE("Actions that could not be read back are rejected and not written") {
    const Folder folder;
    Study study(folder.text(), "stack.tif", image_of());
    (void)study.apply({"a", act::AddStructure{"one", {}}});
    CHECK_THROWS_WITH(study.apply({"a\nb", act::AddStructure{"two", {}}}), Catch::Matchers::Contains("'key'"));
    CHECK_THROWS_WITH(study.apply({std::string(101, 'k'), act::AddStructure{"two", {}}}),
                      Catch::Matchers::Contains("'key'"));
    CHECK_THROWS_WITH(study.apply({"b", act::SetGuess{1, {"\xff.nrrd", "xxh128:0", 0}}}),
                      Catch::Matchers::Contains("UTF-8"));
    CHECK_THROWS_WITH(study.apply({"c", act::AddStructure{"\xc3", {}}}), Catch::Matchers::Contains("UTF-8"));
    CHECK(study.state().size() == 1);
    CHECK(is_same(read_study(folder.text()), study.state()));
}

TEST_CASE("names_file is true only for actions with a guess or labels") {
    CHECK(names_file(act::SetGuess{}));
    CHECK(names_file(act::AddLabels{}));
    CHECK_FALSE(names_file(act::AddMarks{}));
    CHECK_FALSE(names_file(act::RemoveGuess{}));
}

TEST_CASE("A reopened study has the same state, and an open study cannot be opened again") {
    const Folder folder;
    std::mt19937 rng(7);
    StudyState state;
    std::uint64_t sequence = 0;
    for (int session = 0; session < 4; ++session) {
        Study study(folder.text(), "stack.tif", image_of());
        CHECK(study.repaired().empty());
        CHECK(study.sequence() == sequence);
        CHECK(is_same(study.state(), state));
        for (int n = 0; n < 200; ++n) try {
                (void)study.apply(
                    {std::to_string(session) + "-" + std::to_string(n), any_action(study.history(), rng)});
            } catch (const Error&) {
            }
        state = study.state();
        sequence = study.sequence();
        CHECK(is_same(read_study(folder.text()), state));  // while it is open
        CHECK_THROWS_WITH(Study(folder.text(), "stack.tif", image_of()),
                          Catch::Matchers::Contains("another program has this study open"));
    }
    CHECK(sequence > 200);
    CHECK_THROWS_WITH(Study(folder.text(), "stack.tif", image_of(21)),
                      Catch::Matchers::Contains("image of another size"));
}

TEST_CASE("An action sent twice is applied once, also after the study is reopened") {
    const Folder folder;
    const KeyedAction add{"page-1", act::AddStructure{"nucleus", {}}};
    {
        Study study(folder.text(), "stack.tif", image_of());
        CHECK(study.apply(add).is_new);
        CHECK_FALSE(study.apply(add).is_new);
        CHECK(study.state().size() == 1);
    }
    Study study(folder.text(), "stack.tif", image_of());
    CHECK_FALSE(study.apply(add).is_new);
    CHECK(study.state().size() == 1);
    CHECK(study.sequence() == 1);
}

TEST_CASE("A truncated journal keeps all complete lines, and the study can be continued") {
    const Folder folder;
    {
        Study study(folder.text(), "stack.tif", image_of());
        (void)study.apply({"a", act::AddStructure{"one", {}}});
        for (int n = 0; n < 5; ++n)
            (void)study.apply({"m" + std::to_string(n), act::AddMark{1, MarkKind::Surface, {double(n), 1, 1}}});
    }
    const std::string whole = read(folder.journal());
    const std::size_t header = whole.find('\n') + 1;
    for (std::size_t bytes = header; bytes < whole.size(); ++bytes) {
        write(folder.journal(), whole.substr(0, bytes));
        const auto lines = std::uint64_t(std::count(whole.begin(), whole.begin() + std::ptrdiff_t(bytes), '\n')) - 1;
        Study study(folder.text(), "stack.tif", image_of());
        REQUIRE(study.sequence() == lines);
        REQUIRE(study.repaired().empty() == (whole[bytes - 1] == '\n'));
        (void)study.apply({"z", act::AddStructure{"two", {}}});
        REQUIRE(read_study(folder.text()).back()->name == "two");
    }
}

TEST_CASE("Damage before the last line of a journal is an error with the line number") {
    const Folder folder;
    {
        Study study(folder.text(), "stack.tif", image_of());
        (void)study.apply({"a", act::AddStructure{"one", {}}});
        (void)study.apply({"b", act::AddStructure{"two", {}}});
    }
    std::string text = read(folder.journal());
    text.replace(text.find("add_structure"), 3, "\x01zz");
    write(folder.journal(), text);
    CHECK_THROWS_WITH(Study(folder.text(), "stack.tif", image_of()), Catch::Matchers::Contains("line 2 is damaged"));
    CHECK_THROWS_WITH(read_study(folder.text()), Catch::Matchers::Contains("line 2 is damaged"));
    CHECK(read(folder.journal()) == text);
    write(folder.journal(), "this is no journal\n");
    CHECK_THROWS_WITH(Study(folder.text(), "stack.tif", image_of()),
                      Catch::Matchers::Contains("its first line is not that of one"));
    // A last line without a line end is not taken for a truncated line of a journal, and is not removed.
    write(folder.journal(), "somebody's notes");
    CHECK_THROWS_WITH(Study(folder.text(), "stack.tif", image_of()),
                      Catch::Matchers::Contains("its first line is not that of one"));
    CHECK(read(folder.journal()) == "somebody's notes");
    write(folder.journal(), "{\"covol_study\":1,\"ima");
    CHECK(Study(folder.text(), "stack.tif", image_of()).sequence() == 0);
    CHECK_THROWS_WITH(read_study_image(folder.text() + "/none"), Catch::Matchers::Contains("it does not exist"));
}

TEST_CASE("A study stores the path of its image relative to its own folder") {
    const Folder folder;
    { const Study study(folder.text(), (folder.path.parent_path() / "scans/stack.tif").string(), image_of()); }
    CHECK(read_study_image(folder.text()).path == "../scans/stack.tif");
    CHECK(read_study_image(folder.text()).geometry.size == Index3{20, 20, 20});
}

TEST_CASE("Texts and actions that are not valid are rejected") {
    for (const std::string text :
         {"",
          "{",
          "[]",
          "3",
          "{}",
          R"({"do":"sing"})",
          R"({"do":3})",
          R"({"do":"lock","structure":1,"locked":1})",
          R"({"do":"lock","structure":-1,"locked":true})",
          R"({"do":"lock","structure":1e300,"locked":true})",
          R"({"do":"add_mark","structure":1,"kind":"surface","world":[1,2]})",
          R"({"do":"add_mark","structure":1,"kind":"surface","world":[1,2,1e999]})",
          R"({"do":"add_mark","structure":1,"kind":"skin","world":[1,2,3]})",
          R"({"do":"recolor","structure":1,"color":[1,2,256]})",
          R"({"do":"set_options","options":3})",
          R"({"do":"set_options","options":{"rho":"a"}})",
          R"({"do":"set_options","options":{"model":"magic"}})",
          R"({"do":"add_stroke","structure":1,"erases":false,"radius":1,"axis":3,"at":1,"world":[[1,1,1]]})",
          R"({"do":"add_stroke","structure":1,"erases":false,"radius":1,"axis":1,"at":1.5,"world":[[1,1,1]]})",
          R"({"do":"add_labels","path":"a","digest":"b","labels":[1]})",
          R"({"do":"set_guess","structure":1,"path":"a","digest":"b","label":-1})",
          R"({"do":"undo","key":7})",
          "{\"do\":\"undo\",\"key\":\"a\\u0007\"}",
          R"({"do":"add_structure","name":"\ud800"})"})
        CHECK_THROWS_AS(parse_study_action(text), Error);
    CHECK_THROWS_AS(parse_study_action(std::string(1'000'000, '[')), Error);
    CHECK_THROWS_AS(parse_study_action("{\"do\":\"undo\",\"a\":" + std::string(1'000'000, '[')), Error);
    StudyHistory history(image_of());
    CHECK_THROWS_AS(history.apply(act::AddStructure{"", {}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddStructure{"a\nb", {}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddStructure{std::string(1000, 'a'), {}}), Error);
    (void)history.apply(act::AddStructure{"one", {}});
    CHECK_THROWS_AS(history.apply(act::AddMark{1, MarkKind::Surface, {1, 1, 25}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddMark{1, MarkKind::Surface, {1, 1, std::numeric_limits<double>::quiet_NaN()}}),
                    Error);
    CHECK_THROWS_AS(history.apply(act::AddOutline{1, {0, 2, 1, true, {{1, 1, 1}, {2, 1, 1}}}}), Error);
    CHECK_THROWS_AS(history.apply(act::AddOutline{1, {0, 3, 1, true, {{1, 1, 1}, {2, 1, 1}, {2, 2, 1}}}}), Error);
    CHECK(history.state().front()->marks.empty());
}

TEST_CASE("A structure of a study is converted to marks for segment_structures()") {
    StudyHistory history(image_of());
    (void)history.apply(act::AddStructure{"one", {}});
    (void)history.apply(act::AddStructure{"empty", {}});
    (void)history.apply(act::AddMark{1, MarkKind::Surface, {1, 2, 3}});
    (void)history.apply(act::AddMark{1, MarkKind::Inside, {4, 5, 6}});
    (void)history.apply(act::AddMark{1, MarkKind::Outside, {7, 8, 9}});
    (void)history.apply(act::AddOutline{1, {0, 2, 4, true, {{1, 1, 4}, {5, 1, 4}, {5, 5, 4}}}});
    const std::vector<Marks> marks = marks_of(history.state(), {image_of(), {}});
    REQUIRE(marks.size() == 1);
    CHECK(marks[0].name == "one");
    CHECK(marks[0].points == std::vector<Vec3>{{1, 2, 3}});
    REQUIRE(marks[0].inside.size() == 1);
    CHECK(marks[0].inside[0].points == std::vector<Vec3>{{4, 5, 6}});
    REQUIRE(marks[0].outside.size() == 1);
    REQUIRE(marks[0].contours.size() == 1);
    REQUIRE(marks[0].contours[0].lines.size() == 1);
    CHECK(marks[0].contours[0].lines[0].closed);
    CHECK(marks[0].contours[0].points.size() == 3);
    CHECK(marks[0].count == 4);
}
