#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "covol/image.h"
#include "covol/image_levels.h"
#include "covol/run.h"
#include "serve/web_server.h"

namespace covol::tool {

/// The channels of an image. Marks refer to one of the channels; the others are only displayed.
struct PageChannels {
    std::vector<std::string> names;        ///< names of all channels; empty: the image has one channel
    int own = 0;                           ///< number of the channel to which marks refer
    std::function<ImageLevels(int)> open;  ///< opens another channel, which has the same lattice
};

/// An image as displayed by a page. Its functions may be called from any thread.
class PageImage {
public:
    /// @param title  the image's name
    PageImage(ImageLevels levels, std::string title, bool is_anatomical, PageChannels channels, const RunContext& run);

    [[nodiscard]] const Image& image() const { return own_.levels.image(); }
    /// `/image`, `/channel`, `/slice` and `/oblique` of docs/mark_protocol.md.
    [[nodiscard]] serve::Response facts() const;
    [[nodiscard]] serve::Response channel(const serve::Request& request) const;
    [[nodiscard]] serve::Response slice(const serve::Request& request) const;
    [[nodiscard]] serve::Response oblique(const serve::Request& request) const;

private:
    struct Channel {
        ImageLevels levels;
        /// `range`: the lowest and the highest value that slices encode; `window`: the values that the page displays as
        /// black and as white until the user changes them.
        std::array<double, 2> range{0, 1}, window{0, 1};
    };
    [[nodiscard]] Channel made_of(ImageLevels levels) const;
    [[nodiscard]] const Channel& channel_of(const serve::Request& request) const;

    const RunContext run_;
    const std::string title_;
    const bool is_anatomical_;
    const PageChannels channels_;
    const Channel own_;
    mutable std::mutex mutex_;
    mutable std::map<int, Channel> others_;  // channels that were requested
};

}  // namespace covol::tool
