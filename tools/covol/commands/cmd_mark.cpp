#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <latch>
#include <limits>
#include <memory>
#include <optional>
#include <thread>

#include "cli/system/cancel_signals.h"
#include "commands/commands.h"
#include "commands/mark_call.h"
#include "covol/digest.h"
#include "covol/error.h"
#include "covol/image_levels.h"
#include "covol/safe_text.h"
#include "covol/study_files.h"
#include "covol/version.h"
#include "flags/bindings.h"
#include "jobs/page.h"
#include "mark/bounded_image.h"
#include "mark/browser.h"
#include "mark/imports.h"
#include "mark/mark_session.h"
#include "mark/page.h"
#include "mark/page_image.h"
#include "serve/web_server.h"

namespace covol::tool {
namespace {

/// The beginning of the content security policy in the page. It allows only the page's own script and style, by their
/// digests, and connections to this server.
constexpr const char* kPolicyBegins = "<meta http-equiv=\"Content-Security-Policy\" content=\"";

std::string policy_of(const std::string& page) {
    const std::size_t begin = page.find(kPolicyBegins) + std::string_view(kPolicyBegins).size();
    return page.substr(begin, page.find('"', begin) - begin);
}

/// Maximum size, in bytes, of the decoded chunks in the cache for slices. For example, an image of 2048^3 voxels of 8
/// bits has 1024^3 voxels at the level with half the resolution. A slice of that level, in chunks of 128^3 voxels,
/// passes through 8 x 8 chunks, or 128 MiB.
constexpr std::uint64_t kMaxSliceBytes = std::uint64_t(512) << 20;

/// Maximum size, in bytes, of the decoded chunks that are kept for computing surfaces; see BoundedImage.
constexpr std::uint64_t kMaxJobBytes = std::uint64_t(768) << 20;

/// Removes the slash at the end of a path: "scan.nii.gz/" becomes "scan.nii.gz".
std::filesystem::path without_slash(const std::string& path) {
    const std::filesystem::path given(path);
    return given.has_filename() ? given : given.parent_path();
}

/// A port that depends only on the path of the study. Browsers store views, and actions that have not been sent, for an
/// address, and find them again if a study has the same port in each run.
std::uint16_t usual_port(const std::string& study) {
    constexpr std::uint32_t kFirst = 20000, kCount = 12000;  // below the range of ephemeral ports
    std::error_code ignored;
    std::uint32_t hash = 2166136261U;  // FNV-1a
    for (const char c : std::filesystem::absolute(study, ignored).lexically_normal().string())
        hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
    return std::uint16_t(kFirst + hash % kCount);
}

std::unique_ptr<serve::WebServer> start_server(serve::Options options, const serve::Handlers& handlers,
                                               const std::string& study) {
    const bool is_given = options.port != 0;
    if (!is_given) options.port = usual_port(study);
    try {
        return std::make_unique<serve::WebServer>(options, handlers);
    } catch (const Error& error) {
        if (is_given || error.code() != Errc::Io) throw;
        options.port = 0;
        return std::make_unique<serve::WebServer>(options, handlers);
    }
}

/// Stops a server at the end of the scope, also after an error, before the objects that its handlers use are destroyed.
struct StopAtEnd {
    serve::WebServer& server;
    ~StopAtEnd() { server.stop(); }
};

struct MarkJob {
    std::string image_path, study;
    ImageFlags image;
    bool without_browser = false;
    int port = 0, guess_label = 0;
    std::vector<std::string> authorities, frame_origins, points, guesses, labels;

