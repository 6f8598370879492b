#include "io/chunked/ome_zarr.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/text.h"
#include "io/chunked/zarr_array.h"
#include "io/chunked/zarr_store.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxAxes = 16, kMaxLevels = 64, kMaxChannels = 4096;

/// The attributes of a group, or the object "ome" among them if there is one, and the file that contains them.
struct Attributes {
    Json json;
    std::string file;
    std::string version;  ///< stated here from OME-Zarr 0.5 on; empty for older versions
};

std::optional<Attributes> read_attributes(const std::string& folder) {
    Attributes found;
    found.file = folder + "/zarr.json";
    if (const std::optional<Json> json = read_json(found.file)) {
        const Json& attributes = member(*json, "attributes");
        const Json& ome = member(attributes, "ome");
        found.json = ome.is_object() ? ome : attributes;
        found.version = text_of(member(ome, "version"));
        return found;
    }
    found.file = folder + "/.zattrs";
    std::optional<Json> json = read_json(found.file);
    if (!json) return std::nullopt;
    found.json = std::move(*json);
    return found;
}

/// Reads one entry of the list `multiscales`.
class MultiscaleReader {
public:
    MultiscaleReader(OmeImage& image, const Json& multiscale) : image_(image), json_(multiscale) {}

    void read() {
        read_axes();
        const Json& datasets = member(json_, "datasets");
        if (!datasets.is_array() || datasets.empty() || datasets.size() > kMaxLevels)
            throw wrong("expected a list of 1 to " + std::to_string(kMaxLevels) + " datasets in its multiscales, got " +
                        count_of(datasets));
        for (const Json& dataset : datasets) {
            OmeLevel level;
            level.path = text_of(member(dataset, "path"));
            static_cast<void>(path_within(image_.metadata, image_.group, level.path));
            level.scale.assign(image_.axes.size(), 1);
            level.translation.assign(image_.axes.size(), 0);
            level.has_translation = apply(member(dataset, "coordinateTransformations"), level);
            apply(member(json_, "coordinateTransformations"), level);
            image_.levels.push_back(std::move(level));
        }
    }

private:
    [[nodiscard]] Error wrong(const std::string& what) const {
        return read_error(Errc::InvalidInput, image_.metadata, what);
    }
    /// The number of elements of a list, for messages.
    static std::string count_of(const Json& list) {
        return list.is_array() ? std::to_string(list.size()) : std::string("no list");
    }

    void read_axes() {
        const Json& axes = member(json_, "axes");
        if (axes.is_null())  // before OME-Zarr 0.3, no axes are stated
            for (const char* name : {"t", "c", "z", "y", "x"}) image_.axes.push_back({name, "", ""});
        else if (!axes.is_array() || axes.size() > kMaxAxes)
            throw wrong("expected a list of at most " + std::to_string(kMaxAxes) + " axes in its multiscales, got " +
                        count_of(axes));
        for (const Json& axis : axes) {
            const std::string name = axis.is_string() ? text_of(axis) : text_of(member(axis, "name"));
            image_.axes.push_back(
                {lower(name), lower(text_of(member(axis, "type"))), normal_unit(text_of(member(axis, "unit")))});
        }
    }

    [[nodiscard]] std::vector<double> numbers(const Json& list, const char* what) const {
        std::vector<double> values;
        if (list.is_array() && list.size() == image_.axes.size())
            for (const Json& value : list)
                if (value.is_number() && std::isfinite(value.get<double>())) values.push_back(value.get<double>());
        if (values.size() != image_.axes.size())
            throw wrong(std::string("expected a ") + what + " of one number for each of its " +
                        std::to_string(image_.axes.size()) + " axes");
        return values;
    }

