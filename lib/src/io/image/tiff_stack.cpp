// Interprets the descriptions of the pages of a TIFF that ImageJ, tifffile and OME write.
#include "io/image/tiff_stack.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "io/pixels/raw_image.h"
#include "io/xml.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

// Maximum number of planes. No microscope acquires that many: a larger number means that the description is damaged.
constexpr std::uint64_t kMaxPlanes = std::uint64_t(1) << 24;

double to_number(const std::string& text) {
    double value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    return status == std::errc() && std::isfinite(value) ? value : 0;
}

/// The absolute value of the number, because some programs state a negative distance between slices if the stack is
/// descending.
double to_length(const std::string& text) { return std::abs(to_number(text)); }

/// Rounds a length to 13 significant digits, which removes rounding errors of unit conversions.
double rounded(double length) {
    std::array<char, 32> text{};
    const auto end =
        std::to_chars(text.data(), text.data() + text.size(), length, std::chars_format::scientific, 12).ptr;
    std::from_chars(text.data(), end, length);
    return length;
}

std::uint64_t to_count(const std::string& text, std::uint64_t otherwise = 1) {
    const double value = to_number(text);
    return !text.empty() && value >= 0 && value < 1e9 ? static_cast<std::uint64_t>(value) : otherwise;
}

std::uint64_t at_least_one(const std::string& text) { return std::max<std::uint64_t>(1, to_count(text)); }

/// Converts the spacings along y and z to the unit of x; spacings without a unit are not changed. If one of the units
/// is not a known unit of length, the spacing becomes 0 (unknown), and a warning is added.
void unify_units(TiffStack& stack, const std::array<std::string, 3>& units) {
    stack.unit = units[0];
    const double first = unit_in_metres(units[0]);
    for (int a = 1; a < 3; ++a) {
        if (units[a].empty() || units[a] == units[0] || stack.spacing[a] == 0) continue;
        const double own = unit_in_metres(units[a]);
        if (own > 0 && first > 0) stack.spacing[a] = rounded(stack.spacing[a] * own / first);
        if (own > 0 && first > 0) continue;
        stack.spacing[a] = 0;
        stack.warnings.push_back(std::string("expected units of length along ") + "xyz"[a] + " and x, got '" +
                                 units[a] + "' and '" + units[0] + "': the spacing along " + "xyz"[a] +
                                 " is not known");
    }
}

/// Sets the spacing along x and y to 1 / resolution. The unit of the resolution is ignored.
void read_resolution(const TiffFacts& facts, TiffStack& stack) {
    for (std::size_t a = 0; a < 2; ++a) {
        const float spacing = 1.0F / facts.resolution[a];
        if (!std::isfinite(spacing) || !(spacing > 0)) continue;
        // libtiff returns single precision. The shortest text that represents `spacing` is usually the decimal number
        // that the writer intended, for example 0.35.
        std::array<char, 32> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), spacing).ptr;
        std::from_chars(text.data(), end, stack.spacing[a]);
        stack.fields.emplace_back(a == 0 ? "XResolution" : "YResolution",
                                  "1 / " + std::string(text.data(), std::size_t(end - text.data())));
    }
}

// ---- ImageJ -------------------------------------------------------------------------------------------------------

/// The value of `key=` in ImageJ's description, which has one key per line; empty if there is no such line.
std::string imagej_value(const std::string& description, const std::string& key) {
    for (std::size_t begin = 0; begin < description.size();) {
        const std::size_t end = std::min(description.find('\n', begin), description.size());
        if (description.compare(begin, key.size() + 1, key + "=") == 0)
            return description.substr(begin + key.size() + 1, end - begin - key.size() - 1);
        begin = end + 1;
    }
    return {};
}

