#include "io/image/segmentation.h"

#include <algorithm>
#include <cstdint>

#include "io/pixels/chunks.h"
#include "io/pixels/nrrd_segments.h"

namespace covol::detail {
namespace {

std::string names_of(const std::vector<NrrdSegment>& segments) {
    std::string list;
    for (const NrrdSegment& segment : segments) list += (list.empty() ? "" : ", ") + segment.name;
    return list.empty() ? "none" : list;
}

class SegmentFile : public ImageFile {
public:
    SegmentFile(std::string path, std::unique_ptr<ImageFile> file, NrrdSegment segment)
        : path_(std::move(path)), file_(std::move(file)), segment_(std::move(segment)) {
        info_ = file_->info();
        if (segment_.layer >= info_.channels)
            throw read_error(Errc::InvalidInput, path_,
                             "segment '" + segment_.name + "' refers to layer " + std::to_string(segment_.layer) +
                                 " (from 0), but the number of layers in the file is " +
                                 std::to_string(info_.channels));
        info_.type = PixelType::UInt8;
        info_.channels = 1;
        info_.channel_names.clear();
        info_.chunk_size = {0, 0, 0};
        info_.format += ", one segment";
        info_.fields.emplace_back("segment", segment_.name + ": label " + std::to_string(segment_.label) +
                                                 " of layer " + std::to_string(segment_.layer));
        refer_to(file_->files());
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        PixelRequest of_layer = request;
        of_layer.channel = std::uint64_t(segment_.layer);
        const Pixels layer = file_->read(of_layer, run);
        const Index3 n = request.box.size();
        const std::shared_ptr<void> data = allocate_pixels(path_, voxel_count(n), PixelType::UInt8, 0);
        auto* out = static_cast<std::uint8_t*>(data.get());
        const auto label = double(segment_.label);
        if (layer.chunks) {
            with_pixel_type(file_->info().type, [&](auto pixel) {
                std::vector<decltype(pixel)> values(voxel_count(n));
                layer.chunks->copy(request.box, values.data());
                for (const auto value : values) *out++ = double(value) == label;
            });
            return {data, dense_strides(n), false};
        }
        with_pixel_type(file_->info().type, [&](auto pixel) {
            const auto* first = static_cast<const decltype(pixel)*>(layer.data.get());
            for (std::int32_t k = 0; k < n[2]; ++k)
                for (std::int32_t j = 0; j < n[1]; ++j)
                    for (std::int32_t i = 0; i < n[0]; ++i)
                        *out++ =
                            double(first[i * layer.stride[0] + j * layer.stride[1] + k * layer.stride[2]]) == label;
        });
        return {data, dense_strides(n), false};
    }

private:
    std::string path_;
    std::unique_ptr<ImageFile> file_;
    NrrdSegment segment_;
};

}  // namespace

std::unique_ptr<ImageFile> open_segment(const std::string& path, std::unique_ptr<ImageFile> file,
                                        const std::string& name) {
    const std::vector<NrrdSegment> segments = read_nrrd_segments(path);
    auto found = std::find_if(segments.begin(), segments.end(), [&](const NrrdSegment& s) { return s.name == name; });
    if (found == segments.end())
        found = std::find_if(segments.begin(), segments.end(), [&](const NrrdSegment& s) { return s.id == name; });
    if (found == segments.end())
        throw read_error(Errc::InvalidInput, path,
                         "expected one of its segments (" + names_of(segments) + "), got '" + name + "'");
    return std::make_unique<SegmentFile>(path, std::move(file), *found);
}

std::string advice_on_segments(const std::string& path) {
    const std::vector<NrrdSegment> segments = read_nrrd_segments(path);
    if (segments.size() < 2) return {};
    return "; its segments (" + names_of(segments) + ") overlap and are stored in layers: choose one by its name, " +
           path + ":" + segments.front().name;
}

}  // namespace covol::detail
