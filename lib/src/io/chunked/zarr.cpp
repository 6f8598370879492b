#include "io/chunked/zarr.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <sstream>

#include "base/file.h"
#include "base/text.h"
#include "io/chunked/ome_zarr.h"
#include "io/chunked/zarr_array.h"
#include "io/chunked/zarr_chunks.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

/// The numbers as a text, separated by `between`: "1 x 0.5 x 0.5".
template <typename Numbers>
std::string list_text(const Numbers& numbers, const char* between) {
    std::ostringstream text;
    const char* before = "";
    for (const auto& n : numbers) {
        text << before << n;
        before = between;
    }
    return text.str();
}

/// The axes of an array, one letter for each dimension: x, y, z, c, t, or ? for any other axis.
std::string letters_of(const std::string& path, const std::vector<OmeAxis>& axes) {
    std::string letters;
    for (const OmeAxis& axis : axes) {
        const bool known = axis.name.size() == 1 && std::string("xyzct").find(axis.name) != std::string::npos;
        letters += known ? axis.name[0] : axis.type == "channel" ? 'c' : axis.type == "time" ? 't' : '?';
    }
    const auto has = [&](char letter) { return letters.find(letter) != std::string::npos; };
    const auto spaces = std::count_if(axes.begin(), axes.end(), [](const OmeAxis& a) { return a.type == "space"; });
    if (spaces == 3 && !(has('x') && has('y') && has('z'))) {
        const char* next = "zyx";
        for (std::size_t d = 0; d < axes.size(); ++d)
            if (axes[d].type == "space") letters[d] = *next++;
    }
    std::vector<std::string> names;
    for (const OmeAxis& axis : axes) names.push_back(axis.name);
    bool good = true;
    for (const char letter : {'x', 'y', 'z'}) good = good && has(letter);
    for (const char letter : std::string("xyzct"))
        good = good && std::count(letters.begin(), letters.end(), letter) < 2;
    if (!good)
        throw read_error(Errc::InvalidInput, path,
                         "expected a 3D image with axes z, y and x, and at most one for channels and for time, got " +
                             quote(list_text(names, ", ")));
    return letters;
}

std::vector<OmeAxis> axes_without_ome(const ZarrArray& array) {
    const std::vector<std::string>& names = array.dimension_names;
    const auto named = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
    std::vector<OmeAxis> axes;
    if (named("x") && named("y") && named("z")) {
        for (const std::string& name : names) axes.push_back({name, "", ""});
        return axes;
    }
    const std::string usual = "tczyx";
    const std::size_t count = array.shape.size();
    for (std::size_t d = 0; d < count; ++d)
        axes.push_back({d + usual.size() < count ? "" : std::string(1, usual[d + usual.size() - count]), "", ""});
    return axes;
}

/// The path of the only image in a group that holds it in a subfolder, as bioformats2raw writes it. @throws Error
/// Unsupported if the group has other contents, which the message lists.
std::string only_image_of(const std::string& path) {
    const OmeGroup group = read_ome_group(path);
    if (group.is_series && group.images.size() == 1) return path + "/" + group.images.front();
    if (group.images.empty())
        throw read_error(Errc::Unsupported, path, "expected an array or an image, got a group that holds neither");
    constexpr std::size_t kShown = 10;
    std::string list;
    for (std::size_t n = 0; n < std::min(kShown, group.images.size()); ++n)
        list += (n == 0 ? "" : ", ") + path + "/" + group.images[n];
    if (group.images.size() > kShown) list += ", ... (" + std::to_string(group.images.size()) + ")";
    throw read_error(Errc::Unsupported, path,
                     std::string("expected one image, got a ") + (group.is_plate ? "plate" : "group") +
                         "; give the path of an image in it: " + list);
}

class ZarrFile : public ChunkedFile {
public:
    ZarrFile(const std::string& path, bool correct_shift, const RunContext& run) : path_(path) {
        find(path);
        info_.type = array_.type;
        const std::vector<OmeAxis> axes = ome_ ? ome_->axes : axes_without_ome(array_);
        if (axes.size() != array_.shape.size())
            throw read_error(Errc::InvalidInput, ome_ ? ome_->metadata : array_.metadata,
                             "expected an axis for each dimension, got " + std::to_string(axes.size()) + " axes for " +
                                 std::to_string(array_.shape.size()) + " dimensions");
        letters_ = letters_of(array_.metadata, axes);
        axes_ = describe_axes(array_.metadata, letters_, array_, info_);
        if (ome_)
            describe_ome();
        else
            describe_array();
        describe_shift(correct_shift, run);
    }

    [[nodiscard]] std::vector<std::string> coarser_levels() const override {
        std::vector<std::string> paths;
        for (std::size_t n = level_ + 1; ome_ && n < ome_->levels.size(); ++n)
            paths.push_back(path_within(ome_->metadata, ome_->group, ome_->levels[n].path));
        return paths;
    }

protected:
    [[nodiscard]] std::shared_ptr<const ChunkSource> chunks(const PixelRequest& request) const override {
        return zarr_chunks(array_, axes_, info_.geometry.size, request.channel, request.frame);
    }

private:
    /// Finds the array and the OME-Zarr image that it belongs to, if there is one.
    void find(std::string folder) {
        if (!is_zarr_array(folder)) {
            ome_ = read_ome_image(folder);
            if (!ome_) {
                folder = only_image_of(folder);
                info_.fields.emplace_back("bioformats2raw.layout", "the only image is " + folder);
                if (!is_zarr_array(folder)) ome_ = read_ome_image(folder);
                if (!ome_)
                    throw read_error(
                        Errc::Unsupported, folder,
                        "expected an image (a group with multiscales), got an array or a group without them");
            }
            array_ = read_zarr_array(path_within(ome_->metadata, ome_->group, ome_->levels.front().path));
            return;
        }
        array_ = read_zarr_array(folder);
        if (std::optional<OmePlace> place = find_ome_image(folder)) {
            ome_ = std::move(place->image);
            level_ = place->level;
        }
    }

