#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "covol/study.h"
#include "study/refuse.h"
#include "study/study_json.h"

namespace covol {
namespace {

using nlohmann::json;
using act = StudyActions;

constexpr std::size_t kMaxKeyBytes = 100;
constexpr int kMaxWhole = 1 << 30;

using detail::refuse;

/// The fields of one JSON object. Errors name the field that is wrong.
class Fields {
public:
    explicit Fields(const json& object) : object_(object) {
        if (!object.is_object()) refuse("expected an object");
    }
    [[nodiscard]] bool has(const char* name) const { return object_.contains(name); }
    [[nodiscard]] const json& at(const char* name) const {
        const auto found = object_.find(name);
        if (found == object_.end()) refuse(std::string("expected a field '") + name + "'");
        return *found;
    }
    [[nodiscard]] StudyId id(const char* name) const {
        const json& value = at(name);
        if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMaxId)
            refuse(std::string("'") + name + "': expected a whole number from 1 to 2^53");
        return value.get<StudyId>();
    }
    [[nodiscard]] std::string text(const char* name) const {
        const json& value = at(name);
        if (!value.is_string()) refuse(std::string("'") + name + "': expected a string");
        return value.get<std::string>();
    }
    [[nodiscard]] bool flag(const char* name) const {
        const json& value = at(name);
        if (!value.is_boolean()) refuse(std::string("'") + name + "': expected true or false");
        return value.get<bool>();
    }
    /// A whole number from 0 to `maximum`.
    [[nodiscard]] int whole(const char* name, int maximum) const {
        const json& value = at(name);
        if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::uint64_t(maximum))
            refuse(std::string("'") + name + "': expected a whole number from 0 to " + std::to_string(maximum));
        return value.get<int>();
    }
    [[nodiscard]] double number(const char* name) const { return number_of(at(name), name); }
    [[nodiscard]] Vec3 place(const char* name) const { return place_of(at(name), name); }
    [[nodiscard]] std::vector<Vec3> places(const char* name) const {
        const json& value = at(name);
        if (!value.is_array()) refuse(std::string("'") + name + "': expected a list of positions");
        std::vector<Vec3> result;
        for (const json& place : value) result.push_back(place_of(place, name));
        return result;
    }
    [[nodiscard]] std::array<std::uint8_t, 3> color(const char* name) const {
        const json& value = at(name);
        std::array<std::uint8_t, 3> result{};
        const auto is_byte = [](const json& c) { return c.is_number_unsigned() && c.get<std::uint64_t>() <= 255; };
        if (!value.is_array() || value.size() != 3 || !std::all_of(value.begin(), value.end(), is_byte))
            refuse(std::string("'") + name + "': expected [red, green, blue] from 0 to 255");
        for (std::size_t c = 0; c < 3; ++c) result[c] = value[c].get<std::uint8_t>();
        return result;
    }

private:
    static constexpr std::uint64_t kMaxId = std::uint64_t(1) << 53;  // up to here a browser represents integers exactly

    static double number_of(const json& value, const char* name) {
        if (!value.is_number() || !std::isfinite(value.get<double>()))
            refuse(std::string("'") + name + "': expected a number");
        return value.get<double>();
    }
    static Vec3 place_of(const json& value, const char* name) {
        if (!value.is_array() || value.size() != 3) refuse(std::string("'") + name + "': expected [x, y, z]");
        return {number_of(value[0], name), number_of(value[1], name), number_of(value[2], name)};
    }

    const json& object_;
};

template <typename Enum>
Enum word_of(const std::string& name, const std::string& word, const char* expected) {
    for (std::size_t n = 0; n < kWords<Enum>.size(); ++n)
        if (word == kWords<Enum>[n]) return Enum(n);
    refuse("'" + name + "': expected " + expected + ", got '" + word.substr(0, kMaxKeyBytes) + "'");
}

MarkKind kind_of(const std::string& word) { return word_of<MarkKind>("kind", word, "surface, inside or outside"); }

StudyOutline read_outline(const Fields& f) {
    StudyOutline outline;
    outline.axis = int(std::min<StudyId>(f.at("axis") == 0 ? 0 : f.id("axis"), 3));
    outline.at = f.number("at");
    outline.closed = f.flag("closed");
    outline.world = f.places("world");
    return outline;
}

