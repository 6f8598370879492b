// The layout of BigDataViewer: the file has a group for each time point, which contains a group for each setup (a
// channel, tile or angle), which contains the levels.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/text.h"
#include "io/chunked/zarr_store.h"
#include "io/hdf5/hdf5_layouts.h"
#include "io/pixels/raw_image.h"
#include "io/xml.h"

namespace covol::detail {
namespace {

constexpr std::size_t kMaxBdvLevels = 64;

/// A <ViewSetup> element of the XML.
struct Setup {
    std::string name, unit;
    std::optional<Vec3> voxel;
};

struct BdvChoice {
    std::string time, setup;  ///< names of the time point and of the setup; empty if the user has chosen none
    int level = 0;
};

/// Whether a name consists of this letter and digits, such as "t00012".
bool is_named(const std::string& name, char letter) {
    return name.size() > 2 && name[0] == letter &&
           std::all_of(name.begin() + 1, name.end(), [](unsigned char c) { return c >= '0' && c <= '9'; });
}

std::vector<std::string> named(std::vector<std::string> names, char letter) {
    names.erase(std::remove_if(names.begin(), names.end(), [&](const auto& name) { return !is_named(name, letter); }),
                names.end());
    return names;
}

/// Parses a path TIME/SETUP/LEVEL/cells, of which parts at the end may be missing. @returns nothing if LEVEL is not a
/// number, or if there are other parts
std::optional<BdvChoice> parse_bdv(const std::string& inside) {
    const std::vector<std::string> parts = parts_of(inside);
    BdvChoice choice;
    if (parts.size() > 4 || (parts.size() == 4 && parts[3] != "cells")) return std::nullopt;
    if (!parts.empty()) choice.time = parts[0];
    if (parts.size() > 1) choice.setup = parts[1];
    if (parts.size() > 2) {
        const std::optional<int> level = number_after(parts[2], "");
        if (!level) return std::nullopt;
        choice.level = *level;
    }
    return choice;
}

std::string cells(const std::string& time, const std::string& setup, std::size_t level) {
    return "/" + time + "/" + setup + "/" + std::to_string(level) + "/cells";
}

/// Parses three positive numbers, such as "0.4 0.4 1"; nothing if the text is not of this form.
std::optional<Vec3> to_vector(const std::string& text) {
    std::string_view rest = text;
    Vec3 vector;
    for (double& component : vector) {
        const std::optional<double> number = to_number(trim(next_word(rest)));
        if (!number || !std::isfinite(*number) || !(*number > 0)) return std::nullopt;
        component = *number;
    }
    return vector;
}

/// The path with the extension .xml instead of its own.
std::string xml_path(const std::string& path) { return path.substr(0, path.rfind('.')) + ".xml"; }

/// Reads the setups from the XML file, sorted by their numbers.
std::map<int, Setup> read_setups(const std::string& path) {
    constexpr std::uint64_t kMaxXml = std::uint64_t(64) << 20;
    std::map<int, Setup> setups;
    const std::optional<StoreFile> file = StoreFile::open(path);
    if (!file || file->size() > kMaxXml) return setups;
    const Bytes bytes = file->read(0, file->size());
    const std::string text(bytes.data(), bytes.size());
    XmlTags tags(text);
    XmlTag tag;
    bool in_setup = false, in_voxel = false;
    int id = -1;
    Setup setup;
    while (tags.next(tag)) {
        if (tag.name == "ViewSetup") {
            if (tag.closing && id >= 0) setups[id] = setup;
            in_setup = !tag.closing;
            setup = {};
            id = -1;
        } else if (tag.name == "voxelSize") {
            in_voxel = !tag.closing;
        } else if (in_setup && !tag.closing) {
            const std::string value(trim(tags.text()));
            if (tag.name == "id" && id < 0) id = to_number<int>(value).value_or(-1);
            if (tag.name == "name" && !in_voxel) setup.name = value;
            if (tag.name == "unit" && in_voxel) setup.unit = normal_unit(value);
            if (tag.name == "size" && in_voxel) setup.voxel = to_vector(value);
        }
    }
    return setups;
}

class Reader {
public:
    Reader(const Hdf5File& file, BdvChoice choice) : file_(file), choice_(std::move(choice)) {}

    /// Finds the time points and setups. @returns false if the file does not have BigDataViewer's layout
    bool find() {
        times_ = named(file_.members("/"), 't');
        if (choice_.time.empty() && !times_.empty()) choice_.time = times_.front(), chosen_time_ = false;
        if (!is_named(choice_.time, 't')) return false;
        setups_ = named(file_.members("/" + choice_.time), 's');
        if (!choice_.setup.empty()) setups_ = {choice_.setup};
        return !setups_.empty() && is_named(setups_.front(), 's') && file_.has(cells(choice_.time, setups_.front(), 0));
    }