void read_imagej(const TiffFacts& facts, TiffStack& stack) {
    const auto value = [&](const char* key) {
        std::string text = imagej_value(facts.description, key);
        if (!text.empty()) stack.fields.emplace_back(key, text);
        return text;
    };
    stack.format = "ImageJ TIFF";
    stack.channels = at_least_one(value("channels"));
    const std::string slices = value("slices");
    stack.frames = at_least_one(value("frames"));
    stack.slices = at_least_one(slices);
    if (slices.empty() && stack.channels * stack.frames == 1) stack.slices = facts.pages;

    std::array<std::string, 3> units{normal_unit(value("unit")), normal_unit(value("yunit")),
                                     normal_unit(value("zunit"))};
    constexpr int kInch = 2, kCentimetre = 3;
    if (units[0].empty() && facts.resolution_unit == kInch) units[0] = "inch";
    if (units[0].empty() && facts.resolution_unit == kCentimetre) units[0] = "cm";
    const std::string depth = value("spacing");
    // A resolution of 1 without a unit is what programs write if they do not know the spacing.
    const bool known = !units[0].empty() || facts.resolution[0] != 1.0F || !depth.empty();
    if (!known) return;
    read_resolution(facts, stack);
    stack.spacing[2] = to_length(depth);
    // ImageJ omits the distance between slices if it is 1.
    if (stack.spacing[2] == 0 && stack.spacing[0] > 0) stack.spacing[2] = 1;
    unify_units(stack, units);
    // ImageJ's origin is the position, in voxels, of the point 0 of the world.
    const std::array<std::string, 3> origin{value("xorigin"), value("yorigin"), value("zorigin")};
    for (int a = 0; a < 3; ++a)
        if (const double voxel = to_number(origin[a]); voxel != 0) stack.origin[a] = -voxel * stack.spacing[a];
}

// ---- tifffile -----------------------------------------------------------------------------------------------------

/// The description that tifffile writes: {"shape": [58, 512, 512], "axes": "ZYX", "spacing": 1.0, "unit": "um"}.
void read_tifffile(const TiffFacts& facts, TiffStack& stack) {
    const auto json = nlohmann::json::parse(facts.description, nullptr, false);
    if (!json.is_object() || !json.contains("shape") || !json.at("shape").is_array()) return;
    std::vector<std::uint64_t> shape;
    for (const auto& n : json.at("shape")) shape.push_back(n.is_number_unsigned() ? n.get<std::uint64_t>() : 0);
    std::string axes;
    if (json.contains("axes") && json.at("axes").is_string()) axes = json.at("axes").get<std::string>();
    if (axes.size() != shape.size()) axes = std::string("TCZYX").substr(shape.size() < 5 ? 5 - shape.size() : 0);
    if (axes.size() != shape.size()) return;
    stack.format = "tifffile's TIFF";
    stack.fields.emplace_back("axes", axes);
    std::uint64_t planes = 1;
    TiffStack read = stack;
    read.slices = 1;
    read.order.clear();
    for (std::size_t n = shape.size(); n-- > 0;) {
        const char axis = axes[n];
        if (axis == 'X' || axis == 'Y' || axis == 'S') continue;
        std::uint64_t& count = axis == 'C' ? read.channels : axis == 'T' ? read.frames : read.slices;
        count = shape[n];
        read.order += axis == 'C' || axis == 'T' ? axis : 'Z';
        if (shape[n] == 0 || (planes *= shape[n]) > kMaxPlanes) break;
    }
    for (const char axis : {'Z', 'C', 'T'})
        if (read.order.find(axis) == std::string::npos) read.order += axis;
    if (planes == facts.pages && read.order.size() == 3) stack = read;
    if (json.contains("spacing") && json.at("spacing").is_number()) {
        const double depth = json.at("spacing").get<double>();
        if (std::isfinite(depth) && depth != 0) {
            stack.spacing[2] = std::abs(depth);
            stack.fields.emplace_back("spacing", std::to_string(depth));
        }
    }
    if (json.contains("unit") && json.at("unit").is_string())
        stack.unit = normal_unit(json.at("unit").get<std::string>());
    // tifffile writes the resolution 1/1 if it does not know the spacing.
    if (facts.resolution[0] != 1.0F && facts.resolution_unit == 1) read_resolution(facts, stack);
}

