#include "io/image/gdcm_images.h"

#include <algorithm>
#include <memory>

namespace covol::detail {
namespace {

/// An ItkHeader that memory can hold which is shared.
struct FlatHeader {
    static constexpr std::size_t kMost = 4;
    PixelType type;
    unsigned components;
    bool is_rgb;
    std::size_t dimensions;
    std::uint64_t size[kMost];
    double spacing[kMost], origin[kMost], axes[kMost][kMost];
    std::int64_t bytes;

    void take(const ItkHeader& header) {
        type = header.type;
        components = header.components;
        is_rgb = header.is_rgb;
        bytes = header.bytes;
        dimensions = header.size.size();
        for (std::size_t a = 0; a < dimensions; ++a) {
            size[a] = header.size[a];
            spacing[a] = header.spacing[a];
            origin[a] = header.origin[a];
            for (std::size_t b = 0; b < dimensions; ++b) axes[a][b] = header.axes[a][b];
        }
    }
    [[nodiscard]] ItkHeader header() const {
        ItkHeader header;
        header.type = type;
        header.components = components;
        header.is_rgb = is_rgb;
        header.bytes = bytes;
        header.size.assign(size, size + dimensions);
        header.spacing.assign(spacing, spacing + dimensions);
        header.origin.assign(origin, origin + dimensions);
        for (std::size_t a = 0; a < dimensions; ++a) header.axes.emplace_back(axes[a], axes[a] + dimensions);
        return header;
    }
};

std::vector<std::uint64_t> begins_of(const std::vector<GdcmFile>& files) {
    constexpr std::uint64_t kAlignment = 16;
    std::vector<std::uint64_t> begins{0};
    for (const GdcmFile& file : files)
        begins.push_back((begins.back() + file.bytes + kAlignment - 1) / kAlignment * kAlignment);
    return begins;
}

}  // namespace

std::vector<std::variant<ItkHeader, Error>> gdcm_headers(const std::vector<GdcmFile>& files, const RunContext& run) {
    const GdcmModule& gdcm = gdcm_module();
    const SharedMemory memory(files.size() * sizeof(FlatHeader));
    auto* const flat = reinterpret_cast<FlatHeader*>(memory.data());
    const auto read = [&](std::size_t n) {
        const std::unique_ptr<ItkReader> reader = gdcm.open(files[n].path, files[n].unusable);
        if (reader->header().size.size() > FlatHeader::kMost) throw Error(Errc::InvalidInput, files[n].unusable);
        flat[n].take(reader->header());
    };
    const std::vector<Trial> trials = try_in_children(files.size(), read, kMostSecondsForHeader, run);
    std::vector<std::variant<ItkHeader, Error>> headers;
    for (std::size_t n = 0; n < files.size(); ++n) {
        if (const auto error = reading_error(trials[n], files[n].path, "GDCM"))
            headers.emplace_back(*error);
        else
            headers.emplace_back(flat[n].header());
    }
    return headers;
}

GdcmPixels::GdcmPixels(const std::vector<GdcmFile>& files, const RunContext& run)
    : begin_(begins_of(files)), memory_(begin_.back()) {
    if (files.empty()) return;
    const GdcmModule& gdcm = gdcm_module();
    const auto decode = [&](std::size_t n) {
        const std::unique_ptr<ItkReader> reader = gdcm.open(files[n].path, files[n].unusable);
        if (reader->header().bytes < 0 || std::uint64_t(reader->header().bytes) != files[n].bytes)
            throw Error(Errc::InvalidInput, files[n].unusable);
        reader->read_all(memory_.data() + begin_[n]);
    };
    std::uint64_t most = 0;
    for (const GdcmFile& file : files) most = std::max(most, file.bytes);
    const std::vector<Trial> trials = try_in_children(files.size(), decode, most_seconds_for_pixels(most), run);
    for (std::size_t n = 0; n < files.size(); ++n)
        if (const auto error = reading_error(trials[n], files[n].path, "GDCM")) throw Error(*error);
}

}  // namespace covol::detail
