#include "detail/tiff.h"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "covol/error.h"

namespace covol::detail {
namespace {

/// A libtiff handle that keeps the first error message instead of printing it.
class Tiff {
public:
    Tiff(const std::string& path, const char* mode, tmsize_t largest_allocation) : path_(path) {
        TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
        TIFFOpenOptionsSetErrorHandlerExtR(options, &Tiff::keep_message, this);
        TIFFOpenOptionsSetWarningHandlerExtR(options, &Tiff::drop_message, this);
        if (largest_allocation > 0) TIFFOpenOptionsSetMaxSingleMemAlloc(options, largest_allocation);
        handle_ = TIFFOpenExt(path.c_str(), mode, options);
        TIFFOpenOptionsFree(options);
    }
    ~Tiff() { close(); }
    Tiff(const Tiff&) = delete;
    Tiff& operator=(const Tiff&) = delete;

    void close() {
        if (handle_ != nullptr) TIFFClose(handle_);
        handle_ = nullptr;
    }
    [[nodiscard]] TIFF* get() const { return handle_; }
    [[nodiscard]] const std::string& message() const { return message_; }
    [[nodiscard]] Error error(Errc code, const std::string& what) const {
        return {code, what + (message_.empty() ? "" : " (" + message_ + ")")};
    }
    template <typename T>
    [[nodiscard]] T tag(ttag_t name, T fallback) const {
        T value = fallback;
        return TIFFGetFieldDefaulted(handle_, name, &value) == 1 ? value : fallback;
    }
    [[nodiscard]] std::string text(ttag_t name) const {
        const char* value = nullptr;
        return TIFFGetField(handle_, name, &value) == 1 && value != nullptr ? value : "";
    }

private:
    static int keep_message(TIFF*, void* self, const char*, const char* format, va_list arguments) {
        auto* tiff = static_cast<Tiff*>(self);
        std::array<char, 512> line{};
        std::vsnprintf(line.data(), line.size(), format, arguments);
        if (tiff->message_.empty()) tiff->message_ = line.data();
        return 1;
    }
    static int drop_message(TIFF*, void*, const char*, const char*, va_list) { return 1; }

    std::string path_;
    std::string message_;
    TIFF* handle_ = nullptr;
};

struct Page {
    std::uint64_t offset = 0;  ///< of the directory in the file
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 0, format = 0, samples = 0;

    [[nodiscard]] bool same_kind(const Page& o) const {
        return width == o.width && height == o.height && bits == o.bits && format == o.format && samples == o.samples;
    }
    [[nodiscard]] std::string to_text() const {
        return std::to_string(width) + " x " + std::to_string(height) + " with " + std::to_string(samples) +
               " sample(s) of " + std::to_string(bits) + " bits";
    }
};

Page current_page(const Tiff& tiff) {
    Page page;
    page.offset = TIFFCurrentDirOffset(tiff.get());
    page.width = tiff.tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0);
    page.height = tiff.tag<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
    page.bits = tiff.tag<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1);
    page.format = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    if (page.format == SAMPLEFORMAT_VOID) page.format = SAMPLEFORMAT_UINT;
    page.samples = tiff.tag<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
    return page;
}

PixelType pixel_type(const std::string& path, const Page& page) {
    const auto unsupported = [&](const std::string& what) {
        return Error(
            Errc::Unsupported,
            "read_image: " + path + ": expected grey values of 8, 16 or 32 bits, float or " + "double, got " + what);
    };
    if (page.samples != 1) throw unsupported("colour (" + std::to_string(page.samples) + " samples per pixel)");
    if (page.format == SAMPLEFORMAT_UINT) {
        if (page.bits == 8) return PixelType::UInt8;
        if (page.bits == 16) return PixelType::UInt16;
        if (page.bits == 32) return PixelType::UInt32;
    } else if (page.format == SAMPLEFORMAT_INT) {
        if (page.bits == 8) return PixelType::Int8;
        if (page.bits == 16) return PixelType::Int16;
        if (page.bits == 32) return PixelType::Int32;
    } else if (page.format == SAMPLEFORMAT_IEEEFP) {
        if (page.bits == 32) return PixelType::Float;
        if (page.bits == 64) return PixelType::Double;
    }
    throw unsupported(std::to_string(page.bits) + " bits in sample format " + std::to_string(page.format));
}