// ---- OME ----------------------------------------------------------------------------------------------------------

struct OmeUnit {
    const char* text;
    double metres;
};
/// UnitsLength of the schema, which is case-sensitive: "Mm" is a million metres.
/// https://www.openmicroscopy.org/Schemas/OME/2016-06
constexpr OmeUnit kOmeUnits[] = {{"Ym", 1e24},
                                 {"Zm", 1e21},
                                 {"Em", 1e18},
                                 {"Pm", 1e15},
                                 {"Tm", 1e12},
                                 {"Gm", 1e9},
                                 {"Mm", 1e6},
                                 {"km", 1e3},
                                 {"hm", 1e2},
                                 {"dam", 1e1},
                                 {"m", 1},
                                 {"dm", 1e-1},
                                 {"cm", 1e-2},
                                 {"mm", 1e-3},
                                 {"\xC2\xB5m", 1e-6},
                                 {"\xCE\xBCm", 1e-6},
                                 {"um", 1e-6},
                                 {"nm", 1e-9},
                                 {"pm", 1e-12},
                                 {"fm", 1e-15},
                                 {"am", 1e-18},
                                 {"zm", 1e-21},
                                 {"ym", 1e-24},
                                 {"\xC3\x85", 1e-10},
                                 {"\xE2\x84\xAB", 1e-10},
                                 {"thou", 2.54e-5},
                                 {"li", 0.0254 / 12},
                                 {"in", 0.0254},
                                 {"ft", 0.3048},
                                 {"yd", 0.9144},
                                 {"mi", 1609.344},
                                 {"ua", 149597870700.0},
                                 {"ly", 9460730472580800.0},
                                 {"pc", 3.0856775814913673e16},
                                 {"pt", 0.0254 / 72}};

double ome_unit_in_metres(const std::string& text) {
    for (const OmeUnit& unit : kOmeUnits)
        if (text == unit.text) return unit.metres;
    return 0;
}

/// Sets the unit of the image: the unit of the axes if all axes have the same unit and unit_in_metres() knows it,
/// otherwise the micrometre. An axis whose unit the schema does not define has no spacing. The image has no unit if all
/// axes have the unit "reference frame", or all have the unit "pixel".
void read_ome_units(const std::array<std::string, 3>& texts, TiffStack& stack) {
    const bool alike = texts[0] == texts[1] && texts[1] == texts[2];
    if (alike && (texts[0] == "reference frame" || texts[0] == "pixel")) return;
    const std::string common = alike ? normal_unit(texts[0]) : "um";
    const bool is_kept = alike && unit_in_metres(common) > 0 && unit_in_metres(common) == ome_unit_in_metres(texts[0]);
    stack.unit = is_kept ? common : "um";
    for (std::size_t a = 0; a < 3; ++a) {
        const double metres = ome_unit_in_metres(texts[a]);
        if (metres == 0 && stack.spacing[a] > 0)
            stack.warnings.push_back(std::string("PhysicalSize") + "XYZ"[a] +
                                     "Unit: expected a unit of the OME schema, got '" + texts[a] +
                                     "': the spacing along " + "xyz"[a] + " is not known");
        if (metres == 0) stack.spacing[a] = 0;
        if (metres > 0 && !is_kept) stack.spacing[a] = rounded(stack.spacing[a] * metres / 1e-6);
    }
}

/// A <TiffData> element, which assigns planes to pages.
struct TiffData {
    std::string ifd, plane_count, file;  ///< attributes as in the XML; empty if absent
    std::uint64_t z = 0, c = 0, t = 0;
};

struct OmePixels {
    XmlTag pixels;
    std::vector<std::string> channels;
    std::vector<TiffData> data;
    std::string metadata_file;  ///< name of the file with the XML; empty if the XML is in this file
    int images = 0;
};