void write_outline(const StudyOutline& outline, json& j) {
    j["axis"] = outline.axis;
    j["at"] = outline.at;
    j["closed"] = outline.closed;
    j["world"] = outline.world;
}

/// The name of an action in JSON, and functions that read and write its fields. There is one specialisation for each
/// alternative of StudyAction, in the same order.
template <typename Action>
struct Form;

template <>
struct Form<act::AddStructure> {
    static constexpr const char* word = "add_structure";
    static act::AddStructure read(const Fields& f) {
        act::AddStructure a{f.text("name"), {}};
        if (f.has("color")) a.color = f.color("color");
        return a;
    }
    static void write(const act::AddStructure& a, json& j) {
        j["name"] = a.name;
        if (a.color) j["color"] = *a.color;
    }
};
template <>
struct Form<act::RemoveStructure> {
    static constexpr const char* word = "remove_structure";
    static act::RemoveStructure read(const Fields& f) { return {f.id("structure")}; }
    static void write(const act::RemoveStructure& a, json& j) { j["structure"] = a.structure; }
};
template <>
struct Form<act::Rename> {
    static constexpr const char* word = "rename";
    static act::Rename read(const Fields& f) { return {f.id("structure"), f.text("name")}; }
    static void write(const act::Rename& a, json& j) {
        j["structure"] = a.structure;
        j["name"] = a.name;
    }
};
template <>
struct Form<act::Recolor> {
    static constexpr const char* word = "recolor";
    static act::Recolor read(const Fields& f) { return {f.id("structure"), f.color("color")}; }
    static void write(const act::Recolor& a, json& j) {
        j["structure"] = a.structure;
        j["color"] = a.color;
    }
};
template <>
struct Form<act::Lock> {
    static constexpr const char* word = "lock";
    static act::Lock read(const Fields& f) { return {f.id("structure"), f.flag("locked")}; }
    static void write(const act::Lock& a, json& j) {
        j["structure"] = a.structure;
        j["locked"] = a.locked;
    }
};
template <>
struct Form<act::Show> {
    static constexpr const char* word = "show";
    static act::Show read(const Fields& f) { return {f.id("structure"), f.flag("visible")}; }
    static void write(const act::Show& a, json& j) {
        j["structure"] = a.structure;
        j["visible"] = a.visible;
    }
};
template <>
struct Form<act::Duplicate> {
    static constexpr const char* word = "duplicate";
    static act::Duplicate read(const Fields& f) { return {f.id("structure")}; }
    static void write(const act::Duplicate& a, json& j) { j["structure"] = a.structure; }
};
template <>
struct Form<act::AddMark> {
    static constexpr const char* word = "add_mark";
    static act::AddMark read(const Fields& f) { return {f.id("structure"), kind_of(f.text("kind")), f.place("world")}; }
    static void write(const act::AddMark& a, json& j) {
        j["structure"] = a.structure;
        j["kind"] = kWords<MarkKind>[std::size_t(a.kind)];
        j["world"] = a.world;
    }
};
template <>
struct Form<act::AddMarks> {
    static constexpr const char* word = "add_marks";
    static act::AddMarks read(const Fields& f) {
        act::AddMarks a{f.id("structure"), kind_of(f.text("kind")), f.places("world")};
        if (f.has("inside")) a.inside = f.places("inside");
        if (f.has("outside")) a.outside = f.places("outside");
        if (f.has("outlines")) {
            const json& outlines = f.at("outlines");
            if (!outlines.is_array()) refuse("'outlines': expected a list of objects");
            for (const json& one : outlines) a.outlines.push_back(read_outline(Fields(one)));
        }
        return a;
    }
    static void write(const act::AddMarks& a, json& j) {
        j["structure"] = a.structure;
        j["kind"] = kWords<MarkKind>[std::size_t(a.kind)];
        j["world"] = a.world;
        if (!a.inside.empty()) j["inside"] = a.inside;
        if (!a.outside.empty()) j["outside"] = a.outside;
        for (const StudyOutline& outline : a.outlines) write_outline(outline, j["outlines"].emplace_back());
    }
};
template <>
struct Form<act::MoveMark> {
    static constexpr const char* word = "move_mark";
    static act::MoveMark read(const Fields& f) { return {f.id("structure"), f.id("mark"), f.place("world")}; }
    static void write(const act::MoveMark& a, json& j) {
        j["structure"] = a.structure;
        j["mark"] = a.mark;
        j["world"] = a.world;
    }
};
template <>
struct Form<act::RemoveMark> {
    static constexpr const char* word = "remove_mark";
    static act::RemoveMark read(const Fields& f) { return {f.id("structure"), f.id("mark")}; }
    static void write(const act::RemoveMark& a, json& j) {
        j["structure"] = a.structure;
        j["mark"] = a.mark;
    }
};
template <>
struct Form<act::GiveMark> {
    static constexpr const char* word = "give_mark";
    static act::GiveMark read(const Fields& f) { return {f.id("structure"), f.id("mark"), f.id("to")}; }
    static void write(const act::GiveMark& a, json& j) {
        j["structure"] = a.structure;
        j["mark"] = a.mark;
        j["to"] = a.to;
    }
};
template <>
struct Form<act::AddOutline> {
    static constexpr const char* word = "add_outline";
    static act::AddOutline read(const Fields& f) { return {f.id("structure"), read_outline(f)}; }
    static void write(const act::AddOutline& a, json& j) {
        j["structure"] = a.structure;
        write_outline(a.outline, j);
    }
};
template <>
struct Form<act::RemoveOutline> {
    static constexpr const char* word = "remove_outline";
    static act::RemoveOutline read(const Fields& f) { return {f.id("structure"), f.id("mark")}; }
    static void write(const act::RemoveOutline& a, json& j) {
        j["structure"] = a.structure;
        j["mark"] = a.mark;
    }
};
template <>
struct Form<act::AddStroke> {
    static constexpr const char* word = "add_stroke";
    static act::AddStroke read(const Fields& f) {
        StudyStroke stroke;
        stroke.erases = f.flag("erases");
        stroke.radius = f.number("radius");
        if (f.has("axis")) {
            stroke.axis = f.whole("axis", 2);
            stroke.at = f.whole("at", kMaxWhole);
        }
        stroke.world = f.places("world");
        return {f.id("structure"), std::move(stroke)};
    }
    static void write(const act::AddStroke& a, json& j) {
        j["structure"] = a.structure;
        j["erases"] = a.stroke.erases;
        j["radius"] = a.stroke.radius;
        if (a.stroke.axis) {
            j["axis"] = *a.stroke.axis;
            j["at"] = a.stroke.at;
        }
        j["world"] = a.stroke.world;
    }
};
template <>
struct Form<act::ClearPaint> {
    static constexpr const char* word = "clear_paint";
    static act::ClearPaint read(const Fields& f) { return {f.id("structure")}; }
    static void write(const act::ClearPaint& a, json& j) { j["structure"] = a.structure; }
};
template <>
struct Form<act::SetGuess> {
    static constexpr const char* word = "set_guess";
    static act::SetGuess read(const Fields& f) {
        return {f.id("structure"), {f.text("path"), f.text("digest"), f.whole("label", kMaxWhole)}};
    }
    static void write(const act::SetGuess& a, json& j) {
        j["structure"] = a.structure;
        j["path"] = a.guess.path;
        j["digest"] = a.guess.digest;
        j["label"] = a.guess.label;
    }
};
template <>
struct Form<act::RemoveGuess> {
    static constexpr const char* word = "remove_guess";
    static act::RemoveGuess read(const Fields& f) { return {f.id("structure")}; }
    static void write(const act::RemoveGuess& a, json& j) { j["structure"] = a.structure; }
};
template <>
struct Form<act::AddLabels> {
    static constexpr const char* word = "add_labels";
    static act::AddLabels read(const Fields& f) {
        act::AddLabels a{f.text("path"), f.text("digest"), {}};
        const json& labels = f.at("labels");
        if (!labels.is_array()) refuse("'labels': expected a list of objects with 'label' and 'name'");
        for (const json& one : labels) {
            const Fields fields(one);
            a.labels.push_back({fields.whole("label", kMaxWhole), fields.text("name")});
        }
        return a;
    }
    static void write(const act::AddLabels& a, json& j) {
        j["path"] = a.path;
        j["digest"] = a.digest;
        j["labels"] = json::array();
        for (const auto& one : a.labels) j["labels"].push_back({{"label", one.label}, {"name", one.name}});
    }
};
template <>
struct Form<act::SetOptions> {
    static constexpr const char* word = "set_options";
    static act::SetOptions read(const Fields& f) {
        const Fields given(f.at("options"));
        act::SetOptions a;
        const auto number = [&](const char* name, std::optional<double>& value) {
            if (given.has(name)) value = given.number(name);
        };
        number("voxel_size", a.options.voxel_size);
        number("rho", a.options.rho);
        number("mark_precision", a.options.mark_precision);
        if (given.has("model")) a.options.model = word_of<Model>("model", given.text("model"), "guided or paper");
        return a;
    }
    static void write(const act::SetOptions& a, json& j) {
        json& to = j["options"] = json::object();
        if (a.options.voxel_size) to["voxel_size"] = *a.options.voxel_size;
        if (a.options.rho) to["rho"] = *a.options.rho;
        if (a.options.mark_precision) to["mark_precision"] = *a.options.mark_precision;
        if (a.options.model) to["model"] = kWords<Model>[std::size_t(*a.options.model)];
    }
};
template <>
struct Form<act::Undo> {
    static constexpr const char* word = "undo";
    static act::Undo read(const Fields& /*unused*/) { return {}; }
    static void write(const act::Undo& /*unused*/, json& /*unused*/) {}
};
template <>
struct Form<act::Redo> {
    static constexpr const char* word = "redo";
    static act::Redo read(const Fields& /*unused*/) { return {}; }
    static void write(const act::Redo& /*unused*/, json& /*unused*/) {}
};

