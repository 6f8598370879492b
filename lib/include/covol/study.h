#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <variant>
#include <vector>

#include "covol/api.h"
#include "covol/fwd.h"
#include "covol/image.h"
#include "covol/mark_kinds.h"
#include "covol/marks.h"
#include "covol/options_table.h"
#include "covol/pipeline.h"

// What a person marks on one image: structures with their marks, and everything that was done to them, in a journal.
namespace covol {

/// Numbers of structures, marks and outlines begin at 1 and are not used again, not even after an undo.
using StudyId = std::int64_t;

struct StudyMark {
    StudyId id = 0;
    MarkKind kind = MarkKind::Surface;
    Vec3 world{0, 0, 0};
    bool operator==(const StudyMark&) const = default;
};

/// A line on a slice of the image.
struct StudyOutline {
    StudyId id = 0;
    int axis = 2;        ///< of the image that the slice is perpendicular to: 0, 1, 2 for i, j, k
    double at = 0;       ///< the slice: voxels along that axis
    bool closed = true;  ///< it encloses the structure; an open one lies on its surface
    std::vector<Vec3> world;
    bool operator==(const StudyOutline&) const = default;
};

/// Another program's result that a structure's marks correct.
struct StudyGuess {
    std::string path;    ///< a mask, label image, mesh or level set; from the study's folder where it is relative
    std::string digest;  ///< digest_of() it
    int label = 0;       ///< of a mask; 0: its only one
    bool operator==(const StudyGuess&) const = default;
};

/// A stroke of a brush or an eraser: the voxels whose centres lie within the radius of a line.
struct StudyStroke {
    StudyId id = 0;
    bool erases = false;
    double radius = 1;        ///< world units, > 0
    std::optional<int> axis;  ///< of a disc, which stays on the slice `at` perpendicular to it; none: a ball
    int at = 0;               ///< voxels along that axis
    std::vector<Vec3> world;  ///< corners of the line; one is a dab
    bool operator==(const StudyStroke&) const = default;
};

struct StudyStructure {
    StudyId id = 0;
    std::string name;                     ///< unique within the study
    std::array<std::uint8_t, 3> color{};  ///< red, green, blue
    bool locked = false;                  ///< its marks do not change
    bool visible = true;
    std::vector<StudyMark> marks;  ///< in the order in which they were set
    std::vector<StudyOutline> outlines;
    std::vector<StudyStroke> strokes;  ///< in the order in which they were painted
    std::optional<StudyGuess> guess;
    bool operator==(const StudyStructure&) const = default;

    /// Whether there is anything that a surface can be made from.
    [[nodiscard]] bool has_evidence() const {
        return !marks.empty() || !outlines.empty() || !strokes.empty() || guess.has_value();
    }
    /// Whether both say the same of a surface.
    [[nodiscard]] bool has_same_evidence(const StudyStructure& other) const {
        return marks == other.marks && outlines == other.outlines && strokes == other.strokes && guess == other.guess;
    }
};

/// How all structures of a study are segmented, instead of what SegmentOptions chooses; the program's flags come first.
struct StudyOptions {
    std::optional<double> voxel_size;      ///< world units, > 0
    std::optional<double> rho;             ///< EvolveOptions::rho, in [0,1]
    std::optional<double> mark_precision;  ///< SegmentOptions::mark_precision, world units, >= 0
    std::optional<Model> model;
    bool operator==(const StudyOptions&) const = default;