/// Parses the first image of the XML.
OmePixels parse_ome(const std::string& xml) {
    OmePixels ome;
    XmlTags tags(xml);
    XmlTag tag;
    while (tags.next(tag)) {
        if (tag.closing) continue;
        if (tag.name == "BinaryOnly") ome.metadata_file = tag.value("MetadataFile");
        // Only <Pixels> of the first <Image> is used, or <Pixels> before any <Image>, because some writers omit
        // <Image>.
        if (tag.name == "Image") ++ome.images;
        if (ome.images > 1) continue;
        if (tag.name == "Pixels" && ome.pixels.name.empty()) ome.pixels = tag;
        if (tag.name == "Channel") ome.channels.push_back(tag.value("Name"));
        if (tag.name == "TiffData")
            ome.data.push_back({tag.value("IFD"), tag.value("PlaneCount"), "", to_count(tag.value("FirstZ"), 0),
                                to_count(tag.value("FirstC"), 0), to_count(tag.value("FirstT"), 0)});
        if (tag.name == "UUID" && !ome.data.empty()) ome.data.back().file = tag.value("FileName");
    }
    return ome;
}

/// @param files  receives the path of the metadata file if one is read
OmePixels read_ome_xml(const TiffFacts& facts, std::vector<std::string>& files) {
    OmePixels ome = parse_ome(facts.description);
    if (!ome.pixels.name.empty() || ome.metadata_file.empty()) return ome;
    constexpr std::uintmax_t kLargest = std::uintmax_t(256) << 20;
    const fs::path other = fs::path(facts.path).parent_path() / fs::path(ome.metadata_file).filename();
    std::error_code status;
    const std::uintmax_t bytes = fs::file_size(other, status);
    if (status || bytes > kLargest)
        throw read_error(Errc::Io, facts.path,
                         "its description lies in " + other.string() + ", which cannot be read or exceeds 256 MiB");
    files.push_back(other.string());
    std::string xml(bytes, '\0');
    std::ifstream(other, std::ios::binary).read(xml.data(), static_cast<std::streamsize>(bytes));
    return parse_ome(xml);
}

/// Fills stack.planes from <TiffData>.
class OmePlanes {
public:
    OmePlanes(const TiffFacts& facts, TiffStack& stack) : facts_(facts), stack_(stack) {}

    void assign(const std::vector<TiffData>& data) {
        const std::uint64_t planes = stack_.slices * stack_.channels * stack_.frames;
        stack_.planes.assign(planes, {});
        name_files(data);
        for (const TiffData& block : data) {
            if (block.z >= stack_.slices || block.c >= stack_.channels || block.t >= stack_.frames)
                throw read_error(Errc::InvalidInput, facts_.path,
                                 "its OME-XML names a plane beyond SizeZ, SizeC or SizeT");
            const std::uint32_t file = number_of(block.file);
            const std::uint64_t first = stack_.number(block.z, block.c, block.t);
            const std::uint64_t page = to_count(block.ifd, 0);
            std::uint64_t count = 1;
            if (!block.plane_count.empty())
                count = to_count(block.plane_count, 0);
            else if (block.ifd.empty())
                count = pages_of(file);
            for (std::uint64_t n = 0; n < count && first + n < planes && page + n < kMaxPlanes; ++n)
                stack_.planes[first + n] = {file, static_cast<std::uint32_t>(page + n)};
        }
    }

private:
    /// Assigns the names of files to file numbers. If all planes are in one file, and this file does not exist, the
    /// file that is being read has been renamed: the name then refers to it.
    void name_files(const std::vector<TiffData>& data) {
        const std::string own = fs::path(facts_.path).filename().string();
        numbers_[""] = numbers_[own] = 0;
        std::map<std::string, int> others;
        bool own_is_named = false;
        for (const TiffData& block : data) {
            own_is_named = own_is_named || block.file.empty() || block.file == own;
            if (!block.file.empty() && block.file != own) ++others[block.file];
        }
        if (!own_is_named && others.size() == 1 && !fs::exists(path_of(others.begin()->first)))
            numbers_[others.begin()->first] = 0;
    }
    [[nodiscard]] std::string path_of(const std::string& name) const {
        return (fs::path(facts_.path).parent_path() / fs::path(name).filename()).string();
    }
    std::uint32_t number_of(const std::string& name) {
        const auto [entry, is_new] = numbers_.try_emplace(name, static_cast<std::uint32_t>(stack_.files.size()));
        if (is_new) stack_.files.push_back(path_of(name));
        return entry->second;
    }
    std::uint64_t pages_of(std::uint32_t file) {
        return file == 0 ? facts_.pages : facts_.count_pages(stack_.files[file]);
    }

