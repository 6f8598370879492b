// Reads Image Cytometry Standard, versions 1.0 and 2.0: a text header, followed by the voxels. In version 1.0, the
// voxels are in a separate file, .ids. P. Dean, L. Mascio, D. Ow, D. Sudar, J. Mullikin, Cytometry 11 (1990), 561-569;
// version 2.0 as written by libics.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.h"
#include "io/image/image_formats.h"
#include "io/image/text_header.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;
using std::string_view;

constexpr int kMaxVolumes = 1 << 20;

/// The lines of a header in the categories "layout", "representation", "parameter" and "source". The categories
/// "history" and "sensor" are skipped.
class IcsHeader {
public:
    /// @throws Error InvalidInput.
    explicit IcsHeader(std::string path) : path_(std::move(path)) {
        // [bytes] The limit is large because programs append their history to the header.
        constexpr std::size_t kMaxHeader = std::size_t(1) << 20;
        std::ifstream file(path_, std::ios::binary);
        std::string text(kMaxHeader, '\0');
        file.read(text.data(), static_cast<std::streamsize>(text.size()));
        text.resize(static_cast<std::size_t>(file.gcount()));
        read(text);
        if (end_ == 0 && text.size() == kMaxHeader)
            throw read_error(Errc::Unsupported, path_,
                             "expected a header of at most 1 MiB, got no line \"end\" in it; save the image again "
                             "without its history");
    }

    [[nodiscard]] int version() const { return version_; }
    /// Position of the first byte after the line "end".
    [[nodiscard]] std::uint64_t end() const { return end_; }
    /// The words after the key of a line, for example after "layout sizes"; none if there is no such line.
    [[nodiscard]] const std::vector<std::string>& values(const std::string& key) const {
        static const std::vector<std::string> none{};
        const auto found = lines_.find(key);
        return found == lines_.end() ? none : found->second;
    }
    /// The first value of a line in lower case; empty if there is none.
    [[nodiscard]] std::string word(const std::string& key) const {
        return values(key).empty() ? "" : lower(values(key).front());
    }
    /// All values of a line, separated by blanks.
    [[nodiscard]] std::string joined(const std::string& key) const {
        std::string text;
        for (const std::string& value : values(key)) text += (text.empty() ? "" : " ") + value;
        return text;
    }
    /// The value with index `at` of a line as a number; nothing if there is none. @throws Error InvalidInput if it is
    /// not a finite number.
    [[nodiscard]] std::optional<double> number(const std::string& key, std::size_t at) const {
        if (at >= values(key).size()) return std::nullopt;
        const std::optional<double> value = to_number(values(key)[at]);
        if (!value || !std::isfinite(*value))
            throw damaged("expected a number in " + key + ", got " + quote(values(key)[at]));
        return value;
    }
    [[nodiscard]] Error damaged(const std::string& what) const {
        return read_error(Errc::InvalidInput, path_, "damaged, truncated, or not an ICS file (" + what + ")");
    }

private:
    void read(const std::string& text) {
        // The first byte separates words, and the second separates lines. If a text editor has put carriage returns
        // before line ends, the first line end consists of two bytes.
        if (text.size() < 4 || text[0] == text[1]) throw damaged("expected two separators in its first bytes");
        const char between = text[0];
        const bool is_dos = text[1] == '\r' && text[2] == '\n' && between != '\n';
        const char line_end = is_dos ? '\n' : text[1];
        for (std::size_t at = is_dos ? 3 : 2; at < text.size() && end_ == 0;) {
            const std::size_t last = std::min(text.find(line_end, at), text.size());
            string_view line = string_view(text).substr(at, last - at);
            if (line.ends_with('\r')) line.remove_suffix(1);
            at = last + 1;
            if (take(words_of(line, between))) end_ = at;
        }
        if (version_ == 0) throw damaged("expected ics_version 1.0 or 2.0 in the line after the two separators");
    }