    /// Applies a list of transformations to a level, one after the other. @returns whether one of them is a translation
    bool apply(const Json& transformations, OmeLevel& level) const {
        bool translated = false;
        if (transformations.is_null()) return translated;
        if (!transformations.is_array() || transformations.size() > kMaxAxes)
            throw wrong("expected a list of at most " + std::to_string(kMaxAxes) + " coordinateTransformations, got " +
                        count_of(transformations));
        for (const Json& transformation : transformations) {
            const std::string type = text_of(member(transformation, "type"));
            if (type == "identity") continue;
            if (type == "scale") {
                const std::vector<double> scale = numbers(member(transformation, "scale"), "scale");
                for (std::size_t a = 0; a < scale.size(); ++a) {
                    level.scale[a] *= scale[a];
                    level.translation[a] *= scale[a];
                }
                level.has_scale = true;
            } else if (type == "translation") {
                const std::vector<double> by = numbers(member(transformation, "translation"), "translation");
                for (std::size_t a = 0; a < by.size(); ++a) level.translation[a] += by[a];
                translated = true;
            } else {
                throw read_error(Errc::Unsupported, image_.metadata,
                                 "expected the coordinateTransformations scale and translation, got " + quote(type));
            }
        }
        return translated;
    }

    OmeImage& image_;
    const Json& json_;
};

}  // namespace

std::optional<OmeImage> read_ome_image(const std::string& folder) {
    const std::optional<Attributes> attributes = read_attributes(folder);
    if (!attributes) return std::nullopt;
    const Json& multiscales = member(attributes->json, "multiscales");
    if (!multiscales.is_array() || multiscales.empty()) return std::nullopt;
    OmeImage image;
    image.group = folder;
    image.metadata = attributes->file;
    image.images = static_cast<int>(multiscales.size());
    const Json& first = multiscales.front();
    image.version = attributes->version.empty() ? text_of(member(first, "version")) : attributes->version;
    MultiscaleReader(image, first).read();
    const Json& channels = member(member(attributes->json, "omero"), "channels");
    if (channels.is_array() && channels.size() <= kMaxChannels)
        for (const Json& channel : channels) image.channels.push_back(text_of(member(channel, "label")));
    return image;
}

std::optional<OmePlace> find_ome_image(const std::string& array_folder) {
    constexpr int kHighest = 3;
    std::error_code status;
    fs::path whole = fs::absolute(array_folder, status).lexically_normal();
    if (!whole.has_filename()) whole = whole.parent_path();
    fs::path group = whole;
    for (int up = 0; up < kHighest && group.has_relative_path(); ++up) {
        group = group.parent_path();
        // The folders above the array are groups of the store, one of which may describe the image.
        const std::optional<OmeImage> image = read_ome_image(group.string());
        if (!image) continue;
        for (std::size_t n = 0; n < image->levels.size(); ++n)
            if (path_within(image->metadata, image->group, image->levels[n].path) == whole.string())
                return OmePlace{*image, n};
    }
    return std::nullopt;
}

OmeGroup read_ome_group(const std::string& folder) {
    OmeGroup group;
    if (const std::optional<Attributes> attributes = read_attributes(folder)) {
        group.is_series = !member(attributes->json, "bioformats2raw.layout").is_null();
        group.is_plate = member(attributes->json, "plate").is_object();
    }
    constexpr std::size_t kMaxNames = 1000;
    std::error_code status;
    for (fs::directory_iterator entry(folder, status), end; !status && entry != end; entry.increment(status)) {
        std::error_code unknown;
        const std::string inside = entry->path().string();
        const bool in_store = fs::exists(inside + "/.zarray", unknown) || fs::exists(inside + "/.zattrs", unknown) ||
                              fs::exists(inside + "/zarr.json", unknown) || fs::exists(inside + "/.zgroup", unknown);
        const std::string name = entry->path().filename().string();
        if (in_store && name != "OME" && group.images.size() < kMaxNames) group.images.push_back(name);
    }
    std::sort(group.images.begin(), group.images.end());
    return group;
}

}  // namespace covol::detail
