#include "io/pixels/raw_image.h"

#include <fcntl.h>
#include <openvdb/math/Half.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <vector>

#include "io/pixels/inflate.h"
#include "io/pixels/packed_chunks.h"

namespace covol::detail {
namespace {

// Maximum ratio of unpacked to packed size that is accepted. Deflate reaches 1032 and LZW about 2700; newer codecs of
// TIFF exceed these ratios on constant slices.
constexpr std::uint64_t kMaxCompression = 20000;
// Minimum number of bytes that are mapped. Mapping fewer bytes saves little, whereas reading them reports errors of the
// disk immediately.
constexpr std::uint64_t kMapFrom = std::uint64_t(256) << 20;

struct Unit {
    const char* name;
    double metres;
};
constexpr Unit kUnits[] = {{"nm", 1e-9}, {"um", 1e-6},     {"mm", 1e-3},        {"cm", 1e-2},
                           {"m", 1.0},   {"inch", 0.0254}, {"angstrom", 1e-10}, {"pm", 1e-12}};

struct Spelling {
    const char* text;
    const char* unit;
};
constexpr Spelling kSpellings[] = {
    {"\xC2\xB5m", "um"},   {"\xCE\xBCm", "um"},   {"\xB5m", "um"},          {"\\u00b5m", "um"},
    {"micron", "um"},      {"microns", "um"},     {"micrometer", "um"},     {"micrometre", "um"},
    {"micrometers", "um"}, {"micrometres", "um"}, {"nanometer", "nm"},      {"nanometre", "nm"},
    {"nanometers", "nm"},  {"millimeter", "mm"},  {"millimetre", "mm"},     {"millimeters", "mm"},
    {"centimeter", "cm"},  {"centimetre", "cm"},  {"meter", "m"},           {"metre", "m"},
    {"in", "inch"},        {"inches", "inch"},    {"\xC3\x85", "angstrom"}, {"pixel", ""},
    {"pixels", ""},        {"voxel", ""},         {"reference frame", ""}};

/// Reads the bytes of a PixelPlace sequentially.
class PixelStream {
public:
    explicit PixelStream(const PixelPlace& place) : packed_(place.packed), file_(place.path, std::ios::binary) {
        file_.seekg(static_cast<std::streamoff>(place.file_offset));
        if (packed_) inflater_ = std::make_unique<Inflater>(file_);
    }
    /// Skips `count` bytes.
    bool skip(std::uint64_t count) {
        if (!packed_) return bool(file_.seekg(static_cast<std::streamoff>(count), std::ios::cur));
        std::vector<char> dropped(std::min<std::uint64_t>(count, 1U << 16));
        while (count > 0) {
            const std::uint64_t piece = std::min<std::uint64_t>(count, dropped.size());
            if (!inflater_->read(dropped.data(), piece)) return false;
            count -= piece;
        }
        return true;
    }
    bool read(std::uint64_t count, char* out) {
        return packed_ ? inflater_->read(out, count) : bool(file_.read(out, static_cast<std::streamsize>(count)));
    }
    /// Returns false if the checksum after the last byte that was read is wrong; true if it is correct or missing.
    bool checksum_fits() { return !packed_ || inflater_->checksum_fits(); }

private:
    bool packed_;
    std::ifstream file_;
    std::unique_ptr<Inflater> inflater_;
};

class PlacedFile : public ImageFile {
public:
    PlacedFile(std::string path, const ImageInfo& info, PixelPlace place)
        : path_(std::move(path)), place_(std::move(place)) {
        info_ = info;
        const Index3& size = info_.geometry.size;
        components_ = std::uint64_t(info_.channels);
        row_bytes_ = std::uint64_t(size[0]) * components_ * place_.stored_bytes();
        slice_bytes_ = row_bytes_ * std::uint64_t(size[1]);
        frame_bytes_ = slice_bytes_ * std::uint64_t(size[2]) + place_.frame_gap;
        check_file_size();
        PixelRequest all;
        all.box = whole_box(size);
        if (is_in_chunks(all)) info_.chunk_size = packed_chunk_size(size);
    }

    [[nodiscard]] std::uint64_t bytes_to_hold(const PixelRequest& request) const override {
        return is_mapped(request) || is_in_chunks(request) ? 0 : ImageFile::bytes_to_hold(request);
    }