/// All full-resolution pages, which must be of one kind.
std::vector<Page> list_pages(const std::string& path, const Tiff& tiff) {
    constexpr std::uint32_t kReduced = FILETYPE_REDUCEDIMAGE;
    std::vector<Page> pages;
    for (bool more = true; more;) {
        if ((tiff.tag<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0) & kReduced) == 0 || pages.empty()) {
            const Page page = current_page(tiff);
            if (!pages.empty() && !page.same_kind(pages.front()))
                throw Error(Errc::Unsupported, "read_image: " + path + ": expected pages of one kind, got page 0 of " +
                                                   pages.front().to_text() + " and page " +
                                                   std::to_string(pages.size()) + " of " + page.to_text());
            pages.push_back(page);
        }
        if (TIFFLastDirectory(tiff.get()) != 0) break;
        more = TIFFReadDirectory(tiff.get()) == 1;
        if (!more)
            throw tiff.error(Errc::InvalidInput, "read_image: " + path + ": damaged or truncated after page " +
                                                     std::to_string(pages.size() - 1));
    }
    return pages;
}

/// What a page of the stack is, and how far apart voxels are (0: the file does not say).
struct Stack {
    std::uint64_t slices = 0, channels = 1, frames = 1;
    std::string order = "CZT";  ///< fastest first
    Vec3 spacing{0, 0, 0};
    std::string unit;

    [[nodiscard]] std::uint64_t page(std::uint64_t z, std::uint64_t c, std::uint64_t t) const {
        std::uint64_t page = 0;
        std::uint64_t stride = 1;
        for (const char axis : order) {
            page += stride * (axis == 'Z' ? z : axis == 'C' ? c : t);
            stride *= axis == 'Z' ? slices : axis == 'C' ? channels : frames;
        }
        return page;
    }
};

double to_number(const std::string& text) {
    double value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    return status == std::errc() && std::isfinite(value) && value > 0 ? value : 0;
}

std::uint64_t to_count(const std::string& text) {
    const double value = to_number(text);
    return value >= 1 && value < 1e9 ? static_cast<std::uint64_t>(value) : 1;
}

/// The value of `key=` in ImageJ's description, one key a line.
std::string imagej_value(const std::string& description, const std::string& key) {
    for (std::size_t begin = 0; begin < description.size();) {
        const std::size_t end = std::min(description.find('\n', begin), description.size());
        if (description.compare(begin, key.size() + 1, key + "=") == 0)
            return description.substr(begin + key.size() + 1, end - begin - key.size() - 1);
        begin = end + 1;
    }
    return {};
}

/// The value of an attribute of the element <Pixels ...> in OME-XML.
std::string ome_value(const std::string& pixels, const std::string& key) {
    for (std::size_t at = pixels.find(key); at != std::string::npos; at = pixels.find(key, at + 1)) {
        const std::size_t equals = at + key.size();
        if (at == 0 || std::isspace(static_cast<unsigned char>(pixels[at - 1])) == 0) continue;
        if (equals + 1 >= pixels.size() || pixels[equals] != '=') continue;
        const char quote = pixels[equals + 1];
        const std::size_t end = pixels.find(quote, equals + 2);
        if ((quote == '"' || quote == '\'') && end != std::string::npos)
            return pixels.substr(equals + 2, end - equals - 2);
    }
    return {};
}

/// Expresses the lengths along j and k in the unit of i where both units are known.
void unify_units(Stack& stack, const std::array<std::string, 3>& units) {
    stack.unit = units[0];
    const double first = unit_in_metres(units[0]);
    for (int a = 1; a < 3; ++a) {
        const double own = unit_in_metres(units[a]);
        if (own > 0 && first > 0 && own != first) stack.spacing[a] *= own / first;
    }
}