    static std::vector<std::string> words_of(string_view line, char between) {
        std::vector<std::string> words;
        for (std::size_t at = 0; at < line.size();) {
            const std::size_t last = std::min(line.find(between, at), line.size());
            // Blanks are removed, because Bio-Formats pads the sizes with them.
            if (const string_view word = trim(line.substr(at, last - at)); !word.empty()) words.emplace_back(word);
            at = last + 1;
        }
        return words;
    }

    /// Takes the words of one line. @returns whether it is the line "end"
    bool take(std::vector<std::string> words) {
        if (version_ == 0) {
            if (words.size() < 2 || lower(words[0]) != "ics_version" || (words[1] != "1.0" && words[1] != "2.0"))
                throw damaged("expected ics_version 1.0 or 2.0 in the line after the two separators");
            version_ = words[1] == "1.0" ? 1 : 2;
            return false;
        }
        if (words.size() == 1 && lower(words[0]) == "end") return true;
        if (words.size() < 3) return false;
        const std::string category = lower(words[0]);
        if (category != "layout" && category != "representation" && category != "parameter" && category != "source")
            return false;
        const std::string key = category + " " + lower(words[1]);
        words.erase(words.begin(), words.begin() + 2);
        lines_[key] = std::move(words);  // if a key occurs in several lines, the last one is valid, as in libics
        return false;
    }

    std::string path_;
    int version_ = 0;
    std::uint64_t end_ = 0;
    std::map<std::string, std::vector<std::string>> lines_;
};

/// The sizes that a header states: bits of a voxel, then x, y and z, then channels and frames in either order.
struct IcsAxes {
    std::uint64_t bits = 0;
    std::array<std::uint64_t, 3> size{1, 1, 1};
    int channels = 1, frames = 1;
    bool channels_first = true;  ///< whether channels vary faster than frames in the file
    std::string order;           ///< the axes, the fastest first, for example "XYZCT"
};