    [[nodiscard]] COVOL_API SegmentOptions applied_to(SegmentOptions options) const;
};

/// Structures in their order. They are shared between states, and never change.
using StudyState = std::vector<std::shared_ptr<const StudyStructure>>;

/// What a person does. `structure` names the one that it is about; colours are chosen where none is given.
struct StudyActions {
    struct AddStructure {
        std::string name;
        std::optional<std::array<std::uint8_t, 3>> color;
    };
    struct RemoveStructure {
        StudyId structure = 0;
    };
    struct Rename {
        StudyId structure = 0;
        std::string name;
    };
    struct Recolor {
        StudyId structure = 0;
        std::array<std::uint8_t, 3> color{};
    };
    struct Lock {
        StudyId structure = 0;
        bool locked = true;
    };
    struct Show {
        StudyId structure = 0;
        bool visible = true;
    };
    struct Duplicate {
        StudyId structure = 0;
    };
    struct AddMark {
        StudyId structure = 0;
        MarkKind kind = MarkKind::Surface;
        Vec3 world{0, 0, 0};
    };
    /// One action for the marks of a file.
    struct AddMarks {
        StudyId structure = 0;
        MarkKind kind = MarkKind::Surface;
        std::vector<Vec3> world;  ///< of that kind
        std::vector<Vec3> inside = {}, outside = {};
        std::vector<StudyOutline> outlines = {};  ///< their own numbers are not used
    };
    struct MoveMark {
        StudyId structure = 0, mark = 0;
        Vec3 world{0, 0, 0};
    };
    struct RemoveMark {
        StudyId structure = 0, mark = 0;
    };
    struct GiveMark {
        StudyId structure = 0, mark = 0, to = 0;
    };
    struct AddOutline {
        StudyId structure = 0;
        StudyOutline outline;  ///< its own number is not used
    };
    struct RemoveOutline {
        StudyId structure = 0, mark = 0;
    };
    struct AddStroke {
        StudyId structure = 0;
        StudyStroke stroke;  ///< its own number is not used
    };
    struct ClearPaint {
        StudyId structure = 0;
    };
    struct SetGuess {
        StudyId structure = 0;
        StudyGuess guess;
    };
    struct RemoveGuess {
        StudyId structure = 0;
    };
    /// A structure for each label of another program's label image, which is its guess.
    struct AddLabels {
        std::string path, digest;  ///< as of StudyGuess
        struct Label {
            int label = 0;
            std::string name;
        };
        std::vector<Label> labels;
    };
    struct SetOptions {
        StudyOptions options;
    };
    struct Undo {};
    struct Redo {};
};

using StudyAction =
    std::variant<StudyActions::AddStructure, StudyActions::RemoveStructure, StudyActions::Rename, StudyActions::Recolor,
                 StudyActions::Lock, StudyActions::Show, StudyActions::Duplicate, StudyActions::AddMark,
                 StudyActions::AddMarks, StudyActions::MoveMark, StudyActions::RemoveMark, StudyActions::GiveMark,
                 StudyActions::AddOutline, StudyActions::RemoveOutline, StudyActions::AddStroke,
                 StudyActions::ClearPaint, StudyActions::SetGuess, StudyActions::RemoveGuess, StudyActions::AddLabels,
                 StudyActions::SetOptions, StudyActions::Undo, StudyActions::Redo>;

/// Whether the action names a file: what comes from a page may not.
[[nodiscard]] COVOL_API bool names_file(const StudyAction& action);

/// An action with the key that its sender made for it: one that comes twice is applied once.
struct KeyedAction {
    std::string key;  ///< at most 100 printable ASCII characters; empty: it has none
    StudyAction action;
};

/// {"key":"...","do":"add_mark","structure":1,"kind":"surface","world":[x,y,z]}: docs/study.md has all of them.
/// @throws Error InvalidInput: the text is no such action. It may come from anywhere.
[[nodiscard]] COVOL_API KeyedAction parse_study_action(std::string_view json);
/// @throws Error InvalidInput: a key that is none, or a text that is no UTF-8
[[nodiscard]] COVOL_API std::string to_json(const KeyedAction& action);

/// Structures and what was done to them, without limit; nothing of files.
class COVOL_API StudyHistory {
public:
    /// @param image  that marks have to lie in
    explicit StudyHistory(const ImageGeometry& image);

    [[nodiscard]] const StudyState& state() const noexcept { return state_; }
    [[nodiscard]] const StudyOptions& options() const noexcept { return options_; }
    /// Null: there is none.
    [[nodiscard]] std::shared_ptr<const StudyStructure> find(StudyId structure) const;
    [[nodiscard]] bool can_undo() const noexcept { return !done_.empty(); }
    [[nodiscard]] bool can_redo() const noexcept { return !undone_.empty(); }

    /// What an action did.
    struct Changed {
        std::vector<StudyId> structures;  ///< that changed, came or went; none: an undo of nothing
        StudyId made = 0;                 ///< the number of the first structure, mark or the like that is new; 0: none
        bool options = false;             ///< whether the options changed
    };
    /// The same actions in the same order give the same state, numbers included.
    /// @throws Error InvalidInput: it cannot be done (no such structure, a name that is in use, a place outside of the
    ///         image, a locked structure), and nothing changed.
    Changed apply(const StudyAction& action) { return carry_out(plan(action)); }

