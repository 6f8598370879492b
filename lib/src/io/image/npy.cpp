// NumPy's .npy. https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#include <array>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/text.h"
#include "io/image/image_formats.h"

namespace covol::detail {
namespace {

/// The entries of the dictionary in the header, as texts.
struct NpyHeader {
    std::string descr, order, shape;
    std::uint64_t end = 0;  ///< position in bytes of the first value of the array
};

/// The value of a key in the header's dictionary, without quotes and without a closing parenthesis; empty if there
/// is none.
std::string value_of(const std::string& dictionary, const std::string& key) {
    std::size_t at = dictionary.find("'" + key + "'");
    if (at != std::string::npos) at = dictionary.find(':', at);
    if (at == std::string::npos) return {};
    at = dictionary.find_first_not_of(" '\"", at + 1);
    if (at == std::string::npos) return {};
    const std::size_t last = dictionary.find_first_of(dictionary[at] == '(' ? ")" : ",'\"}", at);
    return last == std::string::npos ? "" : dictionary.substr(at, last - at);
}

NpyHeader read_header(const std::string& path) {
    const auto damaged = [&](const std::string& what) {
        return read_error(Errc::InvalidInput, path, "damaged, truncated, or not a .npy file (" + what + ")");
    };
    PixelPlace begin;
    begin.path = path;
    constexpr std::uint64_t kVersion1 = 10, kVersion2 = 12, kMaxText = 1U << 16;
    const std::uint64_t file_bytes = std::filesystem::file_size(path);
    std::array<unsigned char, kVersion2> first{};
    if (file_bytes < kVersion2 || !read_bytes(begin, kVersion2, first.data()) ||
        std::memcmp(first.data(), "\x93NUMPY", 6) != 0)
        throw damaged("expected NumPy's signature in the first bytes");
    const bool is_first = first[6] == 1;
    std::uint64_t length = first[8] | unsigned(first[9]) << 8;
    if (!is_first) length |= std::uint64_t(first[10]) << 16 | std::uint64_t(first[11]) << 24;
    NpyHeader header;
    begin.skip = is_first ? kVersion1 : kVersion2;
    header.end = begin.skip + length;
    std::string text(length <= kMaxText ? length : 0, '\0');
    if (length > kMaxText || header.end > file_bytes || !read_bytes(begin, length, text.data()))
        throw damaged("its header claims " + std::to_string(length) + " bytes");
    header.descr = value_of(text, "descr");
    header.order = value_of(text, "fortran_order");
    header.shape = value_of(text, "shape");
    if (header.descr.size() < 2 || header.shape.empty() || (header.order != "True" && header.order != "False"))
        throw damaged("expected descr, fortran_order and shape in its header");
    return header;
}

void set_type(const std::string& path, const std::string& descr, PixelPlace& place) {
    static constexpr struct {
        const char* name;
        PixelType type;
    } kTypes[] = {{"b1", PixelType::UInt8},  {"u1", PixelType::UInt8}, {"i1", PixelType::Int8},
                  {"u2", PixelType::UInt16}, {"i2", PixelType::Int16}, {"u4", PixelType::UInt32},
                  {"i4", PixelType::Int32},  {"f4", PixelType::Float}, {"f8", PixelType::Double},
                  {"f2", PixelType::Float}};
    for (const auto& known : kTypes)
        if (descr.substr(1) == known.name) {
            place.type = known.type;
            place.half = descr.substr(1) == "f2";
            place.swap = descr[0] == '>' && place.stored_bytes() > 1;
            return;
        }
    throw read_error(Errc::Unsupported, path,
                     "expected bool, integers of 8, 16 or 32 bits, or floats, got values of the type " + quote(descr) +
                         "; save array.astype(\"float32\")");
}

/// Parses a shape such as "(58, 512, 512", without the closing parenthesis, which value_of() removes; the sizes are in
/// the order of the text.
std::array<std::uint64_t, 3> shape_of(const std::string& path, const std::string& shape) {
    std::vector<std::string_view> words;
    std::vector<std::uint64_t> sizes;
    split(std::string_view(shape).substr(1), ',', words);
    for (const std::string_view word : words) {
        if (trim(word).empty()) continue;
        const auto size = to_number<std::uint64_t>(trim(word));
        if (!size) throw read_error(Errc::InvalidInput, path, "expected sizes in its shape, got " + quote(shape + ")"));
        sizes.push_back(*size);
    }
    if (sizes.size() != 3)
        throw read_error(Errc::Unsupported, path,
                         "expected an array of three axes z, y, x, got the shape " + quote(shape + ")") +
                             (sizes.size() > 3 ? "; save one channel of one frame" : ""));
    return {sizes[0], sizes[1], sizes[2]};
}

/// An array in Fortran order. It is read as an array in C order whose axes are in reverse order, which is stored in the
/// same way.
class FortranFile : public ImageFile {
public:
    FortranFile(const std::string& path, const ImageInfo& info, const PixelPlace& place) : path_(path) {
        info_ = info;
        ImageInfo turned = info;
        std::swap(turned.geometry.size[0], turned.geometry.size[2]);
        file_ = open_placed(path, turned, place);
    }
    Pixels read(const PixelRequest& request, const RunContext& run) override {
        PixelRequest turned = request;
        std::swap(turned.box.min[0], turned.box.min[2]);
        std::swap(turned.box.max[0], turned.box.max[2]);
        Pixels pixels = file_->read(turned, run);
        if (pixels.chunks)
            throw read_error(
                Errc::Unsupported, path_,
                "expected C order for an array of this size, got Fortran order; save numpy.ascontiguousarray(array)");
        std::swap(pixels.stride[0], pixels.stride[2]);
        return pixels;
    }

private:
    std::string path_;
    std::unique_ptr<ImageFile> file_;
};

}  // namespace

std::unique_ptr<ImageFile> open_npy(const std::string& path) {
    const NpyHeader header = read_header(path);
    const std::array<std::uint64_t, 3> shape = shape_of(path, header.shape);
    PixelPlace place;
    place.path = path;
    place.skip = header.end;
    set_type(path, header.descr, place);
    ImageInfo info;
    info.format = "NumPy array";
    info.type = place.type;
    info.geometry.size = require_3d(path, {shape[2], shape[1], shape[0]});
    info.spacing_known = {false, false, false};
    info.fields = {{"descr", header.descr}, {"fortran_order", header.order}, {"shape", header.shape + ")"}};
    info.axis_order = header.order == "True" ? "ZYX" : "XYZ";
    if (header.order == "True") return std::make_unique<FortranFile>(path, info, place);
    return open_placed(path, info, place);
}

}  // namespace covol::detail
