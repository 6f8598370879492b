// The layout of Imaris: groups for levels, time points and channels. The values of attributes are texts, stored as one
// character per element.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.h"
#include "io/hdf5/hdf5_layouts.h"
#include "io/pixels/raw_image.h"

namespace covol::detail {
namespace {

constexpr const char *kLevel = "ResolutionLevel ", *kTime = "TimePoint ", *kChannel = "Channel ";
constexpr int kMaxImarisLevels = 32;

/// The level, time point and channel that a path chooses.
struct ImarisChoice {
    int level = 0;
    std::optional<int> time, channel;
};

/// Parses a path "DataSet/ResolutionLevel L/TimePoint T/Channel C/Data", of which parts at the end may be missing.
/// @returns nothing if the path has another form
std::optional<ImarisChoice> parse_imaris(const std::string& inside) {
    const std::vector<std::string> parts = parts_of(inside);
    ImarisChoice choice;
    for (std::size_t n = 0; n < parts.size(); ++n) {
        std::optional<int> number = 0;
        if (n == 0 && parts[n] != "DataSet") return std::nullopt;
        if (n == 1) choice.level = (number = number_after(parts[n], kLevel)).value_or(0);
        if (n == 2) choice.time = number = number_after(parts[n], kTime);
        if (n == 3) choice.channel = number = number_after(parts[n], kChannel);
        if (!number || n > 4 || (n == 4 && parts[n] != "Data")) return std::nullopt;
    }
    return choice;
}

std::string level_name(int level) { return std::string("/DataSet/") + kLevel + std::to_string(level); }

std::string channel_name(int level, int time, int channel) {
    return level_name(level) + "/" + kTime + std::to_string(time) + "/" + kChannel + std::to_string(channel);
}

/// The extent of the image, from the attributes of /DataSetInfo/Image.
class Extent {
public:
    explicit Extent(const Hdf5File& file) : file_(file) {
        for (int a = 0; a < 3; ++a) {
            const auto minimum = number("ExtMin" + std::to_string(a)), maximum = number("ExtMax" + std::to_string(a));
            known_ = known_ && minimum && maximum && std::isfinite(*minimum) && std::isfinite(*maximum) &&
                     *maximum > *minimum;
            if (!known_) return;
            min_[a] = *minimum;
            side_[a] = *maximum - *minimum;
        }
    }
    [[nodiscard]] bool is_known() const { return known_; }
    /// The spacing of the finest level, which has `size` voxels; 1 along all axes if the file does not state the
    /// extent.
    [[nodiscard]] Vec3 spacing(const Index3& size) const {
        Vec3 spacing{1, 1, 1};
        for (int a = 0; known_ && a < 3; ++a) spacing[a] = side_[a] / size[a];
        return spacing;
    }
    [[nodiscard]] const Vec3& min() const { return min_; }

private:
    [[nodiscard]] std::optional<double> number(const std::string& name) const {
        return to_number(trim(file_.text("/DataSetInfo/Image", name.c_str())));
    }