Stack imagej_stack(const Tiff& tiff, const std::string& description, std::uint64_t pages) {
    Stack stack;
    stack.channels = to_count(imagej_value(description, "channels"));
    stack.frames = to_count(imagej_value(description, "frames"));
    const std::string slices = imagej_value(description, "slices");
    stack.slices = to_count(slices);
    if (slices.empty() && stack.channels * stack.frames == 1) stack.slices = pages;

    std::array<std::string, 3> units;
    units[0] = normal_unit(imagej_value(description, "unit"));
    units[1] = normal_unit(imagej_value(description, "yunit"));
    units[2] = normal_unit(imagej_value(description, "zunit"));
    const auto resolution_unit = tiff.tag<std::uint16_t>(TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
    if (units[0].empty() && resolution_unit == RESUNIT_INCH) units[0] = "inch";
    if (units[0].empty() && resolution_unit == RESUNIT_CENTIMETER) units[0] = "cm";
    const std::array<float, 2> resolution{tiff.tag(TIFFTAG_XRESOLUTION, 0.0F), tiff.tag(TIFFTAG_YRESOLUTION, 0.0F)};
    // One pixel per nothing is what writers leave when they know no spacing.
    const bool known = !units[0].empty() || resolution[0] != 1.0F || !imagej_value(description, "spacing").empty();
    if (!known) return stack;
    for (int a = 0; a < 2; ++a) {
        const float spacing = 1.0F / resolution[a];
        if (!std::isfinite(spacing) || !(spacing > 0)) continue;
        // libtiff hands out single precision; the shortest text that means this float is what was meant (0.35).
        std::array<char, 32> text{};
        const auto end = std::to_chars(text.data(), text.data() + text.size(), spacing).ptr;
        std::from_chars(text.data(), end, stack.spacing[a]);
    }
    stack.spacing[2] = to_number(imagej_value(description, "spacing"));
    // ImageJ leaves a depth of 1 out.
    if (stack.spacing[2] == 0 && stack.spacing[0] > 0) stack.spacing[2] = 1;
    unify_units(stack, units);
    return stack;
}

Stack ome_stack(const std::string& description, std::uint64_t pages) {
    Stack stack;
    stack.slices = pages;
    const std::size_t begin = description.find("<Pixels");
    if (begin == std::string::npos) return stack;
    const std::string pixels = description.substr(begin, description.find('>', begin) - begin);
    stack.slices = to_count(ome_value(pixels, "SizeZ"));
    stack.channels = to_count(ome_value(pixels, "SizeC"));
    stack.frames = to_count(ome_value(pixels, "SizeT"));
    const std::string order = ome_value(pixels, "DimensionOrder");
    if (order.size() == 5) stack.order = order.substr(2);
    std::string sorted = stack.order;
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "CTZ") stack.order = "CZT";
    std::array<std::string, 3> units;
    for (int a = 0; a < 3; ++a) {
        const std::string key = std::string("PhysicalSize") + "XYZ"[a];
        stack.spacing[a] = to_number(ome_value(pixels, key));
        const std::string unit = ome_value(pixels, key + "Unit");
        units[a] = unit.empty() ? "um" : normal_unit(unit);  // the OME schema's default
    }
    if (stack.spacing[0] > 0) unify_units(stack, units);
    return stack;
}

Stack describe(const Tiff& tiff, std::uint64_t pages) {
    const std::string description = tiff.text(TIFFTAG_IMAGEDESCRIPTION);
    Stack stack;
    stack.slices = pages;
    if (description.rfind("ImageJ=", 0) == 0)
        stack = imagej_stack(tiff, description, pages);
    else if (description.find("<OME") != std::string::npos)
        stack = ome_stack(description, pages);
    return stack;
}

/// The index along channels or frames that the caller chose, or the only one there is.
std::uint64_t choose(const std::string& path, const char* what, int wanted, std::uint64_t count) {
    if (wanted < 0 && count == 1) return 0;
    if (wanted >= 0 && std::uint64_t(wanted) < count) return std::uint64_t(wanted);
    const std::string range = "0 to " + std::to_string(count - 1) + " with --" + what;
    if (wanted < 0)
        throw Error(Errc::Unsupported, "read_image: " + path + ": expected one " + what + ", got " +
                                           std::to_string(count) + "; choose " + range);
    throw Error(Errc::InvalidOptions, "read_image: " + path + ": " + what + " " + std::to_string(wanted) +
                                          " does not exist; choose " + range);
}

bool read_strips(const Tiff& tiff, const Page& page, std::uint64_t row_bytes, char* out) {
    const std::uint64_t page_bytes = row_bytes * page.height;
    const std::uint64_t rows = tiff.tag<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, page.height);
    const std::uint64_t strip_bytes = std::min(rows, std::uint64_t(page.height)) * row_bytes;
    if (strip_bytes == 0) return false;
    for (std::uint64_t done = 0, strip = 0; done < page_bytes; ++strip) {
        const auto want = static_cast<tmsize_t>(std::min(strip_bytes, page_bytes - done));
        if (TIFFReadEncodedStrip(tiff.get(), static_cast<std::uint32_t>(strip), out + done, want) != want) return false;
        done += static_cast<std::uint64_t>(want);
    }
    return true;
}

