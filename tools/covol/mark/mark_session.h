#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "cli/output/json.h"
#include "covol/image.h"
#include "covol/intensity.h"
#include "covol/segment_structures.h"
#include "covol/study.h"
#include "covol/study_solver.h"
#include "mark/kept_surfaces.h"
#include "mark/page_image.h"
#include "serve/web_server.h"

namespace covol::tool {

/// The context without log and progress. Computations for a page use it, because the page itself shows their messages;
/// messages about the image were printed when it was read.
[[nodiscard]] RunContext quiet(RunContext run);

/// Settings of the page for a study.
struct MarkView {
    std::string page;        ///< HTML
    std::string title;       ///< the image's name
    SegmentOptions options;  ///< options of every structure; those of the study take precedence
    StudySite site;
    std::string image_digest;  ///< text that identifies the image, see KeptSurfaces()
};

/// One study on the page of `covol mark`: answers requests of the page, and sends it all changes. The messages are
/// documented in docs/mark_protocol.md.
class MarkSession {
public:
    using Send = std::function<void(serve::Client, std::string)>;
    using Broadcast = std::function<void(std::string)>;

    /// @param seen  the image for display
    /// @param image  returns the image for a computation; may be called from any thread
    MarkSession(Study study, std::unique_ptr<PageImage> seen, std::function<Image()> image, MarkView view,
                const RunContext& run);

    /// Sends all changes from now on, and solves the existing structures of the study. To be called once.
    void start(Send send, Broadcast broadcast);

    [[nodiscard]] serve::Response get(const serve::Request& request);
    /// Handles a file that the user selected on the page: marks, a guess, or a label image.
    [[nodiscard]] serve::Response post(const serve::Request& request, const std::string& body);
    void opened(serve::Client client);
    void message(serve::Client client, std::string_view text);

    /// The surfaces of all structures that have marks, identical to those of `covol segment --study`.
    [[nodiscard]] StructuresResult results();

private:
    struct Solved {
        std::shared_ptr<const StudyStructure> from;  ///< state that was passed to the solver last; null: none
        std::uint64_t requested = 0;                 ///< sequence number of the study at the last request to the solver
        Json reported;                               ///< the last result, as sent to pages; null: none
        std::uint64_t version = 0;
        std::shared_ptr<const SegmentResult> surface;  ///< surface with number `version`; null: none, or only `kept`
        std::shared_ptr<const TriangleMesh> kept;      ///< mesh with number `version` from an earlier session, or null
        bool is_refined = false;
        std::optional<IntensityStatistics> intensity;  ///< of the last refined surface
    };

    void receive(const StudyResult& result);
    void act(serve::Client client, std::string_view text);
    void suggest(serve::Client client, StudyId structure);
    void follow(const std::vector<StudyId>& structures);
    /// Applies an action, and sends the change to all pages. @pre `mutex_` is locked
    Study::Applied apply(const KeyedAction& action);
    void publish(const StudyHistory::Changed& changed);
    [[nodiscard]] SegmentOptions options() const { return study_.history().options().applied_to(view_.options); }
    /// The displayed mesh: that of the last result, or one kept from an earlier session; null if there is none.
    /// @pre `mutex_` is locked
    [[nodiscard]] static std::shared_ptr<const TriangleMesh> mesh_of(const Solved& solved);
    /// Displays the kept surface of a structure. @return whether there is one @pre `mutex_` is locked
    bool show_kept(const std::shared_ptr<const StudyStructure>& structure);
    [[nodiscard]] Json to_json(const StudyStructure& structure) const;
    [[nodiscard]] Json standing() const;
    [[nodiscard]] serve::Response mesh(const serve::Request& request) const;
    [[nodiscard]] serve::Response download(const serve::Request& request);

    const std::unique_ptr<PageImage> page_image_;
    const std::function<Image()> image_;  // for computing surfaces
    const ImageGeometry geometry_;
    const MarkView view_;
    const RunContext run_;
    const KeptSurfaces kept_;
    mutable std::mutex mutex_;
    Study study_;
    std::map<StudyId, Solved> solved_;
    Send send_;
    Broadcast broadcast_;
    std::unique_ptr<StudySolver> solver_;  // last: its thread must end before the members that it uses are destroyed
};

}  // namespace covol::tool