    Pixels read(const PixelRequest& request, const RunContext& run) override {
        if (is_mapped(request)) return map(request);
        if (!is_in_chunks(request)) return copy(request, run);
        PackedFrame frame;
        frame.type = info_.type;
        frame.size = info_.geometry.size;
        frame.components = components_;
        frame.channel = request.channel;
        frame.begin = frame_begin(request);
        frame.is_last = request.frame + 1 == std::uint64_t(info_.frames);
        return read_chunks(packed_chunks(path_, place_, frame, run), request.box, run);
    }

private:
    [[nodiscard]] Error damaged() const {
        return read_error(Errc::InvalidInput, path_,
                          "damaged or truncated" +
                              (place_.path == path_ ? std::string() : ", or its data file " + place_.path + " is"));
    }

    void check_file_size() const {
        std::error_code status;
        const std::uint64_t file_bytes = std::filesystem::file_size(place_.path, status);
        if (status) throw read_error(Errc::Io, path_, "its data file " + place_.path + " cannot be opened");
        const Index3& size = info_.geometry.size;
        // The product is computed in floating point, because integers might overflow if the header is damaged.
        const double wanted =
            double(size[0]) * size[1] * size[2] * double(components_) * info_.frames * double(place_.stored_bytes());
        const double there = place_.packed ? double(file_bytes) * kMaxCompression
                                           : double(file_bytes) - double(place_.file_offset) - double(place_.skip);
        if (wanted > there)
            throw read_error(Errc::InvalidInput, path_,
                             "the header claims " + size_text(size) + " voxels" +
                                 (info_.channels * info_.frames > 1 ? " of several channels or frames" : "") +
                                 ", which a file of " + std::to_string(file_bytes) +
                                 " bytes cannot hold; it is damaged or truncated");
    }

    [[nodiscard]] std::uint64_t frame_begin(const PixelRequest& request) const {
        return place_.skip + request.frame * frame_bytes_;
    }

    /// Whether the box is mapped into memory: the pixels must be uncompressed, aligned, and stored with the image's
    /// type and this machine's byte order without rescaling, and is_worth_mapping() must accept the size of its slices.
    [[nodiscard]] bool is_mapped(const PixelRequest& request) const {
        const std::uint64_t slices = std::uint64_t(request.box.size()[2]);
        const bool aligned = (place_.file_offset + frame_begin(request)) % place_.stored_bytes() == 0;
        return !place_.packed && place_.as_stored() && aligned && info_.type == place_.type &&
               is_worth_mapping(slices * slice_bytes_);
    }

    /// Whether the box is decompressed on demand, in chunks, because it is large.
    [[nodiscard]] bool is_in_chunks(const PixelRequest& request) const {
        return place_.packed && is_worth_mapping(ImageFile::bytes_to_hold(request));
    }

    [[nodiscard]] Pixels map(const PixelRequest& request) const {
        const VoxelBox& box = request.box;
        const std::uint64_t begin =
            place_.file_offset + frame_begin(request) + std::uint64_t(box.min[2]) * slice_bytes_;
        const auto slab = map_file(place_.path, begin, std::uint64_t(box.size()[2]) * slice_bytes_);
        const char* first = static_cast<const char*>(slab.get()) + std::uint64_t(box.min[1]) * row_bytes_ +
                            (std::uint64_t(box.min[0]) * components_ + request.channel) * place_.stored_bytes();
        const auto step = std::int64_t(components_);
        const Index3& size = info_.geometry.size;
        return {{slab, first}, {step, step * size[0], step * size[0] * size[1]}, true};
    }

    [[nodiscard]] Pixels copy(const PixelRequest& request, const RunContext& run) const {
        const VoxelBox& box = request.box;
        const Index3 n = box.size();
        const std::shared_ptr<void> data = allocate_pixels(path_, voxel_count(n), info_.type, 0);
        auto* out = static_cast<char*>(data.get());
        const std::uint64_t out_row = std::uint64_t(n[0]) * pixel_bytes(info_.type);
        const std::uint64_t rows_bytes = std::uint64_t(n[1]) * row_bytes_;
        const std::uint64_t before = std::uint64_t(box.min[1]) * row_bytes_;
        std::vector<char> rows(rows_bytes);
        PixelStream stream(place_);
        if (!stream.skip(frame_begin(request) + std::uint64_t(box.min[2]) * slice_bytes_)) throw damaged();
        for (std::int32_t k = 0; k < n[2]; ++k) {
            run.check();
            const bool last = k + 1 == n[2];
            if (!stream.skip(before) || !stream.read(rows_bytes, rows.data())) throw damaged();
            if (!last && !stream.skip(slice_bytes_ - before - rows_bytes)) throw damaged();
            if (place_.swap) swap_bytes(rows.data(), rows_bytes / place_.stored_bytes(), place_.stored_bytes());
            const std::uint64_t first =
                (std::uint64_t(box.min[0]) * components_ + request.channel) * place_.stored_bytes();
            for (std::int32_t j = 0; j < n[1]; ++j, out += out_row)
                convert_pixels(place_, rows.data() + std::uint64_t(j) * row_bytes_ + first, components_,
                               std::uint64_t(n[0]), info_.type, out);
        }
        const bool to_the_end =
            box == whole_box(info_.geometry.size) && request.frame + 1 == std::uint64_t(info_.frames);
        if (to_the_end && !stream.checksum_fits()) throw damaged();
        return {data, dense_strides(n), false};
    }