bool read_tiles(const Tiff& tiff, const Page& page, std::uint64_t row_bytes, char* out) {
    const std::uint64_t bytes = page.bits / 8;
    const std::uint64_t width = tiff.tag<std::uint32_t>(TIFFTAG_TILEWIDTH, 0);
    const std::uint64_t height = tiff.tag<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
    const auto tile_bytes = static_cast<std::uint64_t>(std::max<tmsize_t>(0, TIFFTileSize(tiff.get())));
    // A tile may be larger than the page, but not absurdly so.
    if (width == 0 || height == 0 || width > page.width + 65536U || height > page.height + 65536U ||
        tile_bytes != width * height * bytes)
        return false;
    std::vector<char> tile(tile_bytes);
    for (std::uint64_t y = 0; y < page.height; y += height)
        for (std::uint64_t x = 0; x < page.width; x += width) {
            const std::uint32_t index =
                TIFFComputeTile(tiff.get(), static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 0, 0);
            if (TIFFReadEncodedTile(tiff.get(), index, tile.data(), static_cast<tmsize_t>(tile_bytes)) !=
                static_cast<tmsize_t>(tile_bytes))
                return false;
            const std::uint64_t columns = std::min(width, page.width - x);
            for (std::uint64_t row = 0; row < std::min(height, page.height - y); ++row)
                std::memcpy(out + (y + row) * row_bytes + x * bytes, tile.data() + row * width * bytes,
                            columns * bytes);
        }
    return true;
}

/// ImageJ writes stacks over 4 GB with a single directory, and the other slices' pixels right behind the first's.
bool is_contiguous_imagej_stack(const Tiff& tiff, std::uint64_t page_bytes, std::uint64_t pages,
                                std::uint64_t file_bytes) {
    if (tiff.tag<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) != COMPRESSION_NONE) return false;
    if (TIFFIsTiled(tiff.get()) != 0) return false;
    const std::uint64_t begin = TIFFGetStrileOffset(tiff.get(), 0);
    return begin <= file_bytes && page_bytes > 0 && pages <= (file_bytes - begin) / page_bytes;
}

}  // namespace

RawImage read_tiff(const std::string& path, const ReadImageOptions& options, bool header_only, const RunContext& run) {
    const std::uint64_t file_bytes = std::filesystem::file_size(path);
    constexpr std::uint64_t kLeastLimit = std::uint64_t(1) << 28;
    Tiff tiff(path, "r", static_cast<tmsize_t>(std::max(kLeastLimit, 4 * file_bytes)));
    if (tiff.get() == nullptr) throw tiff.error(Errc::InvalidInput, "read_image: " + path + ": not a usable TIFF file");
    const std::string description = tiff.text(TIFFTAG_IMAGEDESCRIPTION);

    RawImage image;
    const Page first = current_page(tiff);
    image.type = pixel_type(path, first);
    const std::uint64_t row_bytes = std::uint64_t(first.width) * pixel_bytes(image.type);
    const std::uint64_t page_bytes = row_bytes * first.height;

    std::vector<Page> pages;
    std::uint64_t contiguous = 0;  // where the pixels of such a stack begin
    const std::uint64_t claimed =
        description.rfind("ImageJ=", 0) == 0 ? to_count(imagej_value(description, "images")) : 1;
    if (claimed > 1 && TIFFLastDirectory(tiff.get()) != 0 &&
        is_contiguous_imagej_stack(tiff, page_bytes, claimed, file_bytes)) {
        contiguous = TIFFGetStrileOffset(tiff.get(), 0);
        pages.assign(claimed, first);
    } else {
        pages = list_pages(path, tiff);
        TIFFSetSubDirectory(tiff.get(), pages.front().offset);
    }

    Stack stack = describe(tiff, pages.size());
    if (stack.slices * stack.channels * stack.frames != pages.size()) {
        // The description is stale (a tool that kept it while it changed the pages): the pages are right.
        stack.slices = pages.size();
        stack.channels = stack.frames = 1;
    }
    const std::uint64_t channel = choose(path, "channel", options.channel, stack.channels);
    const std::uint64_t frame = choose(path, "frame", options.frame, stack.frames);
    require_3d(path, {first.width, first.height, stack.slices});
    ImageGeometry& geometry = image.geometry;
    geometry.size = {static_cast<std::int32_t>(first.width), static_cast<std::int32_t>(first.height),
                     static_cast<std::int32_t>(stack.slices)};
    geometry.unit = stack.unit;
    geometry.spacing_known = true;
    for (int a = 0; a < 3; ++a) {
        if (stack.spacing[a] > 0)
            geometry.spacing[a] = stack.spacing[a];
        else
            geometry.spacing_known = false;
    }
    if (header_only) return image;

    if (page_bytes > std::uint64_t(1) << 40)
        throw Error(Errc::InvalidInput, "read_image: " + path + ": the header claims pages of " + first.to_text());
    image.data = allocate_pixels(path, page_bytes / pixel_bytes(image.type) * stack.slices, image.type, file_bytes);
    std::ifstream raw;
    if (contiguous > 0) raw.open(path, std::ios::binary);
    for (std::uint64_t z = 0; z < stack.slices; ++z) {
        run.check();
        char* out = static_cast<char*>(image.data.get()) + z * page_bytes;
        const std::uint64_t number = stack.page(z, channel, frame);
        const auto failure = [&] {
            return tiff.error(Errc::InvalidInput,
                              "read_image: " + path + ": damaged or truncated at page " + std::to_string(number));
        };
        if (contiguous > 0) {
            raw.seekg(static_cast<std::streamoff>(contiguous + number * page_bytes));
            if (!raw.read(out, static_cast<std::streamsize>(page_bytes))) throw failure();
            if (TIFFIsByteSwapped(tiff.get()) != 0)
                swap_bytes(out, page_bytes / pixel_bytes(image.type), pixel_bytes(image.type));
            continue;
        }
        const Page& page = pages[number];
        if (TIFFSetSubDirectory(tiff.get(), page.offset) != 1 || !current_page(tiff).same_kind(page)) throw failure();
        const bool whole = TIFFIsTiled(tiff.get()) != 0 ? read_tiles(tiff, page, row_bytes, out)
                                                        : read_strips(tiff, page, row_bytes, out);
        if (!whole) throw failure();
    }
    return image;
}

