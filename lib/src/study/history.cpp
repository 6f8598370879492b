#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "covol/structures.h"
#include "covol/study.h"
#include "study/paint.h"
#include "study/refuse.h"

namespace covol {
namespace {

constexpr std::size_t kMaxStructures = 10'000, kMaxMarks = 1'000'000, kMaxCorners = 100'000, kMaxNameBytes = 200,
                      kMaxStrokes = 100'000, kMaxPathBytes = 4096;

using detail::refuse;

void require_name(const std::string& name) {
    if (name.empty()) refuse("a structure needs a name");
    if (name.size() > kMaxNameBytes) refuse("expected a name of at most " + std::to_string(kMaxNameBytes) + " bytes");
    const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 127; };
    if (std::any_of(name.begin(), name.end(), is_control)) refuse("expected a name without control characters");
}

}  // namespace

StudyHistory::StudyHistory(const ImageGeometry& image) : image_(image) {}

std::shared_ptr<const StudyStructure> StudyHistory::find(StudyId structure) const {
    const auto found = std::find_if(state_.begin(), state_.end(), [&](const auto& s) { return s->id == structure; });
    return found != state_.end() ? *found : nullptr;
}

/// Computes the changes of an action; checks everything before anything changes.
struct StudyHistory::Planning {
    const StudyHistory& history;
    StudyId next;  ///< the number of the next new object

    [[nodiscard]] std::size_t place_of(StudyId structure) const {
        const StudyState& all = history.state_;
        const auto found = std::find_if(all.begin(), all.end(), [&](const auto& s) { return s->id == structure; });
        if (found == all.end()) refuse("there is no structure " + std::to_string(structure));
        return std::size_t(found - all.begin());
    }
    void require_free(const std::string& name, StudyId own = 0) const {
        for (const auto& s : history.state_)
            if (s->name == name && s->id != own) refuse("there is already a structure '" + name + "'");
    }
    void require_inside(const Vec3& world) const {
        const Vec3 index = history.image_.world_to_index(world);
        for (std::size_t a = 0; a < 3; ++a)
            if (!(index[a] >= -0.5 && index[a] <= history.image_.size[a] - 0.5))
                refuse("a position lies outside of the image");
    }
    static void require_file(const std::string& path, const std::string& digest) {
        if (path.empty() || path.size() > kMaxPathBytes || path.find('\0') != std::string::npos)
            refuse("expected a path of 1 to " + std::to_string(kMaxPathBytes) + " bytes");
        if (digest.empty() || digest.size() > kMaxNameBytes)
            refuse("expected a digest of the file, of 1 to " + std::to_string(kMaxNameBytes) + " bytes");
    }
    void require_outline(const StudyOutline& outline) const {
        const std::size_t fewest = outline.closed ? 3 : 2;
        if (outline.world.size() < fewest)
            refuse("expected an outline of at least " + std::to_string(fewest) + " corners, got " +
                   std::to_string(outline.world.size()));
        if (outline.world.size() > kMaxCorners)
            refuse("expected an outline of at most " + std::to_string(kMaxCorners) + " corners, got " +
                   std::to_string(outline.world.size()));
        if (outline.axis < 0 || outline.axis > 2 || !std::isfinite(outline.at))
            refuse("an outline does not lie on a slice");
        for (const Vec3& corner : outline.world) require_inside(corner);
    }
    static void require_room_for_marks(const StudyStructure& structure, std::size_t count) {
        if (count > kMaxMarks - std::min(structure.marks.size(), kMaxMarks))
            refuse("'" + structure.name + "': expected at most " + std::to_string(kMaxMarks) + " marks, got " +
                   std::to_string(structure.marks.size() + count));
    }
    void add_outline(StudyStructure& structure, const StudyOutline& outline) {
        if (structure.outlines.size() >= kMaxMarks)
            refuse("'" + structure.name + "' already has the maximum number of outlines, " + std::to_string(kMaxMarks));
        structure.outlines.push_back(outline);
        structure.outlines.back().id = next++;
    }
    /// The change of a structure by `edit`, which receives a copy of it.
    template <typename Edit>
    [[nodiscard]] Change edited(StudyId structure, bool may_be_locked, const Edit& edit) const {
        const std::size_t place = place_of(structure);
        const auto& before = history.state_[place];
        if (before->locked && !may_be_locked) refuse("'" + before->name + "' is locked");
        auto after = std::make_shared<StudyStructure>(*before);
        edit(*after);
        return {before, after, place};
    }
    void require_room_for_structures(std::size_t count) const {
        if (count > kMaxStructures - history.state_.size())
            refuse("expected at most " + std::to_string(kMaxStructures) + " structures, got " +
                   std::to_string(history.state_.size() + count));
    }
    [[nodiscard]] Change added(std::shared_ptr<StudyStructure> structure) {
        require_room_for_structures(1);
        structure->id = next++;
        return {nullptr, std::move(structure), history.state_.size()};
    }
    static std::vector<StudyMark>::iterator mark_in(StudyStructure& structure, StudyId mark) {
        const auto found = std::find_if(structure.marks.begin(), structure.marks.end(),
                                        [&](const StudyMark& m) { return m.id == mark; });
        if (found == structure.marks.end()) refuse("'" + structure.name + "' has no mark " + std::to_string(mark));
        return found;
    }