    std::string path_;
    PixelPlace place_;
    std::uint64_t components_ = 1, row_bytes_ = 0, slice_bytes_ = 0, frame_bytes_ = 0;
};

}  // namespace

std::shared_ptr<const ChunkSource> ImageFile::chunk_source(const PixelRequest& /*request*/) const { return nullptr; }

std::uint64_t ImageFile::bytes_to_hold(const PixelRequest& request) const {
    return voxel_count(request.box.size()) * pixel_bytes(info_.type);
}

std::unique_ptr<ImageFile> open_placed(const std::string& path, const ImageInfo& info, const PixelPlace& place) {
    return std::make_unique<PlacedFile>(path, info, place);
}

void convert_pixels(const PixelPlace& place, const void* stored, std::uint64_t step, std::uint64_t count,
                    PixelType type, void* out) {
    if (place.half) {
        const auto* source = static_cast<const std::uint16_t*>(stored);
        auto* target = static_cast<float*>(out);
        for (std::uint64_t n = 0; n < count; ++n) {
            openvdb::math::internal::half value;
            value.setBits(source[n * step]);
            target[n] = float(value);
        }
        return;
    }
    const bool scaled = place.slope != 1 || place.intercept != 0;
    with_pixel_type(place.type, [&](auto from) {
        with_pixel_type(type, [&](auto to) {
            using To = decltype(to);
            const auto* source = static_cast<const decltype(from)*>(stored);
            auto* target = static_cast<To*>(out);
            if constexpr (std::is_same_v<decltype(from), To>) {
                if (!scaled)
                    for (std::uint64_t n = 0; n < count; ++n) target[n] = source[n * step];
            }
            if constexpr (std::is_floating_point_v<To>) {
                if (scaled || !std::is_same_v<decltype(from), To>)
                    for (std::uint64_t n = 0; n < count; ++n)
                        target[n] = static_cast<To>(place.slope * double(source[n * step]) + place.intercept);
            }
        });
    });
}

bool is_worth_mapping(std::uint64_t bytes) { return bytes >= kMapFrom; }

std::shared_ptr<const void> map_file(const std::string& path, std::uint64_t offset, std::uint64_t bytes) {
    const auto page = std::uint64_t(::sysconf(_SC_PAGESIZE));
    const std::uint64_t before = offset % page;
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    void* begin =
        file < 0 ? MAP_FAILED
                 : ::mmap(nullptr, bytes + before, PROT_READ, MAP_PRIVATE, file, static_cast<off_t>(offset - before));
    if (file >= 0) ::close(file);
    if (begin == MAP_FAILED) throw read_error(Errc::Io, path, "cannot be mapped into memory");
    // The system need not read ahead, because the data around a row is usually not needed.
    ::madvise(begin, bytes + before, MADV_RANDOM);
    const auto unmap = [begin, length = bytes + before](const void*) { ::munmap(begin, length); };
    return {static_cast<const char*>(begin) + before, unmap};
}

void prefetch_pages(const void* begin, std::uint64_t bytes) {
    const auto page = std::uintptr_t(::sysconf(_SC_PAGESIZE));
    const std::uintptr_t first = reinterpret_cast<std::uintptr_t>(begin) / page * page;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the beginning of a page
    ::madvise(reinterpret_cast<void*>(first), reinterpret_cast<std::uintptr_t>(begin) + bytes - first, MADV_WILLNEED);
}

void release_pages(const void* begin, std::uint64_t bytes) {
    const auto page = std::uintptr_t(::sysconf(_SC_PAGESIZE));
    const std::uintptr_t first = (reinterpret_cast<std::uintptr_t>(begin) + page - 1) / page * page;
    const std::uintptr_t last = (reinterpret_cast<std::uintptr_t>(begin) + bytes) / page * page;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the beginning of a page
    if (first < last) ::madvise(reinterpret_cast<void*>(first), last - first, MADV_DONTNEED);
}

bool read_bytes(const PixelPlace& place, std::uint64_t count, void* out) {
    PixelStream stream(place);
    return stream.skip(place.skip) && stream.read(count, static_cast<char*>(out));
}

void swap_bytes(void* data, std::uint64_t count, std::uint64_t width) {
    auto* bytes = static_cast<char*>(data);
    for (std::uint64_t n = 0; n < count; ++n) std::reverse(bytes + n * width, bytes + (n + 1) * width);
}

std::string size_text(const Index3& size) {
    return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]);
}