template <typename... Actions>
StudyAction read_action(const std::string& word, const Fields& fields, const std::variant<Actions...>* /*types*/) {
    std::optional<StudyAction> found;
    ((word == Form<Actions>::word ? (found.emplace(Form<Actions>::read(fields)), true) : false) || ...);
    if (!found) refuse("'do': expected the name of an action, got '" + word.substr(0, kMaxKeyBytes) + "'");
    return *std::move(found);
}

void require_key(const std::string& key) {
    if (key.size() > kMaxKeyBytes || !std::all_of(key.begin(), key.end(), [](char c) { return c >= ' ' && c <= '~'; }))
        refuse("'key': expected at most 100 printable ASCII characters");
}

}  // namespace

namespace detail {

json parse_object(std::string_view text) {
    // Deep nesting would overflow the stack when the object is destroyed.
    constexpr int kDeepest = 8;
    bool is_deep = false;
    json object = json::parse(
        text,
        [&](int depth, json::parse_event_t, json&) {
            is_deep = is_deep || depth > kDeepest;
            return !is_deep;
        },
        false);
    if (object.is_discarded() || !object.is_object() || is_deep) refuse("expected one JSON object");
    return object;
}

}  // namespace detail

bool names_file(const StudyAction& action) {
    return std::holds_alternative<act::SetGuess>(action) || std::holds_alternative<act::AddLabels>(action);
}

KeyedAction parse_study_action(std::string_view text) {
    const json object = detail::parse_object(text);
    const Fields fields(object);
    KeyedAction result;
    if (fields.has("key")) result.key = fields.text("key");
    require_key(result.key);
    result.action = read_action(fields.text("do"), fields, static_cast<const StudyAction*>(nullptr));
    return result;
}

std::string to_json(const KeyedAction& keyed) {
    require_key(keyed.key);  // so that the written text can be read again
    json object;
    if (!keyed.key.empty()) object["key"] = keyed.key;
    std::visit(
        [&](const auto& action) {
            using Action = std::decay_t<decltype(action)>;
            object["do"] = Form<Action>::word;
            Form<Action>::write(action, object);
        },
        keyed.action);
    try {
        return object.dump();
    } catch (const json::exception&) {
        refuse("expected names and paths in UTF-8");
    }
}

}  // namespace covol