    const Hdf5File& file_;
    bool known_ = true;
    Vec3 min_{0, 0, 0}, side_{1, 1, 1};
};

using Shape = std::array<std::uint64_t, 3>;

/// Size of the array along x, y, z, including the padding to whole chunks.
Shape padded_size(const Hdf5File& file, int level, int time, int channel) {
    const std::string data = channel_name(level, time, channel) + "/Data";
    const std::vector<std::uint64_t> shape = shape_of(file, data).shape;
    if (shape.size() != 3)
        throw read_error(Errc::InvalidInput, file.path_of(data),
                         "expected 3 dimensions, got " + std::to_string(shape.size()));
    return {shape[2], shape[1], shape[0]};
}

/// Reads a count from an attribute of a group; nothing if there is no such attribute, or if it is not a positive
/// integer.
std::optional<std::uint64_t> count_at(const Hdf5File& file, const std::string& group, const std::string& name) {
    const auto count = to_number<std::uint64_t>(trim(file.text(group, name.c_str())));
    return count && *count > 0 ? count : std::nullopt;
}

/// The size of a level without the padding to whole chunks. It is taken from the attributes of the channel or, if they
/// do not state it, derived from the size of the finest level in /DataSetInfo/Image.
struct ImarisSize {
    Index3 size{};
    /// Names of the attributes that state the size. Empty if an attribute is missing or exceeds the size of the array:
    /// along that axis, `size` is then the size of the array.
    std::string field;
    bool is_known = true;
};

ImarisSize size_of(const Hdf5File& file, int level, int time, int channel) {
    const std::string name = channel_name(level, time, channel);
    const Shape padded = padded_size(file, level, time, channel);
    std::uint64_t size[3];
    ImarisSize found;
    found.field = "ImageSizeX, Y, Z";
    for (std::size_t a = 0; a < 3; ++a) {
        const auto stated = count_at(file, name, std::string("ImageSize") + "XYZ"[a]);
        if (!stated) found.field.clear();
        size[a] = stated.value_or(padded[a]);
    }
    if (found.field.empty()) {
        const Shape finest = padded_size(file, 0, time, channel);
        found.field = "DataSetInfo/Image X, Y, Z";
        for (std::size_t a = 0; a < 3; ++a) {
            const auto whole = count_at(file, "/DataSetInfo/Image", std::string(1, "XYZ"[a]));
            if (!whole || *whole > finest[a]) found.field.clear();
            if (whole && *whole > finest[a]) found.is_known = false;
            const double factor =
                std::exp2(std::max(0.0, std::round(std::log2(double(finest[a]) / double(padded[a])))));
            const auto part = std::uint64_t(std::max(1.0, std::floor(double(whole.value_or(finest[a])) / factor)));
            size[a] = whole && *whole <= finest[a] ? std::min(padded[a], part) : padded[a];
        }
    }
    found.size = require_3d(file.path_of(name + "/Data"), size);
    return found;
}

/// The number of fine voxels that a coarse voxel covers along each axis, a power of two. The ratio of the sizes is
/// rounded to a power of two, because a coarse voxel that is only partly covered at the end of an axis may be stored or
/// omitted.
Vec3 factors(const Index3& fine, const Index3& coarse) {
    Vec3 factor;
    for (int a = 0; a < 3; ++a)
        factor[a] = std::exp2(std::max(0.0, std::round(std::log2(double(fine[a]) / coarse[a]))));
    return factor;
}

int count_of(const Hdf5File& file, const std::string& group, const char* word) {
    int count = 0;
    const std::vector<std::string> names = file.members(group);
    while (std::binary_search(names.begin(), names.end(), word + std::to_string(count))) ++count;
    return count;
}

Vec3 times(const Vec3& a, const Vec3& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }

void describe_levels(const Hdf5File& file, const Extent& extent, const Index3& fine, const ImarisChoice& choice,
                     Hdf5Layout& layout) {
    ImageInfo& info = layout.info;
    const int count = std::min(count_of(file, "/DataSet", kLevel), kMaxImarisLevels);
    for (int level = 0; level < count; ++level) {
        const std::string name = level_name(level);
        try {
            const Index3 size = size_of(file, level, choice.time.value_or(0), choice.channel.value_or(0)).size;
            info.levels.push_back(level_text(name, size, times(extent.spacing(fine), factors(fine, size))));
            if (level > choice.level) layout.coarser.push_back(name);
        } catch (const Error&) {  // a level that cannot be read is an error only if it is requested
            info.levels.push_back(name + ": cannot be read");
        }
    }
}

}  // namespace

std::optional<Hdf5Layout> imaris_layout(const Hdf5File& file, const std::string& inside) {
    const std::optional<ImarisChoice> choice = parse_imaris(inside);
    if (!choice || !file.has(level_name(0)) || !file.has("/DataSetInfo/Image")) return std::nullopt;
    const int time = choice->time.value_or(0), channel = choice->channel.value_or(0);
    Hdf5Layout layout;
    ImageInfo& info = layout.info;
    info.format = "Imaris";
    layout.in_datasets = true;
    const Extent extent(file);
    const ImarisSize whole = size_of(file, 0, time, channel);
    const Index3& fine = whole.size;
    layout.size = size_of(file, choice->level, time, channel).size;
    const Vec3 factor = factors(fine, *layout.size);
    info.geometry.spacing = times(extent.spacing(fine), factor);
    // ExtMin is the outer corner of the first voxel, whereas the origin is the centre of this voxel.
    for (int a = 0; extent.is_known() && a < 3; ++a)
        info.geometry.origin[a] = extent.min()[a] + 0.5 * info.geometry.spacing[a];
    // If the stated size of the image exceeds its array, it is unknown how many voxels the extent covers, and therefore
    // how large a voxel is.
    const bool is_known = extent.is_known() && whole.is_known;
    info.spacing_known = {is_known, is_known, is_known};
    info.geometry.unit = normal_unit(file.text("/DataSetInfo/Image", "Unit"));
    const std::string level = level_name(choice->level);
    info.frames = choice->time ? 1 : std::max(1, count_of(file, level, kTime));
    info.channels =
        choice->channel ? 1 : std::max(1, count_of(file, level + "/" + kTime + std::to_string(time), kChannel));
    bool named = true;
    for (int c = 0; c < info.channels; ++c) {
        const std::string group = "/DataSetInfo/" + std::string(kChannel) + std::to_string(channel + c);
        info.channel_names.push_back(file.text(group, "Name"));
        named = named && !info.channel_names.back().empty();
    }
    if (!named) info.channel_names.clear();
    for (const char* field : {"ExtMin0", "ExtMin1", "ExtMin2", "ExtMax0", "ExtMax1", "ExtMax2", "Unit"})
        if (const std::string value = file.text("/DataSetInfo/Image", field); !value.empty())
            info.fields.emplace_back(field, quote(value));
    info.fields.emplace_back("size", whole.field.empty() ? "not stated, the array's" : whole.field);
    describe_levels(file, extent, fine, *choice, layout);
    layout.dataset = [level = choice->level, time, channel](std::uint64_t c, std::uint64_t t) {
        return channel_name(level, time + int(t), channel + int(c)) + "/Data";
    };
    return layout;
}

}  // namespace covol::detail