    void run(Session& session) const {
        if (port < 0 || port > 65535)
            throw Error(Errc::InvalidOptions, "--port: expected 0 to 65535, got " + std::to_string(port));
        const ImageInfo info = read_image_info(image_path, image.options, session.run());
        session.require_memory(double(info.bytes_to_hold), "the image");
        const Image pixels = image.read(image_path, session.run());
        const std::filesystem::path path = without_slash(image_path);
        Study opened(study.empty() ? path.string() + ".covol" : study, image_path, pixels.geometry());
        if (!opened.repaired().empty()) session.warn(opened.folder() + ": " + opened.repaired());
        const std::string folder = opened.folder();
        MarkView view;
        view.site = open_study_site(folder, pixels.geometry());
        take_files(opened, view.site, session);
        view.page = detail::mark_page();
        view.title = path.filename().string();
        view.image_digest = identity_of_image();
        serve::Options options;
        options.port = std::uint16_t(port);
        options.authorities = authorities;
        options.frame_origins = frame_origins;
        options.page_policy = policy_of(view.page);
        options.max_body_bytes = kMaxFileBytes;
        // A page that reconnects sends its pending actions without pauses, and must not exceed these limits by this. It
        // takes at most a millisecond to store an action.
        options.messages_per_second = 2000;
        options.message_burst = 10'000;
        const auto open = [&] { return image.read(image_path, quiet(session.run())); };
        const ImageLevels levels = open_image_levels(pixels, image.options, kMaxSliceBytes, session.run());
        // Only images in chunks are opened a second time for computations, and again when their decoded chunks exceed
        // kMaxJobBytes. Other images are opened once, because a compressed stream is slow to open.
        const bool is_bounded = levels.is_in_chunks();
        BoundedImage for_jobs(is_bounded ? open() : pixels, open,
                              is_bounded ? kMaxJobBytes : std::numeric_limits<std::uint64_t>::max());
        auto seen =
            std::make_unique<PageImage>(levels, view.title, is_anatomical(image_path, image.options, session.run()),
                                        channels(info, session), quiet(session.run()));
        // Declared before `mark`, and so destroyed after it: the solver of `mark` uses the server until the solver's
        // thread has ended.
        std::unique_ptr<serve::WebServer> server;
        MarkSession mark(
            std::move(opened), std::move(seen), [&] { return for_jobs.get(); }, std::move(view), session.run());
        std::latch started(1);  // a browser may connect before the study is loaded
        serve::Handlers handlers;
        handlers.get = [&](const serve::Request& request) {
            started.wait();
            return mark.get(request);
        };
        handlers.post = [&](const serve::Request& request, const std::string& body) {
            started.wait();
            return mark.post(request, body);
        };
        handlers.opened = [&](serve::Client client) {
            started.wait();
            mark.opened(client);
        };
        handlers.message = [&](serve::Client client, std::string_view text) { mark.message(client, text); };
        handlers.on_error = [&](const std::string& line) { session.warn(line); };
        server = start_server(std::move(options), handlers, folder);
        const StopAtEnd stop{*server};
        mark.start([&](serve::Client client, std::string text) { server->send(client, std::move(text)); },
                   [&](std::string text) { server->broadcast(std::move(text)); });
        started.count_down();
        std::optional<BrowserLink> link;
        if (!without_browser) link.emplace(server->url());
        if (!link || !link->open()) std::cout << "open " << server->url() << std::endl;
        session.note("the study is " + folder + "; every action is saved immediately. Ctrl-C ends the program.");
        while (!session.run().cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        server->stop();  // before accept_interrupt() clears the flag that cancels requests in progress
        accept_interrupt();
    }

private:
    /// The channels of the image; empty for an image with one channel. Channels other than the one in which marks are
    /// set are read when a page requests them.
    [[nodiscard]] PageChannels channels(const ImageInfo& info, Session& session) const {
        PageChannels all;
        if (info.channels < 2) return all;
        all.own = image.options.channel.value_or(0);
        for (int c = 0; c < info.channels; ++c)
            all.names.push_back(std::size_t(c) < info.channel_names.size() &&
                                        !info.channel_names[std::size_t(c)].empty()
                                    ? safe_text(info.channel_names[std::size_t(c)])
                                    : "channel " + std::to_string(c));
        all.open = [how = *this, bytes = double(info.bytes_to_hold), &session](int channel) {
            ImageFlags other = how.image;
            other.options.channel = channel;
            session.require_memory(bytes, "another channel");
            const Image pixels = other.read(how.image_path, quiet(session.run()));
            return open_image_levels(pixels, other.options, kMaxSliceBytes / 4, quiet(session.run()));
        };
        return all;
    }

    /// A text that changes with the content of the image file, with the options with which it is read, and with the
    /// version of covol.
    [[nodiscard]] std::string identity_of_image() const {
        const ReadImageOptions& how = image.options;
        std::string identity = digest_of(image_path) + " " + version() + " channel " +
                               std::to_string(how.channel.value_or(-1)) + " frame " +
                               std::to_string(how.frame.value_or(-1)) + (how.correct_level_shift ? " shifted" : "");
        if (how.spacing)
            for (const double s : *how.spacing) identity += " " + std::to_string(s);
        return identity;
    }

    /// Adds the files of the command line to the study.
    void take_files(Study& study, const StudySite& site, Session& session) const {
        const std::string folder = study.folder();
        for (const std::string& text : points) {
            const Named file = split_name(text);
            const StudyAction marks = import_points(file.value, 0, site.image, session.run());
            const StudyId id = structure_of(study, "--points", file);
            auto action = std::get<StudyActions::AddMarks>(marks);
            action.structure = id;
            // The key depends on the content of the file, so repeating the command line does not add the marks twice.
            const std::string key = "points-" + std::to_string(id) + "-" + digest_of(file.value);
            if (!study.apply({key, action}).is_new)
                session.note(file.value + ": its marks were added to this structure before, and are not added again");
        }
        for (const std::string& text : guesses) {
            const Named file = split_name(text);
            const StudyGuess guess = guess_of_file(folder, file.value, guess_label);
            (void)site.read_guess(guess, session.run());
            const StudyId id = structure_of(study, "--guess", file);
            if (study.history().find(id)->guess != guess) (void)study.apply({"", StudyActions::SetGuess{id, guess}});
        }
        for (const std::string& file : labels) {
            const StudyAction action = import_labels(file, folder, study.state(), site, session.run());
            const auto& added = std::get<StudyActions::AddLabels>(action);
            const bool is_there = std::any_of(study.state().begin(), study.state().end(), [&](const auto& structure) {
                return structure->guess && structure->guess->path == added.path &&
                       structure->guess->digest == added.digest && structure->guess->label > 0;
            });
            if (is_there)
                session.note(file + ": its labels are structures of this study already");
            else
                (void)study.apply({"", action});
        }
    }

    /// The structure with the name of `file`, which is added if it does not exist; without a name, the only structure.
    static StudyId structure_of(Study& study, const std::string& flag, const Named& file) {
        const StudyState& all = study.state();
        if (file.name.empty() && all.size() > 1)
            throw UsageError(flag + ": the study has several structures; state which one this file belongs to, as in " +
                             all.front()->name + "=" + file.value);
        if (file.name.empty() && all.size() == 1) return all.front()->id;
        const std::string name = file.name.empty() ? "structure 1" : file.name;
        for (const auto& structure : all)
            if (structure->name == name) return structure->id;
        return study.apply({"", StudyActions::AddStructure{name, {}}}).changed.made;
    }
};

}  // namespace

void run_mark(Session& session, const MarkCall& call) {
    MarkJob job;
    job.image_path = call.image;
    job.points = call.points;
    job.without_browser = call.without_browser;
    job.port = call.port;
    job.run(session);
}

void bind_page(CLI::App& command, bool& without_browser, int& port) {
    command.add_flag("--no-browser", without_browser,
                     "print the address without opening a browser; from another machine: ssh -L PORT:127.0.0.1:PORT, "
                     "with --port PORT");
    command.add_option("--port", port, "port of the address; 0 selects the study's own port, or a free one")
        ->type_name("N");
}

void add_mark(Session& session) {
    const auto [job, command] =
        session.add_job<MarkJob>("mark", "Set marks on an image in the browser, and see the surface");
    in_group(*command, Group::Input);
    command->add_option("image", job->image_path, "3D image, in any format that covol segment reads")
        ->required()
        ->type_name("IMAGE");
    command
        ->add_option("study", job->study,
                     "folder with the marks and structures, created if it does not exist [IMAGE.covol]")
        ->type_name("STUDY");
    job->image.bind(*command, {"roi"});
    in_group(*command, Group::Marks);
    command
        ->add_option("--points", job->points,
                     "marks on the surface that are added to a structure, in any format that covol segment reads")
        ->type_name("[NAME=]FILE")
        ->allow_extra_args(false);
    command
        ->add_option("--guess", job->guesses,
                     "result of another tool (a mask, mesh or level set) that the marks of a structure correct")
        ->type_name("[NAME=]FILE")
        ->allow_extra_args(false);
    command->add_option("--guess-label", job->guess_label, "label to use from a guess with several labels")
        ->type_name("N");
    command
        ->add_option("--labels", job->labels,
                     "label image of another tool: each label becomes a structure and is its guess")
        ->type_name("FILE")
        ->allow_extra_args(false);
    in_group(*command, Group::Output);
    bind_page(*command, job->without_browser, job->port);
    command
        ->add_option("--also-at", job->authorities,
                     "a further address from which the page may be loaded, for example localhost:9000 with ssh -L "
                     "9000:127.0.0.1:PORT")
        ->type_name("HOST:PORT");
    command
        ->add_option("--in-frame-of", job->frame_origins,
                     "address of a notebook on this machine that may show the page in a frame, for example "
                     "http://localhost:8888")
        ->type_name("ORIGIN")
        ->allow_extra_args(false);
}

}  // namespace covol::tool