    const TiffFacts& facts_;
    TiffStack& stack_;
    std::map<std::string, std::uint32_t> numbers_;
};

void read_ome(const TiffFacts& facts, TiffStack& stack) {
    const OmePixels ome = read_ome_xml(facts, stack.descriptions);
    const XmlTag& pixels = ome.pixels;
    if (pixels.name.empty()) return;
    const auto value = [&](const std::string& key) {
        std::string text = pixels.value(key);
        if (!text.empty()) stack.fields.emplace_back(key, text);
        return text;
    };
    stack.format = "OME-TIFF";
    stack.slices = at_least_one(value("SizeZ"));
    stack.channels = at_least_one(value("SizeC"));
    stack.frames = at_least_one(value("SizeT"));
    if (ome.images > 1) stack.fields.emplace_back("Image", "the first of " + std::to_string(ome.images));
    const std::string order = value("DimensionOrder");
    if (order.size() == 5) stack.order = order.substr(2);
    std::string sorted = stack.order;
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "CTZ") stack.order = "CZT";
    std::array<std::string, 3> units;
    for (int a = 0; a < 3; ++a) {
        const std::string key = std::string("PhysicalSize") + "XYZ"[a];
        stack.spacing[a] = to_length(value(key));
        const std::string unit = value(key + "Unit");
        units[a] = unit.empty() ? "\xC2\xB5m" : unit;  // micrometre, the default of the OME schema
    }
    // An axis without a spacing gets the unit of another axis, so that it does not affect the choice of the common
    // unit.
    for (int a = 0; a < 3; ++a)
        if (stack.spacing[a] == 0) units[a] = units[stack.spacing[0] > 0 ? 0 : stack.spacing[1] > 0 ? 1 : 2];
    read_ome_units(units, stack);
    const bool named =
        std::any_of(ome.channels.begin(), ome.channels.end(), [](const std::string& n) { return !n.empty(); });
    if (named && ome.channels.size() == stack.channels) stack.channel_names = ome.channels;
    if (stack.slices > kMaxPlanes || stack.channels > kMaxPlanes || stack.frames > kMaxPlanes ||
        stack.slices * stack.channels > kMaxPlanes || stack.slices * stack.channels * stack.frames > kMaxPlanes)
        throw read_error(Errc::InvalidInput, facts.path,
                         "expected at most 2^24 planes, but its OME-XML claims more; it is damaged");
    if (!ome.data.empty()) OmePlanes(facts, stack).assign(ome.data);
}

}  // namespace

std::uint64_t TiffStack::number(std::uint64_t z, std::uint64_t c, std::uint64_t t) const {
    std::uint64_t number = 0;
    std::uint64_t stride = 1;
    for (const char axis : order) {
        number += stride * (axis == 'Z' ? z : axis == 'C' ? c : t);
        stride *= axis == 'Z' ? slices : axis == 'C' ? channels : frames;
    }
    return number;
}

TiffStack::Plane TiffStack::plane(std::uint64_t z, std::uint64_t c, std::uint64_t t) const {
    const std::uint64_t n = number(z, c, t);
    return planes.empty() ? Plane{0, static_cast<std::uint32_t>(n)} : planes[n];
}

