#include <chrono>
#include <filesystem>
#include <iostream>
#include <latch>
#include <limits>
#include <memory>
#include <optional>
#include <thread>

#include "commands/commands.h"
#include "covol/error.h"
#include "covol/image_levels.h"
#include "flags/bindings.h"
#include "jobs/page.h"
#include "mark/bounded_image.h"
#include "mark/browser.h"
#include "mark/mark_session.h"
#include "mark/page.h"
#include "serve/web_server.h"

namespace covol::tool {
namespace {

/// The page's own script and style are named in it by their digests; beside these it may ask this server alone.
constexpr const char* kPolicyBegins = "<meta http-equiv=\"Content-Security-Policy\" content=\"";

std::string policy_of(const std::string& page) {
    const std::size_t begin = page.find(kPolicyBegins) + std::string_view(kPolicyBegins).size();
    return page.substr(begin, page.find('"', begin) - begin) + "; frame-ancestors 'none'";
}

/// Decoded chunks that are kept for slices: a slice through 2048 x 2048 x 2048 voxels of 8 bits in chunks of 128 takes
/// 128 MiB where two voxels make a pixel.
constexpr std::uint64_t kMostSliceBytes = std::uint64_t(512) << 20;

/// Decoded chunks that surfaces were made from, before they are given up.
constexpr std::uint64_t kMostJobBytes = std::uint64_t(768) << 20;

/// "scan.nii.gz" of a path that may end in a slash.
std::filesystem::path without_slash(const std::string& path) {
    const std::filesystem::path given(path);
    return given.has_filename() ? given : given.parent_path();
}

/// The same port for the same study, as long as it is free: a browser keeps views, and actions that were not sent, by
/// the address.
std::uint16_t usual_port(const std::string& study) {
    constexpr std::uint32_t kFirst = 20000, kCount = 12000;  // below those that systems give to connections
    std::error_code ignored;
    std::uint32_t hash = 2166136261U;  // FNV-1a
    for (const char c : std::filesystem::absolute(study, ignored).lexically_normal().string())
        hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
    return std::uint16_t(kFirst + hash % kCount);
}

std::unique_ptr<serve::WebServer> start_server(serve::Options options, const serve::Handlers& handlers,
                                               const std::string& study) {
    const bool is_asked = options.port != 0;
    if (!is_asked) options.port = usual_port(study);
    try {
        return std::make_unique<serve::WebServer>(options, handlers);
    } catch (const Error& error) {
        if (is_asked || error.code() != Errc::Io) throw;
        options.port = 0;
        return std::make_unique<serve::WebServer>(options, handlers);
    }
}

struct MarkJob {
    std::string image_path, study;
    ImageFlags image;
    bool without_browser = false;
    int port = 0;
    std::vector<std::string> authorities;

    void run(Session& session) const {
        if (port < 0 || port > 65535)
            throw Error(Errc::InvalidOptions, "--port: expected 0 to 65535, got " + std::to_string(port));
        session.require_memory(double(read_image_info(image_path, image.options, session.run()).bytes_to_hold),
                               "the image");
        const Image pixels = image.read(image_path, session.run());
        const std::filesystem::path path = without_slash(image_path);
        Study opened(study.empty() ? path.string() + ".covol" : study, image_path, pixels.geometry());
        if (!opened.repaired().empty()) session.warn(opened.folder() + ": " + opened.repaired());
        const std::string folder = opened.folder();
        MarkView view;
        view.page = detail::mark_page();
        view.title = path.filename().string();
        view.is_anatomical = is_anatomical(image_path, image.options, session.run());
        serve::Options options;
        options.port = std::uint16_t(port);
        options.authorities = authorities;
        options.page_policy = policy_of(view.page);
        // A page that comes back sends what was done meanwhile as fast as it is kept, a millisecond or less each.
        options.messages_per_second = 2000;
        options.message_burst = 10'000;
        const auto open = [&] { return image.read(image_path, quiet(session.run())); };
        const ImageLevels levels = open_image_levels(pixels, image.options, kMostSliceBytes, session.run());
        // A packed stream, which takes long to open, is opened once.
        const bool is_bounded = levels.is_in_chunks();
        BoundedImage for_jobs(is_bounded ? open() : pixels, open,
                              is_bounded ? kMostJobBytes : std::numeric_limits<std::uint64_t>::max());
        MarkSession mark(
            std::move(opened), levels, [&] { return for_jobs.get(); }, std::move(view), session.run());
        std::latch started(1);  // a browser may be there before the study is
        serve::Handlers handlers;
        handlers.get = [&](const serve::Request& request) {
            started.wait();
            return mark.get(request);
        };
        handlers.opened = [&](serve::Client client) {
            started.wait();
            mark.opened(client);
        };
        handlers.message = [&](serve::Client client, std::string_view text) { mark.message(client, text); };
        handlers.on_error = [&](const std::string& line) { session.warn(line); };
        const std::unique_ptr<serve::WebServer> server = start_server(std::move(options), handlers, folder);
        mark.start([&](serve::Client client, std::string text) { server->send(client, std::move(text)); },
                   [&](std::string text) { server->broadcast(std::move(text)); });
        started.count_down();
        std::optional<BrowserLink> link;
        if (!without_browser) link.emplace(server->url());
        if (!link || !link->open()) std::cout << "open " << server->url() << std::endl;
        session.note("the study is " + folder + "; every action is on the disk at once. Ctrl-C ends the program.");
        while (!session.run().cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        server->stop();
        session.take_interrupt();
    }
};

}  // namespace

void add_mark(Session& session) {
    const auto [job, command] =
        session.add_job<MarkJob>("mark", "Click marks on an image in the browser, and see the surface");
    in_group(*command, Group::Input);
    command->add_option("image", job->image_path, "3D image, as of covol segment")->required()->type_name("IMAGE");
    command->add_option("study", job->study, "folder of marks and structures, made if it is not there [IMAGE.covol]")
        ->type_name("STUDY");
    job->image.bind(*command, {"roi"});
    in_group(*command, Group::Output);
    command->add_flag("--no-browser", job->without_browser,
                      "print the address alone; from another machine: ssh -L PORT:127.0.0.1:PORT, with --port PORT");
    command->add_option("--port", job->port, "of the address, 0 takes the study's own, or one that is free")
        ->type_name("N");
    command
        ->add_option("--also-at", job->authorities,
                     "a further address that the page is loaded from, localhost:9000 where ssh -L 9000:127.0.0.1:PORT")
        ->type_name("HOST:PORT");
}

}  // namespace covol::tool
