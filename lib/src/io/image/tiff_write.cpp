#include <array>
#include <charconv>
#include <cstring>
#include <vector>

#include "io/image/tiff.h"
#include "io/image/tiff_handle.h"

namespace covol::detail {
namespace {

/// The shortest text that means this number.
std::string shortest(double value) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace

void write_tiff(const std::string& path, const ImageGeometry& geometry, PixelType type, const void* values) {
    const auto width = static_cast<std::uint32_t>(geometry.size[0]);
    const auto height = static_cast<std::uint32_t>(geometry.size[1]);
    const std::uint64_t page_bytes = std::uint64_t(width) * height * pixel_bytes(type);
    constexpr std::uint64_t kClassicLimit = std::uint64_t(4000) << 20;
    const bool big = page_bytes * std::uint64_t(geometry.size[2]) > kClassicLimit;
    Tiff tiff(path, big ? "w8" : "w", 0);
    if (tiff.get() == nullptr) throw tiff.error(Errc::Io, "write_image: " + path + ": cannot write");

    const std::string slices = std::to_string(geometry.size[2]);
    std::string description =
        "ImageJ=1.53t\nimages=" + slices + "\nslices=" + slices + "\nhyperstack=true\nmode=grayscale\n";
    if (geometry.spacing_known) description += "spacing=" + shortest(geometry.spacing[2]) + "\n";
    // ImageJ tells the origin in voxels, as the voxel that lies at 0.
    for (std::size_t a = 0; a < 3; ++a)
        if (geometry.spacing_known && geometry.is_axis_aligned() && geometry.origin[a] != 0)
            description +=
                std::string(1, "xyz"[a]) + "origin=" + shortest(-geometry.origin[a] / geometry.spacing[a]) + "\n";
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