    Hdf5Layout describe() {
        Hdf5Layout layout;
        ImageInfo& info = layout.info;
        info.format = "BigDataViewer HDF5";
        layout.in_datasets = layout.is_unsigned = true;
        if (chosen_time_) times_ = {choice_.time};
        info.frames = static_cast<int>(times_.size());
        info.channels = static_cast<int>(setups_.size());
        require_one_size();
        describe_spacing(info);
        const auto level = static_cast<std::size_t>(choice_.level);
        layout.dataset = [times = times_, setups = setups_, level](std::uint64_t channel, std::uint64_t frame) {
            return cells(times[frame], setups[channel], level);
        };
        return layout;
    }

private:
    [[nodiscard]] Index3 size_of(const std::string& setup, std::size_t level) const {
        const std::string name = cells(choice_.time, setup, level);
        const std::vector<std::uint64_t> shape = shape_of(file_, name).shape;
        if (shape.size() != 3)
            throw read_error(Errc::InvalidInput, file_.path_of(name),
                             "expected 3 dimensions, got " + std::to_string(shape.size()));
        return require_3d(file_.path_of(name), {shape[2], shape[1], shape[0]});
    }

    void require_one_size() const {
        constexpr std::size_t kShown = 10;
        std::string list;
        bool same = true;
        const Index3 first = size_of(setups_.front(), std::size_t(choice_.level));
        for (std::size_t n = 0; n < setups_.size(); ++n) {
            const Index3 size = size_of(setups_[n], std::size_t(choice_.level));
            same = same && size == first;
            if (n < kShown)
                list += (n == 0 ? "" : ", ") + file_.path_of("/" + choice_.time + "/" + setups_[n]) + " (" +
                        size_text(size) + ")";
        }
        if (same) return;
        if (setups_.size() > kShown) list += ", ... (" + std::to_string(setups_.size()) + ")";
        throw read_error(Errc::Unsupported, file_.path(),
                         "expected setups of one size, got several; give the path of one: " + list);
    }

    /// For each level, the sizes of its voxels along x, y, z relative to those of the finest level.
    [[nodiscard]] std::vector<Vec3> factors() const {
        const std::vector<double> numbers = file_.table("/" + setups_.front() + "/resolutions");
        std::vector<Vec3> factors;
        for (std::size_t n = 0; n + 3 <= numbers.size() && factors.size() < kMaxBdvLevels; n += 3) {
            factors.push_back({numbers[n], numbers[n + 1], numbers[n + 2]});
            for (const double f : factors.back())
                if (!std::isfinite(f) || !(f > 0))
                    throw read_error(Errc::InvalidInput, file_.path_of("/" + setups_.front() + "/resolutions"),
                                     "expected positive numbers");
        }
        return factors;
    }

    void describe_spacing(ImageInfo& info) {
        const std::string xml = xml_path(file_.path());
        std::map<int, Setup> setups = read_setups(xml);
        const auto setup_of = [&](const std::string& name) { return setups[number_after(name, "s").value_or(-1)]; };
        const Setup own = setup_of(setups_.front());
        bool all_named = true;
        for (const std::string& name : setups_) {
            const Setup setup = setup_of(name);
            if (setup.voxel && own.voxel && *setup.voxel != *own.voxel)
                throw read_error(Errc::Unsupported, file_.path(),
                                 "expected setups of one voxel size, but according to " + xml +
                                     " they differ; give the path of one: " +
                                     file_.path_of("/" + choice_.time + "/" + setups_.front()) + ", ...");
            info.channel_names.push_back(setup.name);
            all_named = all_named && !setup.name.empty();
        }
        if (!all_named) info.channel_names.clear();
        const Vec3 voxel = own.voxel.value_or(Vec3{1, 1, 1});
        info.geometry.unit = own.unit;
        info.spacing_known = {own.voxel.has_value(), own.voxel.has_value(), own.voxel.has_value()};
        if (own.voxel) info.fields.emplace_back("voxelSize", "of " + xml + "; its registrations are not applied");
        const std::vector<Vec3> factor = factors();
        if (choice_.level > 0 && std::size_t(choice_.level) >= factor.size())
            throw read_error(Errc::InvalidInput, file_.path_of("/" + setups_.front() + "/resolutions"),
                             "expected factors for level " + std::to_string(choice_.level) + ", got " +
                                 std::to_string(factor.size()) + " levels");
        for (std::size_t level = 0; level < factor.size(); ++level) {
            Vec3 spacing;
            for (int a = 0; a < 3; ++a) spacing[a] = voxel[a] * factor[level][a];
            // A coarse voxel is the mean of finer voxels, so its centre is the centre of the box that they cover. The
            // origin of the world is the centre of the first voxel of the finest level.
            if (int(level) == choice_.level) {
                info.geometry.spacing = spacing;
                for (int a = 0; a < 3; ++a) info.geometry.origin[a] = 0.5 * (spacing[a] - voxel[a]);
            }
            const std::string name = cells(choice_.time, setups_.front(), level);
            try {
                info.levels.push_back(level_text(name, size_of(setups_.front(), level), spacing));
            } catch (const Error&) {  // a level that cannot be read is an error only if it is requested
                info.levels.push_back(name + ": cannot be read");
            }
        }
        if (factor.empty()) info.geometry.spacing = voxel;
    }

    const Hdf5File& file_;
    BdvChoice choice_;
    bool chosen_time_ = true;
    std::vector<std::string> times_, setups_;
};

}  // namespace

std::optional<Hdf5Layout> big_data_viewer_layout(const Hdf5File& file, const std::string& inside) {
    std::optional<BdvChoice> choice = parse_bdv(inside);
    if (!choice) return std::nullopt;
    Reader reader(file, std::move(*choice));
    return reader.find() ? std::optional(reader.describe()) : std::nullopt;
}

}  // namespace covol::detail