    Changes operator()(const StudyActions::AddStructure& a) {
        require_name(a.name);
        require_free(a.name);
        auto structure = std::make_shared<StudyStructure>();
        structure->name = a.name;
        structure->color = a.color.value_or(structure_color(history.state_.size()));
        return {added(std::move(structure))};
    }
    Changes operator()(const StudyActions::RemoveStructure& a) {
        const std::size_t place = place_of(a.structure);
        if (history.state_[place]->locked) refuse("'" + history.state_[place]->name + "' is locked");
        return {{history.state_[place], nullptr, place}};
    }
    Changes operator()(const StudyActions::Rename& a) {
        require_name(a.name);
        require_free(a.name, a.structure);
        return {edited(a.structure, true, [&](StudyStructure& s) { s.name = a.name; })};
    }
    Changes operator()(const StudyActions::Recolor& a) {
        return {edited(a.structure, true, [&](StudyStructure& s) { s.color = a.color; })};
    }
    Changes operator()(const StudyActions::Lock& a) {
        return {edited(a.structure, true, [&](StudyStructure& s) { s.locked = a.locked; })};
    }
    Changes operator()(const StudyActions::Show& a) {
        return {edited(a.structure, true, [&](StudyStructure& s) { s.visible = a.visible; })};
    }
    Changes operator()(const StudyActions::Duplicate& a) {
        auto copy = std::make_shared<StudyStructure>(*history.state_[place_of(a.structure)]);
        const std::string name = copy->name;
        const auto is_used = [&](const std::string& other) {
            return std::any_of(history.state_.begin(), history.state_.end(),
                               [&](const auto& s) { return s->name == other; });
        };
        for (int n = 2; is_used(copy->name); ++n) copy->name = name + " " + std::to_string(n);
        require_name(copy->name);
        copy->color = structure_color(history.state_.size());
        copy->locked = false;
        Change change = added(copy);
        for (StudyMark& m : copy->marks) m.id = next++;
        for (StudyOutline& o : copy->outlines) o.id = next++;
        for (StudyStroke& stroke : copy->strokes) stroke.id = next++;
        return {std::move(change)};
    }
    Changes operator()(const StudyActions::AddMark& a) {
        require_inside(a.world);
        return {edited(a.structure, false, [&](StudyStructure& s) {
            require_room_for_marks(s, 1);
            s.marks.push_back({next++, a.kind, a.world});
        })};
    }
    Changes operator()(const StudyActions::AddMarks& a) {
        const std::array<std::pair<MarkKind, const std::vector<Vec3>*>, 3> lists{
            {{a.kind, &a.world}, {MarkKind::Inside, &a.inside}, {MarkKind::Outside, &a.outside}}};
        std::size_t count = 0;
        for (const auto& [kind, places] : lists) {
            for (const Vec3& place : *places) require_inside(place);
            count += places->size();
        }
        if (count + a.outlines.size() == 0) refuse("expected marks, got none");
        for (const StudyOutline& outline : a.outlines) require_outline(outline);
        return {edited(a.structure, false, [&](StudyStructure& s) {
            require_room_for_marks(s, count);
            for (const auto& [kind, places] : lists)
                for (const Vec3& place : *places) s.marks.push_back({next++, kind, place});
            for (const StudyOutline& outline : a.outlines) add_outline(s, outline);
        })};
    }
    Changes operator()(const StudyActions::MoveMark& a) {
        require_inside(a.world);
        return {edited(a.structure, false, [&](StudyStructure& s) { mark_in(s, a.mark)->world = a.world; })};
    }
    Changes operator()(const StudyActions::RemoveMark& a) {
        return {edited(a.structure, false, [&](StudyStructure& s) { s.marks.erase(mark_in(s, a.mark)); })};
    }
    Changes operator()(const StudyActions::GiveMark& a) {
        if (a.structure == a.to) refuse("the mark already belongs to that structure");
        StudyMark mark;
        Change from = edited(a.structure, false, [&](StudyStructure& s) {
            const auto found = mark_in(s, a.mark);
            mark = *found;
            s.marks.erase(found);
        });
        Change to = edited(a.to, false, [&](StudyStructure& s) { s.marks.push_back(mark); });
        return {std::move(from), std::move(to)};
    }
    Changes operator()(const StudyActions::AddOutline& a) {
        require_outline(a.outline);
        return {edited(a.structure, false, [&](StudyStructure& s) { add_outline(s, a.outline); })};
    }
    Changes operator()(const StudyActions::RemoveOutline& a) {
        return {edited(a.structure, false, [&](StudyStructure& s) {
            if (std::erase_if(s.outlines, [&](const StudyOutline& o) { return o.id == a.mark; }) == 0)
                refuse("'" + s.name + "' has no outline " + std::to_string(a.mark));
        })};
    }
    Changes operator()(const StudyActions::AddStroke& a) {
        if (a.stroke.world.empty()) refuse("a stroke needs at least one position");
        if (a.stroke.world.size() > kMaxCorners)
            refuse("expected a stroke of at most " + std::to_string(kMaxCorners) + " corners, got " +
                   std::to_string(a.stroke.world.size()));
        for (const Vec3& corner : a.stroke.world) require_inside(corner);
        return {edited(a.structure, false, [&](StudyStructure& s) {
            if (s.strokes.size() >= kMaxStrokes)
                refuse("'" + s.name + "' already has the maximum number of strokes, " + std::to_string(kMaxStrokes));
            s.strokes.push_back(a.stroke);
            s.strokes.back().id = next++;
            detail::require_paintable(s, history.image_);
        })};
    }
    Changes operator()(const StudyActions::ClearPaint& a) {
        return {edited(a.structure, false, [&](StudyStructure& s) {
            if (s.strokes.empty()) refuse("'" + s.name + "' has no paint");
            s.strokes.clear();
        })};
    }
    Changes operator()(const StudyActions::SetGuess& a) {
        require_file(a.guess.path, a.guess.digest);
        return {edited(a.structure, false, [&](StudyStructure& s) { s.guess = a.guess; })};
    }
    Changes operator()(const StudyActions::RemoveGuess& a) {
        return {edited(a.structure, false, [&](StudyStructure& s) {
            if (!s.guess) refuse("'" + s.name + "' has no guess");
            s.guess.reset();
        })};
    }
    Changes operator()(const StudyActions::AddLabels& a) {
        require_file(a.path, a.digest);
        if (a.labels.empty()) refuse("expected labels, got none");
        require_room_for_structures(a.labels.size());
        Changes changes;
        std::set<std::string> names;
        for (const auto& one : a.labels) {
            require_name(one.name);
            require_free(one.name);
            if (!names.insert(one.name).second) refuse("two labels are called '" + one.name + "'");
            auto structure = std::make_shared<StudyStructure>();
            structure->name = one.name;
            structure->guess = StudyGuess{a.path, a.digest, one.label};
            structure->color = structure_color(history.state_.size() + changes.size());
            Change change = added(std::move(structure));
            change.place += changes.size();
            changes.push_back(std::move(change));
        }
        return changes;
    }
    Changes operator()(const StudyActions::SetOptions& a) {
        const auto is_number = [](const std::optional<double>& value, double minimum, double maximum) {
            return !value || (*value >= minimum && *value <= maximum);
        };
        constexpr double kSmallest = std::numeric_limits<double>::min(), kLargest = std::numeric_limits<double>::max();
        if (!is_number(a.options.voxel_size, kSmallest, kLargest)) refuse("'voxel_size': expected a number > 0");
        if (!is_number(a.options.rho, 0, 1)) refuse("'rho': expected a number from 0 to 1");
        if (!is_number(a.options.mark_precision, 0, kLargest)) refuse("'mark_precision': expected a number >= 0");
        Change change;
        change.options = {history.options_, a.options};
        return {std::move(change)};
    }
    Changes operator()(const StudyActions::Undo& /*unused*/) { return {}; }
    Changes operator()(const StudyActions::Redo& /*unused*/) { return {}; }
};

