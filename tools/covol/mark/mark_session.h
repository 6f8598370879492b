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
#include "covol/intensity.h"
#include "covol/segment_structures.h"
#include "covol/study.h"
#include "covol/study_solver.h"
#include "mark/kept_surfaces.h"
#include "mark/page_image.h"
#include "serve/web_server.h"

namespace covol::tool {

/// Says nothing: what there is to say of results stands on the page, and of the image it was said when it was read.
[[nodiscard]] RunContext quiet(RunContext run);

/// What a study is shown with.
struct MarkView {
    std::string page;        ///< HTML
    std::string title;       ///< the image's name
    SegmentOptions options;  ///< of every structure, where the study's own say nothing
    StudySite site;
    std::string image_digest;  ///< digest_of() the file and how it is read: what kept surfaces belong to
};

/// One study on the page of `covol mark`: answers what the page asks for, and tells it what changes.
/// docs/mark_protocol.md has the messages.
class MarkSession {
public:
    using Send = std::function<void(serve::Client, std::string)>;
    using Broadcast = std::function<void(std::string)>;

    /// @param seen  the image as pages see it
    /// @param image  gives the one that a job is computed with, from any thread
    MarkSession(Study study, std::unique_ptr<PageImage> seen, std::function<Image()> image, MarkView view,
                const RunContext& run);

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
        std::uint64_t requested = 0;                 ///< of the study, when that was to be solved
        Json reported;                               ///< the last result, as the page has it; null: none
        std::uint64_t version = 0;
        std::shared_ptr<const SegmentResult> surface;  ///< of that version; null: none, or it is kept
        std::shared_ptr<const TriangleMesh> kept;      ///< of that version, from when the study was open before
        bool is_refined = false;
        std::optional<IntensityStatistics> intensity;  ///< of the surface that was refined last
    };

    void receive(const StudyResult& result);
    void act(serve::Client client, std::string_view text);
    void suggest(serve::Client client, StudyId structure);
    void follow(const std::vector<StudyId>& structures);
    /// Applies an action, and tells all pages. @pre locked
    Study::Applied apply(const KeyedAction& action);
    void publish(const StudyHistory::Changed& changed);
    [[nodiscard]] SegmentOptions options() const { return study_.history().options().applied_to(view_.options); }
    /// The surface that is shown. @pre locked
    [[nodiscard]] static std::shared_ptr<const TriangleMesh> mesh_of(const Solved& solved);
    /// Whether what was kept is shown. @pre locked
    bool take_kept(const std::shared_ptr<const StudyStructure>& structure);
    [[nodiscard]] Json to_json(const StudyStructure& structure) const;
    [[nodiscard]] Json standing() const;
    [[nodiscard]] serve::Response mesh(const serve::Request& request) const;
    [[nodiscard]] serve::Response download(const serve::Request& request);

    const std::unique_ptr<PageImage> seen_;
    const std::function<Image()> image_;  // for the surfaces
    const ImageGeometry geometry_;
    const MarkView view_;
    const RunContext run_;
    const KeptSurfaces kept_;
    mutable std::mutex mutex_;
    Study study_;
    std::map<StudyId, Solved> solved_;
    Send send_;
    Broadcast broadcast_;
    std::unique_ptr<StudySolver> solver_;  // last: its thread ends before what it tells is gone
};

}  // namespace covol::tool