std::uint64_t imagej_images(const std::string& description) {
    return description.rfind("ImageJ=", 0) == 0 ? at_least_one(imagej_value(description, "images")) : 1;
}

TiffStack describe_tiff(const TiffFacts& facts) {
    TiffStack stack;
    stack.slices = facts.pages;
    stack.files = {facts.path};
    const std::string& text = facts.description;
    if (text.rfind("ImageJ=", 0) == 0)
        read_imagej(facts, stack);
    else if (text.find("<OME") != std::string::npos || text.find(":OME") != std::string::npos)
        read_ome(facts, stack);
    else if (text.rfind('{', 0) == 0)
        read_tifffile(facts, stack);
    const bool in_order = stack.planes.empty();
    if (in_order && (stack.slices > kMaxPlanes || stack.channels > kMaxPlanes || stack.frames > kMaxPlanes ||
                     stack.slices * stack.channels * stack.frames != facts.pages)) {
        // The description does not match the pages, for example because a program removed pages and kept the
        // description. All pages are then slices.
        stack.slices = facts.pages;
        stack.channels = stack.frames = 1;
        stack.channel_names.clear();
    }
    return stack;
}

std::string plane_axes(const TiffStack& stack) {
    std::string axes;
    for (const char axis : stack.order)
        if ((axis == 'Z' ? stack.slices : axis == 'C' ? stack.channels : stack.frames) > 1)
            axes.insert(axes.begin(), axis);
    return axes;
}

void rename_axes(const std::string& path, const std::string& axes, TiffStack& stack) {
    if (axes.empty()) return;
    std::string word = axes;
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    const std::string there = plane_axes(stack), wanted = word.substr(0, word.size() < 2 ? 0 : word.size() - 2);
    const auto count_of = [&](char axis) -> std::uint64_t& {
        return axis == 'Z' ? stack.slices : axis == 'C' ? stack.channels : stack.frames;
    };
    std::string sorted = wanted, list;
    std::sort(sorted.begin(), sorted.end());
    const bool is_sound = word.ends_with("YX") && wanted.find('Z') != std::string::npos &&
                          sorted.find_first_not_of("CTZ") == std::string::npos &&
                          std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
    for (const char axis : there)
        list += (list.empty() ? "" : ", ") + std::string(1, axis) + " of " + std::to_string(count_of(axis));
    if (!is_sound || (wanted.size() != there.size() && wanted.size() != 1))
        throw read_error(Errc::InvalidInput, path,
                         "expected ZYX, which reads all planes as slices, or one of the letters C, T and Z for each of "
                         "the file's axes of planes (" +
                             (list.empty() ? "none" : list) + ") before YX, such as ZCYX; got '" + axes + "'");
    if (stack.slices == 1) {
        // The planes become slices. Their distance is known only if the file states it, so ImageJ's default of 1 is
        // discarded.
        const bool stated = std::any_of(stack.fields.begin(), stack.fields.end(), [](const auto& field) {
            return field.first == "spacing" || field.first == "PhysicalSizeZ";
        });
        if (!stated) stack.spacing[2] = 0;
    }
    std::vector<std::uint64_t> counts;
    for (const char axis : there) counts.push_back(count_of(axis));
    if (wanted.size() == 1) counts.assign(1, stack.slices * stack.channels * stack.frames);
    stack.slices = stack.channels = stack.frames = 1;
    stack.order.clear();
    for (std::size_t n = wanted.size(); n-- > 0;) {
        count_of(wanted[n]) = counts[n];
        stack.order += wanted[n];
    }
    for (const char axis : {'Z', 'C', 'T'})
        if (stack.order.find(axis) == std::string::npos) stack.order += axis;
    if (stack.channels == 1 || wanted != there) stack.channel_names.clear();
    stack.fields.emplace_back("axes", word + ", as requested; the file states " + there + "YX");
}

}  // namespace covol::detail
