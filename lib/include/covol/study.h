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

// Marks set by a person on one image: structures with their marks, and the journal of all actions that changed them.
namespace covol {

/// Numbers of structures, marks and outlines begin at 1 and are never reused, not even after an undo.
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
    int axis = 2;             ///< image axis perpendicular to the slice: 0, 1, 2 for i, j, k
    double at = 0;            ///< position of the slice along that axis, in voxels
    bool closed = true;       ///< true: the line encloses the structure; false: it lies on the structure's surface
    std::vector<Vec3> world;  ///< marks of the line
    bool operator==(const StudyOutline&) const = default;
};

/// Another program's result, which the marks of a structure correct.
struct StudyGuess {
    std::string path;    ///< a mask, label image, mesh or level set; if relative, from the study's folder
    std::string digest;  ///< digest_of() of the file
    int label = 0;       ///< of a mask; 0: its only label
    bool operator==(const StudyGuess&) const = default;
};

/// A stroke of a brush or an eraser: the voxels whose centres lie within the radius of a line.
struct StudyStroke {
    StudyId id = 0;
    bool erases = false;
    double radius = 1;  ///< world units, > 0
    /// image axis perpendicular to the slice `at`, on which the brush is a disc; none: the brush is a ball
    std::optional<int> axis;
    int at = 0;               ///< index of the slice along that axis
    std::vector<Vec3> world;  ///< vertices of the line; may be a single one
    bool operator==(const StudyStroke&) const = default;
};

struct StudyStructure {
    StudyId id = 0;
    std::string name;                     ///< unique within the study
    std::array<std::uint8_t, 3> color{};  ///< red, green, blue
    bool locked = false;                  ///< its marks cannot be changed
    bool visible = true;
    std::vector<StudyMark> marks;  ///< in the order in which they were set
    std::vector<StudyOutline> outlines;
    std::vector<StudyStroke> strokes;  ///< in the order in which they were painted
    std::optional<StudyGuess> guess;
    bool operator==(const StudyStructure&) const = default;

    /// Whether the structure has marks, outlines, strokes or a guess, from which a surface can be made.
    [[nodiscard]] bool has_evidence() const {
        return !marks.empty() || !outlines.empty() || !strokes.empty() || guess.has_value();
    }
    /// Whether both structures have the same input for their surfaces.
    [[nodiscard]] bool has_same_evidence(const StudyStructure& other) const {
        return marks == other.marks && outlines == other.outlines && strokes == other.strokes && guess == other.guess;
    }
};

/// Options for the segmentation of all structures of a study, which replace the automatic choices of SegmentOptions;
/// flags of the program override them.
struct StudyOptions {
    std::optional<double> voxel_size;      ///< world units, > 0
    std::optional<double> rho;             ///< EvolveOptions::rho, in [0,1]
    std::optional<double> mark_precision;  ///< SegmentOptions::mark_precision, world units, >= 0
    std::optional<Model> model;
    bool operator==(const StudyOptions&) const = default;

    [[nodiscard]] COVOL_API SegmentOptions applied_to(SegmentOptions options) const;
};

/// The structures of a study in their order. They are immutable and shared between states.
using StudyState = std::vector<std::shared_ptr<const StudyStructure>>;