/// Whether this is one of the names that libics, Huygens and Bio-Formats use for the axis of channels.
bool is_channels(const std::string& name) {
    constexpr std::array kNames{"p", "c", "ch", "channel", "channels", "probe", "probes"};
    return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

IcsAxes axes_of(const std::string& path, const IcsHeader& header) {
    const std::vector<std::string>& names = header.values("layout order");
    const std::vector<std::string>& texts = header.values("layout sizes");
    const std::string stated = header.word("layout parameters");
    const std::size_t count = stated.empty() ? names.size() : to_number<std::size_t>(stated).value_or(0);
    if (count < 2 || names.size() < count || texts.size() < count)
        throw header.damaged("expected a name and a size for each axis in its layout, got " +
                             std::to_string(names.size()) + " names and " + std::to_string(texts.size()) + " sizes" +
                             (stated.empty() ? "" : ", and " + quote(stated) + " as the number of axes"));
    std::vector<std::uint64_t> sizes;
    for (std::size_t n = 0; n < count; ++n) {
        const auto size = to_number<std::uint64_t>(texts[n]);
        if (!size) throw header.damaged("expected whole numbers as sizes, got " + quote(texts[n]));
        sizes.push_back(*size);
    }
    const auto refuse = [&] {
        return read_error(Errc::Unsupported, path,
                          "expected the axes bits, x, y, z, and then channels (p, c, ch, channel, channels, probe or "
                          "probes) and time points (t or time), got " +
                              quote(header.joined("layout order")) + "; save the stack in that order");
    };
    IcsAxes axes;
    axes.bits = sizes[0];
    if (lower(names[0]) != "bits") throw refuse();
    bool has_channels = false, has_frames = false;
    for (std::size_t n = 1; n < count; ++n) {
        const std::string name = lower(names[n]);
        if (n < 4) {
            if (name != std::string(1, "xyz"[n - 1])) throw refuse();
            axes.size[n - 1] = sizes[n];
            axes.order += "XYZ"[n - 1];
            continue;
        }
        const bool is_channel = is_channels(name), is_frame = name == "t" || name == "time";
        bool& seen = is_channel ? has_channels : has_frames;
        if ((!is_channel && !is_frame) || seen) {
            if (sizes[n] != 1) throw refuse();
            continue;
        }
        if (sizes[n] < 1 || sizes[n] > std::uint64_t(kMaxVolumes))
            throw read_error(Errc::InvalidInput, path,
                             "expected 1 to 2^20 frames and channels, but the header claims " + texts[n]);
        if (is_channel) axes.channels_first = !has_frames;
        seen = true;
        (is_channel ? axes.channels : axes.frames) = static_cast<int>(sizes[n]);
        axes.order += is_channel ? 'C' : 'T';
    }
    return axes;
}

void set_pixel_type(const std::string& path, const IcsHeader& header, std::uint64_t bits, PixelPlace& place) {
    const std::string stated = header.word("representation format");
    const std::string format = stated == "float" ? "real" : stated;
    const bool is_signed = header.word("representation sign") != "unsigned";
    static constexpr struct {
        const char* format;
        std::uint64_t bits;
        bool is_signed;
        PixelType type;
    } kTypes[] = {{"integer", 8, false, PixelType::UInt8},   {"integer", 8, true, PixelType::Int8},
                  {"integer", 16, false, PixelType::UInt16}, {"integer", 16, true, PixelType::Int16},
                  {"integer", 32, false, PixelType::UInt32}, {"integer", 32, true, PixelType::Int32},
                  {"real", 32, true, PixelType::Float},      {"real", 64, true, PixelType::Double}};
    const auto* const type = std::find_if(std::begin(kTypes), std::end(kTypes), [&](const auto& known) {
        return format == known.format && bits == known.bits && (format == "real" || is_signed == known.is_signed);
    });
    if (type == std::end(kTypes))
        throw read_error(Errc::Unsupported, path,
                         "expected integers of 8, 16 or 32 bits, or reals of 32 or 64 bits, got the format " +
                             quote(stated) + " with " + std::to_string(bits) + " bits");
    place.type = type->type;
    // For each byte of a stored number, the line states its significance; 1 is the lowest. "1 2" is little-endian, "2
    // 1" big-endian.
    const std::vector<std::string>& order = header.values("representation byte_order");
    const std::size_t bytes = bits / 8;
    bool little = true, big = true;
    for (std::size_t n = 0; n < bytes && order.size() >= bytes; ++n) {
        little = little && order[n] == std::to_string(n + 1);
        big = big && order[n] == std::to_string(bytes - n);
    }
    if (bytes > 1 && (order.size() < bytes || little == big))
        throw read_error(
            Errc::Unsupported, path,
            "expected the byte order 1 2 ... or ... 2 1, got " + quote(header.joined("representation byte_order")));
    place.swap = bytes > 1 && big == (std::endian::native == std::endian::little);
}

/// Sets spacing and origin, in the unit of x. libics writes a scale of 1 and the unit "undefined" if the spacing is not
/// known; a unit of pixels means the same.
void set_geometry(const IcsHeader& header, ImageInfo& info) {
    ImageGeometry& geometry = info.geometry;
    const std::vector<std::string>& units = header.values("parameter units");
    const auto unit_of = [&](std::size_t axis) {
        const std::string unit = axis + 1 < units.size() ? normal_unit(units[axis + 1]) : "";
        return unit == "undefined" || unit == "px" || unit == "pixel" ? "" : unit;
    };
    geometry.unit = unit_of(0);
    for (std::size_t a = 0; a < 3; ++a) {
        const std::string unit = unit_of(a);
        const double metres = unit_in_metres(unit), common = unit_in_metres(geometry.unit);
        const double factor = unit == geometry.unit ? 1 : metres > 0 && common > 0 ? metres / common : 0;
        const double scale = header.number("parameter scale", a + 1).value_or(0);
        info.spacing_known[a] = scale > 0 && factor > 0 && (!unit.empty() || scale != 1);
        geometry.spacing[a] = info.spacing_known[a] ? scale * factor : 1;
        geometry.origin[a] = info.spacing_known[a] ? header.number("parameter origin", a + 1).value_or(0) * factor : 0;
    }
    for (const char* key : {"layout order", "layout sizes", "layout coordinates", "representation format",
                            "representation sign", "representation byte_order", "representation compression",
                            "parameter scale", "parameter origin", "parameter units"})
        if (const std::string found = header.joined(key); !found.empty()) info.fields.emplace_back(key, found);
}

/// A file whose channels and frames are whole volumes, stored one after another.
class IcsFile : public ImageFile {
public:
    /// @param volumes  the voxels of the file as an image with a single channel, whose frames are all channels and
    /// frames of `info`
    IcsFile(std::unique_ptr<ImageFile> volumes, const ImageInfo& info, bool channels_first)
        : volumes_(std::move(volumes)), channels_first_(channels_first) {
        info_ = info;
        info_.chunk_size = volumes_->info().chunk_size;
    }
    [[nodiscard]] std::uint64_t bytes_to_hold(const PixelRequest& request) const override {
        return volumes_->bytes_to_hold(volume_of(request));
    }
    Pixels read(const PixelRequest& request, const RunContext& run) override {
        return volumes_->read(volume_of(request), run);
    }

private:
    [[nodiscard]] PixelRequest volume_of(const PixelRequest& request) const {
        PixelRequest volume = request;
        volume.frame = channels_first_ ? request.frame * std::uint64_t(info_.channels) + request.channel
                                       : request.channel * std::uint64_t(info_.frames) + request.frame;
        volume.channel = 0;
        return volume;
    }

    std::unique_ptr<ImageFile> volumes_;
    bool channels_first_;
};

}  // namespace

