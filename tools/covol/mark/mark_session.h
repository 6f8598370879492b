#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "cli/json.h"
#include "covol/image.h"
#include "covol/image_levels.h"
#include "covol/intensity.h"
#include "covol/segment_structures.h"
#include "covol/study.h"
#include "covol/study_solver.h"
#include "serve/web_server.h"

namespace covol::tool {

/// Says nothing: what there is to say of results stands on the page, and of the image it was said when it was read.
[[nodiscard]] RunContext quiet(RunContext run);

/// What a study is shown with.
struct MarkView {
    std::string page;   ///< HTML
    std::string title;  ///< the image's name
    bool is_anatomical = false;
    SegmentOptions options;  ///< of every structure, where the study's own say nothing
    StudySite site;
};

/// One study on the page of `covol mark`: answers what the page asks for, and tells it what changes.
/// docs/mark_protocol.md has the messages.
class MarkSession {
public:
    using Send = std::function<void(serve::Client, std::string)>;
    using Broadcast = std::function<void(std::string)>;

    /// @param image  gives the one that a job is computed with, from any thread
    MarkSession(Study study, ImageLevels levels, std::function<Image()> image, MarkView view, const RunContext& run);

    /// From here on all changes are told; the structures that the study has are solved. Called once.
    void start(Send send, Broadcast broadcast);

    [[nodiscard]] serve::Response get(const serve::Request& request);
    /// A file that a person chose on the page: marks, a guess, or a label image.
    [[nodiscard]] serve::Response post(const serve::Request& request, const std::string& body);
    void opened(serve::Client client);
    void message(serve::Client client, std::string_view text);

    /// The surfaces of all structures that have marks, as `covol segment --study` gives them.
    [[nodiscard]] StructuresResult results();

private:
    struct Solved {
        std::shared_ptr<const StudyStructure> from;  ///< with these marks
        Json told;                                   ///< the last result, as the page has it; null: none
        std::uint64_t version = 0;
        std::shared_ptr<const SegmentResult> surface;  ///< of that version; null: none
        bool is_refined = false;
        std::optional<IntensityStatistics> intensity;  ///< of the surface that was refined last
    };

    void hear(const StudyResult& result);
    void act(serve::Client client, std::string_view text);
    void suggest(serve::Client client, StudyId structure);
    void follow(const std::vector<StudyId>& structures);
    /// Applies an action, and tells all pages. @pre locked
    Study::Applied apply(const KeyedAction& action);
    void tell(const StudyHistory::Changed& changed);
    [[nodiscard]] SegmentOptions options() const { return study_.history().options().applied_to(view_.options); }
    [[nodiscard]] Json to_json(const StudyStructure& structure) const;
    [[nodiscard]] Json standing() const;
    [[nodiscard]] serve::Response image_facts() const;
    [[nodiscard]] serve::Response slice(const serve::Request& request) const;
    [[nodiscard]] serve::Response mesh(const serve::Request& request) const;
    [[nodiscard]] serve::Response download(const serve::Request& request);

    const ImageLevels levels_;            // for the eye
    const std::function<Image()> image_;  // for the surfaces
    const ImageGeometry geometry_;
    const MarkView view_;
    const RunContext run_;
    std::array<double, 2> range_{0, 1}, window_{0, 1};  // of brightness: coded; shown at first
    mutable std::mutex mutex_;
    Study study_;
    std::map<StudyId, Solved> solved_;
    Send send_;
    Broadcast broadcast_;
    std::unique_ptr<StudySolver> solver_;  // last: its thread ends before what it tells is gone
};

}  // namespace covol::tool
