#include "mark/page_image.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "cli/output/json.h"
#include "covol/error.h"
#include "covol/page_data.h"
#include "mark/mark_json.h"
#include "mark/request_fields.h"

namespace covol::tool {
namespace {

constexpr double kBlack = 0.002, kWhite = 0.998;  // quantiles of the values that are displayed as black and as white

serve::Response answer_of(PageSlice coded) {
    serve::Response response;
    response.type = "application/octet-stream";
    response.body = std::move(coded.bytes);
    response.is_deflated = true;
    response.headers = {{"X-Width", std::to_string(coded.width)},
                        {"X-Height", std::to_string(coded.height)},
                        {"X-Factor", std::to_string(coded.factor)}};
    return response;
}

}  // namespace

PageImage::PageImage(ImageLevels levels, std::string title, bool is_anatomical, PageChannels channels,
                     const RunContext& run)
    : run_(run),
      title_(std::move(title)),
      is_anatomical_(is_anatomical),
      channels_(std::move(channels)),
      own_(made_of(std::move(levels))) {}

PageImage::Channel PageImage::made_of(ImageLevels levels) const {
    Channel channel{std::move(levels)};
    channel.range = channel.levels.range(run_);
    if (!(channel.range[1] > channel.range[0])) channel.range[1] = channel.range[0] + 1;
    channel.window = channel.levels.percentiles(kBlack, kWhite, run_);
    if (!(channel.window[1] > channel.window[0])) channel.window = channel.range;
    // Range and window of an image in chunks are estimated from some chunks, so the window may exceed the range.
    channel.range = {std::min(channel.range[0], channel.window[0]), std::max(channel.range[1], channel.window[1])};
    return channel;
}

const PageImage::Channel& PageImage::channel_of(const serve::Request& request) const {
    if (!request.query.contains("channel")) return own_;
    const std::int64_t number = number_of(request, "channel");
    if (number < 0 || number >= std::int64_t(channels_.names.size()))
        throw Error(Errc::InvalidInput, channels_.names.empty()
                                            ? "'channel': expected none, because the image has only one"
                                            : "'channel': expected 0 to " + std::to_string(channels_.names.size() - 1) +
                                                  ", got " + std::to_string(number));
    if (number == channels_.own) return own_;
    const std::lock_guard lock(mutex_);  // so that two requests do not open the same channel
    const auto found = others_.find(int(number));
    if (found != others_.end()) return found->second;
    return others_.emplace(int(number), made_of(channels_.open(int(number)))).first->second;
}

serve::Response PageImage::channel(const serve::Request& request) const {
    const Channel& channel = channel_of(request);
    serve::Response response;
    response.type = "application/json";
    response.body = text_of({{"low", channel.range[0]},
                             {"high", channel.range[1]},
                             {"black", channel.window[0]},
                             {"white", channel.window[1]}});
    return response;
}

serve::Response PageImage::facts() const {
    const ImageGeometry& g = image().geometry();
    Json levels = Json::array();
    for (const ImageLevels::Level& level : own_.levels.levels()) levels.push_back(level.factor);
    serve::Response response;
    response.type = "application/json";
    response.body = text_of({{"name", title_},
                             {"size", g.size},
                             {"spacing", g.spacing},
                             {"origin", g.origin},
                             {"direction", g.direction},
                             {"unit", g.unit},
                             {"anatomical", is_anatomical_},
                             {"levels", levels},
                             {"in_chunks", own_.levels.is_in_chunks()},
                             {"low", own_.range[0]},
                             {"high", own_.range[1]},
                             {"black", own_.window[0]},
                             {"white", own_.window[1]},
                             {"channels", channels_.names},
                             {"channel", channels_.own},
                             {"first_slice", 0}});
    return response;
}

serve::Response PageImage::slice(const serve::Request& request) const {
    const Channel& channel = channel_of(request);
    constexpr std::int64_t kMax = std::int64_t(1) << 30;
    const auto small = [&](const char* name) { return int(std::min(number_of(request, name), kMax)); };
    SliceRequest wanted{small("axis"), small("at"), small("step"), {}};
    if (request.query.contains("width"))
        wanted.part = SliceRequest::Part{small("x"), small("y"), small("width"), small("height")};
    RunContext run = run_;
    run.cancel = request.gone.get();  // set when the page closes the connection, because it needs another slice
    return answer_of(make_page_slice(channel.levels, wanted, channel.range, run));
}

serve::Response PageImage::oblique(const serve::Request& request) const {
    const Channel& channel = channel_of(request);
    const ObliqueRequest wanted{vector_of(request, "first"), vector_of(request, "right"), vector_of(request, "down"),
                                int(std::clamp<std::int64_t>(number_of(request, "count"), 0, 1 << 20))};
    RunContext run = run_;
    run.cancel = request.gone.get();
    return answer_of(make_oblique_slice(channel.levels, wanted, channel.range, run));
}

}  // namespace covol::tool