void write_tiff(const std::string& path, const ImageGeometry& geometry, PixelType type, const void* values) {
    const auto width = static_cast<std::uint32_t>(geometry.size[0]);
    const auto height = static_cast<std::uint32_t>(geometry.size[1]);
    const std::uint64_t page_bytes = std::uint64_t(width) * height * pixel_bytes(type);
    constexpr std::uint64_t kClassicLimit = std::uint64_t(4000) << 20;
    const bool big = page_bytes * std::uint64_t(geometry.size[2]) > kClassicLimit;
    Tiff tiff(path, big ? "w8" : "w", 0);
    if (tiff.get() == nullptr) throw tiff.error(Errc::Io, "write_image: " + path + ": cannot write");

    std::array<char, 32> depth{};
    std::to_chars(depth.data(), depth.data() + depth.size() - 1, geometry.spacing[2]);
    const std::string slices = std::to_string(geometry.size[2]);
    std::string description =
        "ImageJ=1.53t\nimages=" + slices + "\nslices=" + slices + "\nhyperstack=true\nmode=grayscale\n";
    if (geometry.spacing_known) description += std::string("spacing=") + depth.data() + "\n";
    if (!geometry.unit.empty()) description += "unit=" + geometry.unit + "\n";
    const int format = with_pixel_type(type, [](auto pixel) {
        using T = decltype(pixel);
        return std::is_floating_point_v<T> ? SAMPLEFORMAT_IEEEFP
               : std::is_signed_v<T>       ? SAMPLEFORMAT_INT
                                           : SAMPLEFORMAT_UINT;
    });
    std::vector<char> page(page_bytes);  // libtiff wants it writable
    for (std::int32_t z = 0; z < geometry.size[2]; ++z) {
        TIFF* t = tiff.get();
        TIFFSetField(t, TIFFTAG_IMAGEWIDTH, width);
        TIFFSetField(t, TIFFTAG_IMAGELENGTH, height);
        TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, int(8 * pixel_bytes(type)));
        TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, format);
        TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        TIFFSetField(t, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
        TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, height);
        TIFFSetField(t, TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
        TIFFSetField(t, TIFFTAG_XRESOLUTION, 1.0 / geometry.spacing[0]);
        TIFFSetField(t, TIFFTAG_YRESOLUTION, 1.0 / geometry.spacing[1]);
        if (z == 0) TIFFSetField(t, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
        std::memcpy(page.data(), static_cast<const char*>(values) + std::uint64_t(z) * page_bytes, page_bytes);
        if (TIFFWriteEncodedStrip(t, 0, page.data(), static_cast<tmsize_t>(page_bytes)) < 0 ||
            TIFFWriteDirectory(t) != 1)
            throw tiff.error(Errc::Io, "write_image: " + path + ": cannot write");
    }
    tiff.close();
    if (!tiff.message().empty()) throw tiff.error(Errc::Io, "write_image: " + path + ": cannot write");
}

}  // namespace covol::detail