    /// Of one structure, where one of both may be null; or of the options.
    struct Change {
        std::shared_ptr<const StudyStructure> before, after;
        std::size_t place = 0;                                    ///< in the order
        std::optional<std::array<StudyOptions, 2>> options = {};  ///< before and after
    };
    /// An action that can be done: what is to be kept on the disk first is kept between plan() and carry_out().
    struct Step {
        enum class Kind { Do, Undo, Redo } kind = Kind::Do;
        std::vector<Change> changes;  ///< of Do
        StudyId last_id = 0;          ///< after it
    };
    /// @throws Error as apply().
    [[nodiscard]] Step plan(const StudyAction& action) const;
    /// @pre nothing was carried out since the step was planned
    Changed carry_out(Step step);

private:
    using Changes = std::vector<Change>;
    struct Planning;
    void put(const Changes& changes, bool forward);

    ImageGeometry image_;
    StudyState state_;
    StudyOptions options_;
    std::vector<Changes> done_, undone_;
    StudyId last_id_ = 0;
};

/// The image that a study belongs to, as its journal says.
struct StudyImage {
    std::string path;  ///< from the study's folder, where it is relative
    ImageGeometry geometry;
};

/// A study on the disk: a folder with a journal, to which each action is appended and flushed before it counts. One
/// program at a time has it open.
///
/// The journal (docs/study.md) is JSON lines: the first one names the image, the others are actions in their order. A
/// last line that was cut off, by a full disk or a power failure, is the action that was not confirmed: it is dropped.
class COVOL_API Study {
public:
    /// Opens a study, or begins one.
    /// @param image  its geometry has to be that of the journal
    /// @throws Error Io (cannot be written; open elsewhere), InvalidInput (a damaged journal, another image).
    Study(std::string folder, const std::string& image_path, const ImageGeometry& image);
    ~Study();
    Study(Study&&) noexcept;
    Study& operator=(Study&&) = delete;

    [[nodiscard]] const std::string& folder() const noexcept { return folder_; }
    [[nodiscard]] const StudyHistory& history() const noexcept { return history_; }
    [[nodiscard]] const StudyState& state() const noexcept { return history_.state(); }
    /// How many actions the journal holds.
    [[nodiscard]] std::uint64_t sequence() const noexcept { return sequence_; }
    /// What was left of a line that was cut off, in words; empty: the journal was whole.
    [[nodiscard]] const std::string& repaired() const noexcept { return repaired_; }

    struct Applied {
        StudyHistory::Changed changed;
        bool is_new = true;  ///< false: an action with this key had been applied before; `made` is what it made then
    };
    /// On the disk when this returns. @throws Error InvalidInput (as StudyHistory::apply()), Io: nothing changed.
    Applied apply(const KeyedAction& action);

private:
    struct Journal;

    std::string folder_;
    StudyHistory history_;
    std::unique_ptr<Journal> journal_;
    std::unordered_map<std::string, StudyId> made_;  // by the key of each action
    std::uint64_t sequence_ = 0;
    std::string repaired_;
};

/// The image of a study that is only read, by a program that has no page. @throws Error Io, InvalidInput.
[[nodiscard]] COVOL_API StudyImage read_study_image(const std::string& folder);
/// Its structures as they are now; another program may have it open. @throws Error Io, InvalidInput.
[[nodiscard]] COVOL_API StudyState read_study(const std::string& folder);

/// How all of its structures are segmented. @throws Error Io, InvalidInput.
[[nodiscard]] COVOL_API StudyOptions read_study_options(const std::string& folder);

/// What a study's structures need to become marks.
struct StudySite {
    ImageGeometry image;
    /// Reads a guess, and checks its digest (StudyFiles); none: structures with a guess are an error.
    std::function<GivenGuess(const StudyGuess&, const RunContext&)> read_guess;
};
/// What segment_structures() takes of a structure.
[[nodiscard]] COVOL_API Marks marks_of(const StudyStructure& structure, const StudySite& site);
/// Of all structures that have evidence, in their order; guesses of label images keep their labels.
[[nodiscard]] COVOL_API std::vector<Marks> marks_of(const StudyState& state, const StudySite& site);

/// The paint of a structure as a label image of the box around it, 1 where it is painted; none: nothing is.
[[nodiscard]] COVOL_API std::optional<Image> paint_of(const StudyStructure& structure, const ImageGeometry& image);

}  // namespace covol
