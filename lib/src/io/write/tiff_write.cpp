#include <array>
#include <cstring>
#include <vector>

#include "io/image/tiff_handle.h"
#include "io/pixels/raw_image.h"
#include "io/write/image_writers.h"
#include "io/write/ome_xml.h"
#include "io/write/pixel_blocks.h"
#include "io/write/shortest.h"

namespace covol::detail {
namespace {

/// The resolution (pixels per unit) that is stored for a spacing, rounded to single precision as libtiff does.
double resolution(double spacing) { return double(float(1.0 / spacing)); }

/// @param range  the values that ImageJ displays as black and as white; without a range, 255 is white, so masks with
/// the values 0 and 1 appear black
std::string imagej_description(const ImageGeometry& geometry, const std::optional<std::array<double, 2>>& range) {
    const std::string slices = std::to_string(geometry.size[2]);
    std::string description =
        "ImageJ=1.53t\nimages=" + slices + "\nslices=" + slices + "\nhyperstack=true\nmode=grayscale\n";
    if (geometry.spacing_known) description += "spacing=" + shortest(geometry.spacing[2]) + "\n";
    // ImageJ's origin is the position of the point 0 of the world, in voxels. For x and y, the spacing that ImageJ will
    // read is rounded, so the rounded value is used here.
    for (std::size_t a = 0; a < 3; ++a) {
        const double per_length = a < 2 ? resolution(geometry.spacing[a]) : 1 / geometry.spacing[a];
        if (geometry.spacing_known && geometry.is_axis_aligned() && geometry.origin[a] != 0)
            description += std::string(1, "xyz"[a]) + "origin=" + shortest(-geometry.origin[a] * per_length) + "\n";
    }
    if (!geometry.unit.empty()) description += "unit=" + geometry.unit + "\n";
    if (range) description += "min=" + shortest((*range)[0]) + "\nmax=" + shortest((*range)[1]) + "\n";
    return description;
}

/// The strips or tiles of all pages, in the file's order.
struct PageParts {
    Index3 size;
    Index3 part;  ///< size of a strip or a tile in voxels
    bool tiled;

    [[nodiscard]] std::uint64_t across() const { return std::uint64_t((size[0] - 1) / part[0] + 1); }
    [[nodiscard]] std::uint64_t per_page() const { return across() * std::uint64_t((size[1] - 1) / part[1] + 1); }
    [[nodiscard]] BlockPlace place(std::uint64_t n) const {
        const auto k = std::int32_t(n / per_page());
        const std::uint64_t in_page = n % per_page();
        const Index3 min{std::int32_t(in_page % across()) * part[0], std::int32_t(in_page / across()) * part[1], k};
        const VoxelBox box{
            min,
            {std::min(size[0] - min[0], part[0]) + min[0] - 1, std::min(size[1] - min[1], part[1]) + min[1] - 1, k}};
        return {box, tiled ? part : box.size()};
    }
};

PageParts parts_of(const Index3& size, std::uint64_t pixel, bool big) {
    // ImageJ opens neither tiles nor BigTIFF. Classic TIFFs have strips so that ImageJ can open them; BigTIFFs may have
    // tiles.
    constexpr std::int32_t kTile = 256;
    constexpr std::uint64_t kStrip = 1U << 18;
    if (big) return {size, {kTile, kTile, 1}, true};
    const std::uint64_t row = std::uint64_t(size[0]) * pixel;
    return {
        size, {size[0], std::int32_t(std::clamp<std::uint64_t>(kStrip / row, 1, std::uint64_t(size[1]))), 1}, false};
}

}  // namespace

void write_tiff(const std::string& path, const PixelSource& source, bool ome, const RunContext& run,
                std::uint64_t classic_limit) {
    const ImageGeometry& geometry = source.geometry();
    const PixelType type = source.type();
    const bool big = voxel_count(geometry.size) * pixel_bytes(type) > classic_limit;
    Tiff tiff(path, big ? "w8" : "w", 0);
    const auto failure = [&] { return tiff.error(Errc::Io, path + ": cannot write"); };
    if (tiff.get() == nullptr) throw failure();
    const std::string description = ome ? make_ome_xml(geometry, type) : imagej_description(geometry, source.range());
    const int format = with_pixel_type(type, [](auto pixel) {
        using T = decltype(pixel);
        return std::is_floating_point_v<T> ? SAMPLEFORMAT_IEEEFP
               : std::is_signed_v<T>       ? SAMPLEFORMAT_INT
                                           : SAMPLEFORMAT_UINT;
    });
    const PageParts parts = parts_of(geometry.size, pixel_bytes(type), big);
    const auto begin_page = [&](bool first) {
        TIFF* t = tiff.get();
        TIFFSetField(t, TIFFTAG_IMAGEWIDTH, std::uint32_t(geometry.size[0]));
        TIFFSetField(t, TIFFTAG_IMAGELENGTH, std::uint32_t(geometry.size[1]));
        TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, int(8 * pixel_bytes(type)));
        TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, format);
        TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        TIFFSetField(t, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
        if (parts.tiled) {
            TIFFSetField(t, TIFFTAG_TILEWIDTH, std::uint32_t(parts.part[0]));
            TIFFSetField(t, TIFFTAG_TILELENGTH, std::uint32_t(parts.part[1]));
        } else {
            TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, std::uint32_t(parts.part[1]));
        }
        TIFFSetField(t, TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
        TIFFSetField(t, TIFFTAG_XRESOLUTION, resolution(geometry.spacing[0]));
        TIFFSetField(t, TIFFTAG_YRESOLUTION, resolution(geometry.spacing[1]));
        if (first) TIFFSetField(t, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    };
    const std::uint64_t per_page = parts.per_page();
    const auto take = [&](std::uint64_t n, const PackedBlock& block) {
        const std::uint64_t in_page = n % per_page;
        if (in_page == 0) begin_page(n == 0);
        auto* bytes = const_cast<char*>(block.bytes.data());
        const auto count = static_cast<tmsize_t>(block.bytes.size());
        const tmsize_t written = parts.tiled ? TIFFWriteRawTile(tiff.get(), std::uint32_t(in_page), bytes, count)
                                             : TIFFWriteRawStrip(tiff.get(), std::uint32_t(in_page), bytes, count);
        if (written != count || (in_page + 1 == per_page && TIFFWriteDirectory(tiff.get()) != 1)) throw failure();
    };
    BlockPacker(source, BlockPacking::Zlib)
        .pack_all(
            per_page * std::uint64_t(geometry.size[2]), [&](std::uint64_t n) { return parts.place(n); }, take, run);
    tiff.close();
    if (!tiff.message().empty()) throw failure();
}

}  // namespace covol::detail