std::uint64_t voxel_count(const Index3& size) {
    return std::uint64_t(size[0]) * std::uint64_t(size[1]) * std::uint64_t(size[2]);
}

VoxelBox whole_box(const Index3& size) { return {{0, 0, 0}, {size[0] - 1, size[1] - 1, size[2] - 1}}; }

std::array<std::int64_t, 3> dense_strides(const Index3& size) {
    return {1, size[0], std::int64_t(size[0]) * std::int64_t(size[1])};
}

Error read_error(Errc code, const std::string& path, const std::string& what, const std::string& option) {
    return {code, path + ": " + what, option};
}

Error not_finite(const std::string& path, const Index3& voxel) {
    return read_error(Errc::InvalidInput, path,
                      "expected finite values, got NaN or infinity at voxel (" + std::to_string(voxel[0]) + ", " +
                          std::to_string(voxel[1]) + ", " + std::to_string(voxel[2]) + ")");
}

Index3 require_3d(const std::string& path, const std::uint64_t (&size)[3]) {
    const std::string text =
        std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]);
    if (std::min({size[0], size[1], size[2]}) < 2)
        throw read_error(Errc::InvalidInput, path, "expected a 3D image, got " + text);
    constexpr std::uint64_t kMaxVoxels = std::uint64_t(1) << 52;
    if (std::max({size[0], size[1], size[2]}) > std::uint64_t(std::numeric_limits<std::int32_t>::max()) / 2 ||
        size[0] * size[1] > kMaxVoxels / size[2])
        throw read_error(
            Errc::InvalidInput, path,
            "expected at most 2^30 - 1 voxels along each axis and 2^52 in total, but the header claims " + text);
    return {static_cast<std::int32_t>(size[0]), static_cast<std::int32_t>(size[1]), static_cast<std::int32_t>(size[2])};
}

std::shared_ptr<void> allocate_pixels(const std::string& path, std::uint64_t pixels, PixelType type,
                                      std::uint64_t file_bytes) {
    const std::uint64_t bytes = pixels * pixel_bytes(type);
    const bool overflow = pixels > std::numeric_limits<std::uint64_t>::max() / 8;
    if (overflow || (file_bytes > 0 && bytes / kMaxCompression > file_bytes))
        throw read_error(Errc::InvalidInput, path,
                         "the header claims " + std::to_string(pixels) + " voxels, which a file of " +
                             std::to_string(file_bytes) + " bytes cannot hold; it is damaged or truncated");
    const std::uint64_t memory = std::uint64_t(::sysconf(_SC_PHYS_PAGES)) * std::uint64_t(::sysconf(_SC_PAGESIZE));
    const auto refuse = [&](const std::string& why) {
        return read_error(Errc::Unsupported, path,
                          "the image needs " + std::to_string(bytes >> 20) + " MiB, " + why +
                              "; choose a part with `roi`, or downsample it",
                          "roi");
    };
    if (bytes > memory) throw refuse("but this machine has " + std::to_string(memory >> 20) + " MiB");
    // malloc does not write to large blocks, so a block occupies physical memory only where pixels are written to it.
    void* data = std::malloc(std::max<std::uint64_t>(bytes, 1));
    if (data == nullptr) throw refuse("which could not be allocated");
    return {data, std::free};
}

std::string normal_unit(const std::string& text) {
    std::string unit;
    for (const char c : text)
        if (c != '"' && c != '\r' && c != '\n' && c != '\0')
            unit += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    unit.erase(0, unit.find_first_not_of(" \t"));
    unit.erase(unit.find_last_not_of(" \t") + 1);
    for (const Spelling& s : kSpellings)
        if (unit == s.text) return s.unit;
    return unit;
}

double unit_in_metres(const std::string& normal_unit) {
    for (const Unit& u : kUnits)
        if (normal_unit == u.name) return u.metres;
    return 0;
}

}  // namespace covol::detail