    void describe_array() {
        info_.format = "Zarr " + std::to_string(array_.version);
        info_.spacing_known = {false, false, false};
    }

    /// Converts a level's scale or translation, which has one number for each dimension, to lengths along x, y, z in
    /// the unit of x.
    [[nodiscard]] Vec3 along_axes(const std::vector<double>& numbers) const {
        Vec3 along{};
        for (int a = 0; a < 3; ++a) along[a] = numbers[axes_.space[a]] * in_unit_[a];
        return along;
    }

    void describe_ome() {
        const OmeLevel& level = ome_->levels[level_];
        info_.format = "OME-Zarr" + (ome_->version.empty() ? "" : " " + quoted_version()) + " (Zarr " +
                       std::to_string(array_.version) + ")";
        set_unit();
        info_.geometry.spacing = along_axes(level.scale);
        info_.geometry.origin = along_axes(level.translation);
        info_.spacing_known = {level.has_scale, level.has_scale, level.has_scale};
        if (ome_->channels.size() == std::size_t(info_.channels)) info_.channel_names = ome_->channels;
        std::vector<std::string> names;
        for (const OmeAxis& axis : ome_->axes) names.push_back(axis.name + (axis.unit.empty() ? "" : " " + axis.unit));
        info_.fields.emplace_back("axes", list_text(names, ", "));
        info_.fields.emplace_back("dataset", level.path);
        if (level.has_scale) info_.fields.emplace_back("scale", list_text(level.scale, ", "));
        if (level.has_translation) info_.fields.emplace_back("translation", list_text(level.translation, ", "));
        if (ome_->images > 1) info_.fields.emplace_back("multiscales", "the first of " + std::to_string(ome_->images));
        for (const OmeLevel& other : ome_->levels) info_.levels.push_back(level_text(other));
    }

    [[nodiscard]] std::string quoted_version() const {
        constexpr std::size_t kLongest = 16;
        std::string text = ome_->version.substr(0, kLongest);
        std::replace_if(
            text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, '?');
        return text;
    }

    void set_unit() {
        std::array<std::string, 3> units;
        for (int a = 0; a < 3; ++a) units[a] = ome_->axes[axes_.space[a]].unit;
        info_.geometry.unit = units[0];
        for (int a = 1; a < 3; ++a) {
            if (units[a] == units[0]) continue;
            const double own = unit_in_metres(units[a]), common = unit_in_metres(units[0]);
            if (!(own > 0 && common > 0))
                throw read_error(Errc::Unsupported, ome_->metadata,
                                 "expected one unit of length for x, y and z, got " + quote(list_text(units, ", ")));
            in_unit_[a] = own / common;
        }
    }

    /// Describes a level for users: "1: 1024 x 1024 x 1024, spacing 2 x 2 x 2"; "1: cannot be read" if its metadata is
    /// invalid.
    [[nodiscard]] std::string level_text(const OmeLevel& level) const {
        std::string text = level.path + ": ";
        try {
            const ZarrArray array = read_zarr_array(path_within(ome_->metadata, ome_->group, level.path));
            if (array.shape.size() != letters_.size()) return text + "has other axes";
            std::array<std::uint64_t, 3> size{};
            for (int a = 0; a < 3; ++a) size[a] = array.shape[axes_.space[a]];
            return text + list_text(size, " x ") + ", spacing " + list_text(along_axes(level.scale), " x ");
        } catch (const Error&) {
            return text + "cannot be read";
        }
    }

    /// A level without a translation has the wrong position if its voxels are means of those of level 0: the centre of
    /// its first voxel is then the centre of several voxels of level 0. Corrects the origin if `correct` is set;
    /// otherwise warns.
    void describe_shift(bool correct, const RunContext& run) {
        if (!ome_ || level_ == 0 || ome_->levels[level_].has_translation) return;
        const Vec3 own = along_axes(ome_->levels[level_].scale), finest = along_axes(ome_->levels[0].scale);
        if (own == finest) return;
        Vec3 shift{};
        for (int a = 0; a < 3; ++a) shift[a] = (own[a] - finest[a]) / 2;
        const std::string text = list_text(shift, ", ");
        if (correct) {
            for (int a = 0; a < 3; ++a) info_.geometry.origin[a] += shift[a];
            info_.fields.emplace_back("level_shift", "corrected: moved by " + text);
            return;
        }
        info_.fields.emplace_back("level_shift", "probably " + text + ": the level states no translation");
        run.warn(path_ + ": level " + ome_->levels[level_].path +
                 " states no translation: if its voxels are means of those of level " + ome_->levels[0].path +
                 ", it is displaced from them by " + text + " along x, y, z; `correct_level_shift` corrects this");
    }

    std::string path_;
    ZarrArray array_;
    std::optional<OmeImage> ome_;
    std::size_t level_ = 0;
    std::string letters_;
    ArrayAxes axes_;
    Vec3 in_unit_{1, 1, 1};  ///< factors that convert lengths along x, y, z to the unit of x
};

}  // namespace

bool is_zarr(const std::string& folder) {
    std::error_code status;
    for (const char* name : {".zarray", ".zgroup", ".zattrs", "zarr.json"})
        if (fs::is_regular_file(folder + "/" + name, status)) return true;
    return false;
}

std::unique_ptr<ImageFile> open_zarr(const std::string& path, bool correct_level_shift, const RunContext& run) {
    return std::make_unique<ZarrFile>(without_end_slash(path), correct_level_shift, run);
}

}  // namespace covol::detail
