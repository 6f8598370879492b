#include "io/hdf5/hdf5_image.h"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <utility>

#include "base/text.h"
#include "io/hdf5/hdf5_dataset.h"
#include "io/hdf5/hdf5_layouts.h"
#include "io/pixels/chunks.h"

namespace covol::detail {
namespace {

class Hdf5Image : public ImageFile {
public:
    Hdf5Image(std::shared_ptr<const Hdf5File> file, Hdf5Layout layout)
        : file_(std::move(file)), layout_(std::move(layout)) {
        info_ = layout_.info;
        const int channels = info_.channels, frames = info_.frames;
        const Hdf5Dataset first = dataset_of({});
        axes_ = describe_axes(first.path(), layout_.letters, first.array(), info_);
        if (layout_.in_datasets) {
            info_.channels = channels;
            info_.frames = frames;
            info_.axis_order += std::string(channels > 1 ? "C" : "") + (frames > 1 ? "T" : "");
        }
        if (layout_.size) {
            for (int a = 0; a < 3; ++a)
                if ((*layout_.size)[a] > info_.geometry.size[a])
                    throw read_error(Errc::InvalidInput, first.path(),
                                     "expected " + size_text(*layout_.size) + " voxels, as its attributes state, got " +
                                         size_text(info_.geometry.size));
            info_.geometry.size = *layout_.size;
        }
        if (first.offset()) info_.chunk_size = {0, 0, 0};
        info_.fields.emplace_back("dataset", first.path());
        if (const std::string filters = first.filter_names(); !filters.empty())
            info_.fields.emplace_back("filters", filters);
    }

    [[nodiscard]] Pixels read(const PixelRequest& request, const RunContext& run) override {
        auto dataset = std::make_shared<Hdf5Dataset>(dataset_of(request));
        if (const auto place = place_in(*dataset, request)) {
            ImageInfo info = info_;
            info.channels = info.frames = 1;
            return open_placed(dataset->path(), info, *place)->read({request.box, 0, 0}, run);
        }
        return read_chunks(chunks_of(std::move(dataset), request), request.box, run);
    }

    [[nodiscard]] std::shared_ptr<const ChunkSource> chunk_source(const PixelRequest& request) const override {
        auto dataset = std::make_shared<Hdf5Dataset>(dataset_of(request));
        return place_in(*dataset, request) ? nullptr : chunks_of(std::move(dataset), request);
    }

    [[nodiscard]] std::vector<std::string> coarser_levels() const override {
        std::vector<std::string> names;
        for (const std::string& inside : layout_.coarser) names.push_back(file_->path() + ":" + inside);
        return names;
    }

    [[nodiscard]] std::uint64_t bytes_to_hold(const PixelRequest& request) const override {
        const std::uint64_t bytes = ImageFile::bytes_to_hold(request);
        return is_worth_mapping(bytes) ? 0 : bytes;
    }

private:
    [[nodiscard]] std::shared_ptr<const ChunkSource> chunks_of(std::shared_ptr<const Hdf5Dataset> dataset,
                                                               const PixelRequest& request) const {
        const bool own = layout_.in_datasets;
        return hdf5_chunks(std::move(dataset), axes_, info_.geometry.size, own ? 0 : request.channel,
                           own ? 0 : request.frame);
    }

    [[nodiscard]] Hdf5Dataset dataset_of(const PixelRequest& request) const {
        Hdf5Dataset dataset(file_, layout_.dataset(request.channel, request.frame));
        if (layout_.is_unsigned) dataset.treat_as_unsigned();
        const std::vector<std::uint64_t>& shape = dataset.array().shape;
        if (shape.size() != layout_.letters.size())
            throw read_error(Errc::InvalidInput, dataset.path(),
                             "expected " + std::to_string(layout_.letters.size()) + " dimensions, got " +
                                 std::to_string(shape.size()));
        // If the size is 0, this is the first dataset, which determines the size and type of the image.
        if (info_.geometry.size[0] == 0) return dataset;
        bool same = dataset.array().type == info_.type;
        for (int a = 0; a < 3; ++a) same = same && shape[axes_.space[a]] >= std::uint64_t(info_.geometry.size[a]);
        if (!same)
            throw read_error(Errc::InvalidInput, dataset.path(),
                             "expected " + size_text(info_.geometry.size) + " voxels of type " + to_string(info_.type) +
                                 ", as in the first channel and frame");
        return dataset;
    }