void StudyHistory::put(const Changes& changes, bool forward) {
    const auto put_one = [&](const Change& change) {
        if (change.options) {
            options_ = (*change.options)[forward ? 1 : 0];
            return;
        }
        const auto& before = forward ? change.before : change.after;
        const auto& after = forward ? change.after : change.before;
        const auto at = state_.begin() + std::ptrdiff_t(change.place);
        if (!before)
            state_.insert(at, after);
        else if (!after)
            state_.erase(at);
        else
            *at = after;
    };
    if (forward)
        std::for_each(changes.begin(), changes.end(), put_one);
    else
        std::for_each(changes.rbegin(), changes.rend(), put_one);
}

StudyHistory::Step StudyHistory::plan(const StudyAction& action) const {
    if (std::holds_alternative<StudyActions::Undo>(action)) return {Step::Kind::Undo, {}, last_id_};
    if (std::holds_alternative<StudyActions::Redo>(action)) return {Step::Kind::Redo, {}, last_id_};
    Planning planning{*this, last_id_ + 1};
    Changes changes = std::visit(planning, action);
    return {Step::Kind::Do, std::move(changes), planning.next - 1};
}

StudyHistory::Changed StudyHistory::carry_out(Step step) {
    const bool forward = step.kind != Step::Kind::Undo;
    std::vector<Changes>& to = forward ? done_ : undone_;
    Changed changed;
    if (step.kind == Step::Kind::Do) {
        if (step.last_id > last_id_) changed.made = last_id_ + 1;
        last_id_ = step.last_id;
        done_.push_back(std::move(step.changes));
        undone_.clear();
    } else {
        std::vector<Changes>& from = forward ? undone_ : done_;
        if (from.empty()) return changed;
        to.push_back(std::move(from.back()));
        from.pop_back();
    }
    put(to.back(), forward);
    for (const Change& c : to.back())
        if (c.options)
            changed.options = true;
        else
            changed.structures.push_back((c.before ? c.before : c.after)->id);
    return changed;
}

}  // namespace covol