/// The actions of a person. `structure` identifies the structure concerned; colours are chosen automatically if none is
/// given.
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
    /// One action for all marks of a file.
    struct AddMarks {
        StudyId structure = 0;
        MarkKind kind = MarkKind::Surface;
        std::vector<Vec3> world;  ///< marks of that kind
        std::vector<Vec3> inside = {}, outside = {};
        std::vector<StudyOutline> outlines = {};  ///< their ids are not used
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
        StudyOutline outline;  ///< its id is not used
    };
    struct RemoveOutline {
        StudyId structure = 0, mark = 0;
    };
    struct AddStroke {
        StudyId structure = 0;
        StudyStroke stroke;  ///< its id is not used
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
    /// Adds a structure for each label of another program's label image, with that label as its guess.
    struct AddLabels {
        std::string path, digest;  ///< as for StudyGuess
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

/// Whether the action contains the name of a file; such actions are not accepted from a page.
[[nodiscard]] COVOL_API bool names_file(const StudyAction& action);

/// An action with a key chosen by its sender; of several actions with the same key, only the first is applied.
struct KeyedAction {
    std::string key;  ///< at most 100 printable ASCII characters; empty: no key
    StudyAction action;
};

/// {"key":"...","do":"add_mark","structure":1,"kind":"surface","world":[x,y,z]}: docs/study.md describes all actions.
/// The text may come from an untrusted source.
/// @throws Error InvalidInput: the text is not a valid action.
[[nodiscard]] COVOL_API KeyedAction parse_study_action(std::string_view json);
/// @throws Error InvalidInput: an invalid key, or a text that is not UTF-8
[[nodiscard]] COVOL_API std::string to_json(const KeyedAction& action);

/// Structures and the unlimited history of actions on them, in memory only.
class COVOL_API StudyHistory {
public:
    /// @param image  in which marks have to lie
    explicit StudyHistory(const ImageGeometry& image);

    [[nodiscard]] const StudyState& state() const noexcept { return state_; }
    [[nodiscard]] const StudyOptions& options() const noexcept { return options_; }
    /// Null if there is no such structure.
    [[nodiscard]] std::shared_ptr<const StudyStructure> find(StudyId structure) const;
    [[nodiscard]] bool can_undo() const noexcept { return !done_.empty(); }
    [[nodiscard]] bool can_redo() const noexcept { return !undone_.empty(); }

    /// The effect of an action.
    struct Changed {
        std::vector<StudyId> structures;  ///< structures that were changed, added or removed; empty for an undo without
                                          ///< an action to undo
        StudyId made = 0;      ///< id of the first object (structure, mark, ...) that the action created; 0: none
        bool options = false;  ///< whether the options changed
    };
    /// Applies an action. The same actions in the same order give the same state, including ids.
    /// @throws Error InvalidInput: the action is impossible (no such structure, a name that is in use, a position
    ///     outside of the image, a locked structure), and nothing changed.
    Changed apply(const StudyAction& action) { return carry_out(plan(action)); }

    /// A change of one structure (`before` is null if it is added, `after` if it is removed) or of the options.
    struct Change {
        std::shared_ptr<const StudyStructure> before, after;
        std::size_t place = 0;  ///< index of the structure in the order of the structures
        std::optional<std::array<StudyOptions, 2>> options = {};  ///< before and after
    };
    /// A validated action. Between plan() and carry_out() the action is written to the disk.
    struct Step {
        enum class Kind { Do, Undo, Redo } kind = Kind::Do;
        std::vector<Change> changes;  ///< for Do
        StudyId last_id = 0;          ///< the last id in use after the step
    };
    /// @throws Error as apply().
    [[nodiscard]] Step plan(const StudyAction& action) const;
    /// @pre nothing was carried out after the step was planned
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

/// The image to which a study belongs, as recorded in its journal.
struct StudyImage {
    std::string path;  ///< if relative, from the study's folder
    ImageGeometry geometry;
};

/// A study on the disk: a folder with a journal, to which each action is appended and flushed before it takes effect.
/// Only one program at a time can open it.
///
/// The journal (docs/study.md) is JSON lines: the first one describes the image, the others are actions in their order.
/// An incomplete last line, due to a full disk or a power failure, is an action that was not confirmed; it is
/// discarded.
class COVOL_API Study {
public:
    /// Opens a study, or creates one.
    /// @param image  the study's image, whose geometry has to equal the geometry in the journal
    /// @throws Error Io (cannot be written; open in another program), InvalidInput (a damaged journal, another image).
    Study(std::string folder, const std::string& image_path, const ImageGeometry& image);
    ~Study();
    Study(Study&&) noexcept;
    Study& operator=(Study&&) = delete;

    [[nodiscard]] const std::string& folder() const noexcept { return folder_; }
    [[nodiscard]] const StudyHistory& history() const noexcept { return history_; }
    [[nodiscard]] const StudyState& state() const noexcept { return history_.state(); }
    /// Number of actions in the journal.
    [[nodiscard]] std::uint64_t sequence() const noexcept { return sequence_; }
    /// Message about an incomplete line that was discarded; empty: the journal was complete.
    [[nodiscard]] const std::string& repaired() const noexcept { return repaired_; }

    struct Applied {
        StudyHistory::Changed changed;
        /// false: an action with the same key was applied before, and nothing changed; Changed::made is then the id of
        /// the first object that the earlier action created
        bool is_new = true;
    };
    /// Applies an action, which is on the disk when this function returns. @throws Error InvalidInput (as
    /// StudyHistory::apply()), Io; in both cases nothing changes.
    Applied apply(const KeyedAction& action);

private:
    struct Journal;

    std::string folder_;
    StudyHistory history_;
    std::unique_ptr<Journal> journal_;
    std::unordered_map<std::string, StudyId> made_;  // ids of new objects by the keys of actions
    std::uint64_t sequence_ = 0;
    std::string repaired_;
};

/// Reads the path and the geometry of a study's image from its journal; the image itself is not read. Another program
/// may have the study open. @throws Error Io, InvalidInput.
[[nodiscard]] COVOL_API StudyImage read_study_image(const std::string& folder);
/// Reads the current structures of a study, which another program may have open. @throws Error Io, InvalidInput.
[[nodiscard]] COVOL_API StudyState read_study(const std::string& folder);

/// Reads the options of a study. @throws Error Io, InvalidInput.
[[nodiscard]] COVOL_API StudyOptions read_study_options(const std::string& folder);

/// What is needed to convert a study's structures to marks.
struct StudySite {
    ImageGeometry image;
    /// Reads a guess and checks its digest (open_study_site()). If it is empty, marks_of() throws for structures
    /// with a guess.
    std::function<GivenGuess(const StudyGuess&, const RunContext&)> read_guess;
};
/// Converts a structure to the input of segment_structures().
[[nodiscard]] COVOL_API Marks marks_of(const StudyStructure& structure, const StudySite& site);
/// Converts all structures with has_evidence(), in their order; structures with guesses from label images keep their
/// label values.
[[nodiscard]] COVOL_API std::vector<Marks> marks_of(const StudyState& state, const StudySite& site);

/// The paint of a structure as a label image of its bounding box, 1 where it is painted; none if nothing is painted.
[[nodiscard]] COVOL_API std::optional<Image> paint_of(const StudyStructure& structure, const ImageGeometry& image);

}  // namespace covol