    /// The position of a volume that is stored uncompressed and contiguously, i fastest; empty if it has to be read
    /// in chunks.
    [[nodiscard]] std::optional<PixelPlace> place_in(const Hdf5Dataset& dataset, const PixelRequest& request) const {
        const ChunkedArray& array = dataset.array();
        const std::string& letters = layout_.letters;
        const std::uint64_t width = array.stored_bytes();
        if (!dataset.offset() || array.stored_as == StoredAs::Int64 || array.stored_as == StoredAs::UInt64)
            return std::nullopt;
        if (!letters.ends_with("zyx") || (layout_.size && array.shape != shape_of_image())) return std::nullopt;
        PixelPlace place;
        place.path = file_->path();
        place.swap = array.swap;
        place.half = array.stored_as == StoredAs::Half;
        place.type = array.type;
        std::uint64_t volumes = 0;
        for (std::size_t d = 0; d + 3 < letters.size(); ++d) {
            const std::uint64_t at = letters[d] == 'c' ? request.channel : letters[d] == 't' ? request.frame : 0;
            volumes = volumes * array.shape[d] + at;
        }
        const std::uint64_t volume = voxel_count(info_.geometry.size) * width;
        if (*dataset.offset() > file_->bytes() || volumes > file_->bytes() / volume)
            throw read_error(Errc::InvalidInput, dataset.path(), "damaged or truncated: it lies beyond the file's end");
        place.file_offset = *dataset.offset() + volumes * volume;
        // A large volume that cannot be mapped has no PixelPlace, so that bricks of it are read on demand.
        const bool mappable = place.as_stored() && place.file_offset % width == 0;
        if (!mappable && is_worth_mapping(volume)) return std::nullopt;
        return place;
    }

    [[nodiscard]] std::vector<std::uint64_t> shape_of_image() const {
        const Index3& n = info_.geometry.size;
        return {std::uint64_t(n[2]), std::uint64_t(n[1]), std::uint64_t(n[0])};
    }

    std::shared_ptr<const Hdf5File> file_;
    Hdf5Layout layout_;
    ArrayAxes axes_;
};

}  // namespace

std::string level_text(const std::string& name, const Index3& size, const Vec3& spacing) {
    std::ostringstream text;
    text << name << ": " << size_text(size) << ", spacing " << spacing[0] << " x " << spacing[1] << " x " << spacing[2];
    return text.str();
}

std::optional<int> number_after(const std::string& name, const std::string& word) {
    if (!name.starts_with(word)) return std::nullopt;
    const std::optional<int> number = to_number<int>(std::string_view(name).substr(word.size()));
    return number && *number >= 0 ? number : std::nullopt;
}

std::vector<std::string> parts_of(const std::string& name) {
    std::vector<std::string> parts;
    std::istringstream text(name);
    for (std::string part; std::getline(text, part, '/');)
        if (!part.empty()) parts.push_back(part);
    return parts;
}

std::optional<Hdf5Name> split_hdf5_name(const std::string& text) {
    std::error_code status;
    const std::string small = lower(text);
    for (const char* end : {".h5", ".hdf5", ".hdf", ".ims"}) {
        if (small.ends_with(end)) return Hdf5Name{text, ""};
        const std::size_t colon = small.find(std::string(end) + ":");
        if (colon == std::string::npos) continue;
        const std::size_t begin = colon + std::string_view(end).size();
        if (std::filesystem::is_regular_file(text.substr(0, begin), status))
            return Hdf5Name{text.substr(0, begin), text.substr(begin + 1)};
    }
    return std::nullopt;
}

bool is_itk_hdf5(const Hdf5Name& name) { return name.inside.empty() && Hdf5File(name.path).has("/ITKImage"); }

std::unique_ptr<ImageFile> open_hdf5(const Hdf5Name& name) {
    const auto file = std::make_shared<const Hdf5File>(name.path);
    std::optional<Hdf5Layout> layout = imaris_layout(*file, name.inside);
    if (!layout) layout = big_data_viewer_layout(*file, name.inside);
    return std::make_unique<Hdf5Image>(file, layout ? std::move(*layout) : plain_layout(*file, name.inside));
}

}  // namespace covol::detail