std::unique_ptr<ImageFile> open_ics(const std::string& path) {
    const IcsHeader header(path);
    const IcsAxes axes = axes_of(path, header);
    ImageInfo info;
    info.format = "ICS " + std::to_string(header.version()) + ".0";
    info.axis_order = axes.order;
    info.channels = axes.channels;
    info.frames = axes.frames;
    info.geometry.size = require_3d(path, {axes.size[0], axes.size[1], axes.size[2]});
    set_geometry(header, info);
    PixelPlace place;
    set_pixel_type(path, header, axes.bits, place);
    info.type = place.type;
    const std::string compression = header.word("representation compression");
    if (!compression.empty() && compression != "uncompressed" && compression != "gzip")
        throw read_error(Errc::Unsupported, path,
                         "expected uncompressed voxels or gzip, got the compression " + quote(compression));
    place.packed = compression == "gzip";
    std::vector<std::string> files;
    if (header.version() == 1) {
        place.path = fs::path(path).replace_extension(path.ends_with("S") ? ".IDS" : ".ids").string();
        std::error_code status;
        if (!fs::exists(place.path, status) && fs::exists(place.path + ".gz", status)) {
            place.path += ".gz";
            place.packed = true;
        }
        files = {place.path};
        require_regular_files(path, files);
    } else {
        if (!header.values("source file").empty())
            throw read_error(Errc::Unsupported, path,
                             "expected the voxels in the same file, got a header that names another one; save it again "
                             "as one file");
        if (header.end() == 0) throw header.damaged("its header has no end");
        place.path = path;
        place.file_offset = header.end();
    }
    if (axes.channels > kMaxVolumes / axes.frames)
        throw read_error(Errc::InvalidInput, path, "expected 1 to 2^20 volumes, but the header claims more");
    ImageInfo volumes = info;
    volumes.channels = 1;
    volumes.frames = axes.channels * axes.frames;
    std::unique_ptr<ImageFile> file = open_placed(path, volumes, place);
    if (axes.channels > 1) file = std::make_unique<IcsFile>(std::move(file), info, axes.channels_first);
    file->refer_to(files);
    return file;
}

}  // namespace covol::detail
