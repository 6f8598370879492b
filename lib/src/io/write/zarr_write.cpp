// OME-Zarr 0.4 (https://ngff.openmicroscopy.org/0.4/): a Zarr 2 array for each level of a pyramid.
#include <blosc.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "covol/error.h"
#include "io/pixels/raw_image.h"
#include "io/write/image_writers.h"
#include "io/write/pixel_blocks.h"
#include "io/write/zarr_levels.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::int32_t kChunk = 128;
constexpr const char* kCodec = "zstd";
constexpr int kCodecLevel = 5;

[[noreturn]] void fail(const std::string& path) { throw Error(Errc::Io, path + ": cannot write"); }

void write_bytes(const std::string& path, const std::string& bytes) {
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), std::streamsize(bytes.size()));
    file.close();
    if (!file) fail(path);
}

void write_json(const std::string& path, const Json& json) {
    write_bytes(path, json.dump(4, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::string dtype_of(PixelType type) {
    return with_pixel_type(type, [](auto pixel) {
        using T = decltype(pixel);
        const char* kind = std::is_floating_point_v<T> ? "f" : std::is_signed_v<T> ? "i" : "u";
        return std::string(sizeof(T) == 1 ? "|" : "<") + kind + std::to_string(sizeof(T));
    });
}

/// The name of a unit in OME-Zarr, which uses the names of UDUNITS; empty if there is no such name.
std::string unit_name(const std::string& unit) {
    static constexpr std::array<std::array<const char*, 2>, 8> kNames{{{"pm", "picometer"},
                                                                       {"angstrom", "angstrom"},
                                                                       {"nm", "nanometer"},
                                                                       {"um", "micrometer"},
                                                                       {"mm", "millimeter"},
                                                                       {"cm", "centimeter"},
                                                                       {"m", "meter"},
                                                                       {"inch", "inch"}}};
    for (const auto& [own, name] : kNames)
        if (normal_unit(unit) == own) return name;
    return {};
}

/// A list of three numbers along i, j, k, in the order z, y, x.
template <typename Numbers>
Json reversed(const Numbers& n) {
    return Json::array({n[2], n[1], n[0]});
}

class PyramidWriter {
public:
    PyramidWriter(std::string folder, const PixelSource& source, const RunContext& run)
        : folder_(std::move(folder)),
          source_(source),
          run_(run),
          caller_(std::this_thread::get_id()),
          width_(pixel_bytes(source.type())) {
        for (int a = 0; a < 3; ++a) chunk_[a] = std::min(kChunk, source.geometry().size[a]);
        levels_ = pyramid_levels(source.geometry(), chunk_);
    }

    void write(const std::string& name) {
        write_json(folder_ + "/.zgroup", {{"zarr_format", 2}});
        write_json(folder_ + "/.zattrs", attributes(name));
        for (std::size_t n = 0; n < levels_.size(); ++n) {
            if (std::error_code status; !fs::create_directory(level_folder(n), status)) fail(level_folder(n));
            write_json(level_folder(n) + "/.zarray", array(levels_[n]));
        }
        const std::size_t top = levels_.size() - 1;
        std::vector<Index3> places;
        for (int k = 0; k < chunks(top)[2]; ++k)
            for (int j = 0; j < chunks(top)[1]; ++j)
                for (int i = 0; i < chunks(top)[0]; ++i) places.push_back({i, j, k});
        tbb::parallel_for(std::size_t(0), places.size(),
                          [&](std::size_t n) { static_cast<void>(make(top, places[n])); });
        run_.report("write", 1);
    }

private:
    /// The voxels of a chunk that lie in the image; if all have the same value, `uniform` is this value.
    struct Voxels {
        std::optional<double> uniform;
        std::string values;  ///< empty if uniform
    };

    [[nodiscard]] std::string level_folder(std::size_t level) const { return folder_ + "/" + std::to_string(level); }
    [[nodiscard]] Index3 chunks(std::size_t level) const {
        Index3 count{};
        for (int a = 0; a < 3; ++a) count[a] = (levels_[level].size[a] - 1) / chunk_[a] + 1;
        return count;
    }
    [[nodiscard]] VoxelBox box_of(std::size_t level, const Index3& place) const {
        VoxelBox box;
        for (int a = 0; a < 3; ++a) {
            box.min[a] = place[a] * chunk_[a];
            box.max[a] = std::min(levels_[level].size[a] - box.min[a], chunk_[a]) + box.min[a] - 1;
        }
        return box;
    }

    Json attributes(const std::string& name) const {
        const ImageGeometry& g = source_.geometry();
        Json axes = Json::array(), datasets = Json::array();
        for (const char* axis : {"z", "y", "x"}) {
            axes.push_back({{"name", axis}, {"type", "space"}});
            if (const std::string unit = unit_name(g.unit); !unit.empty()) axes.back()["unit"] = unit;
        }
        for (std::size_t n = 0; n < levels_.size(); ++n) {
            Vec3 scale{}, translation{};
            for (int a = 0; a < 3; ++a) {
                scale[a] = g.spacing[a] * levels_[n].scale[a];
                // The centre of the first coarse voxel lies in the middle of the fine voxels that it covers, not at the
                // centre of the first fine voxel.
                translation[a] = g.origin[a] + (scale[a] - g.spacing[a]) / 2;
            }
            datasets.push_back({{"path", std::to_string(n)},
                                {"coordinateTransformations",
                                 {{{"type", "scale"}, {"scale", reversed(scale)}},
                                  {{"type", "translation"}, {"translation", reversed(translation)}}}}});
        }
        Json json{{"multiscales",
                   {{{"version", "0.4"},
                     {"name", name},
                     {"axes", axes},
                     {"datasets", datasets},
                     {"type", source_.is_labels() ? "mode" : "mean"}}}}};
        if (!source_.is_labels()) return json;
        Json colors = Json::array(), properties = Json::array();
        for (const NamedLabel& label : source_.label_names()) {
            colors.push_back(
                {{"label-value", label.value}, {"rgba", {label.color[0], label.color[1], label.color[2], 255}}});
            properties.push_back({{"label-value", label.value}, {"name", label.name}});
        }
        json["image-label"] = {{"version", "0.4"}};
        if (!colors.empty()) json["image-label"].update({{"colors", colors}, {"properties", properties}});
        return json;
    }

    Json array(const PyramidLevel& level) const {
        return {{"zarr_format", 2},
                {"shape", reversed(level.size)},
                {"chunks", reversed(chunk_)},
                {"dtype", dtype_of(source_.type())},
                {"compressor",
                 {{"id", "blosc"},
                  {"cname", kCodec},
                  {"clevel", kCodecLevel},
                  {"shuffle", BLOSC_SHUFFLE},
                  {"blocksize", 0}}},
                {"fill_value", 0},
                {"order", "C"},
                {"filters", nullptr},
                {"dimension_separator", "/"}};
    }

    /// Writes a chunk and all chunks of finer levels within it; chunks of zeros are omitted, because the fill value of
    /// the arrays is 0.
    Voxels make(std::size_t level, const Index3& place) {
        const VoxelBox box = box_of(level, place);
        const VoxelBox fine = finest_box(levels_[level], box, source_.geometry().size);
        if (const std::optional<double> value = source_.uniform(fine)) {
            source_.wrote(fine, nullptr, *value);
            count(fine);
            if (*value != 0) write_uniform(level, place, *value);
            return {value, {}};
        }
        Voxels made;
        made.values.resize(voxel_count(box.size()) * width_);
        if (level == 0) {
            source_.fill(box, made.values.data());
            source_.wrote(box, made.values.data(), 0);
            count(fine);
        } else {
            gather(level, place, box, made.values);
        }
        // If all bytes are zero, all values are zero.
        if (made.values.find_first_not_of('\0') == std::string::npos) return {0.0, {}};
        std::string stored = made.values;
        stored.resize(voxel_count(chunk_) * width_);
        pad_rows(box.size(), chunk_, width_, stored.data());
        write_bytes(chunk_path(level, place), packed(stored));
        return made;
    }

    /// The positions of the chunks of the next finer level that a chunk of this level covers.
    [[nodiscard]] std::vector<Index3> below(std::size_t level, const Index3& place) const {
        const Index3 factor = levels_[level].factor, count = chunks(level - 1);
        std::vector<Index3> places;
        for (int k = 0; k < factor[2]; ++k)
            for (int j = 0; j < factor[1]; ++j)
                for (int i = 0; i < factor[0]; ++i) {
                    const Index3 at{place[0] * factor[0] + i, place[1] * factor[1] + j, place[2] * factor[2] + k};
                    if (at[0] < count[0] && at[1] < count[1] && at[2] < count[2]) places.push_back(at);
                }
        return places;
    }

    void gather(std::size_t level, const Index3& place, const VoxelBox& box, std::string& values) {
        const Index3 factor = levels_[level].factor;
        const std::vector<Index3> places = below(level, place);
        tbb::parallel_for(std::size_t(0), places.size(), [&](std::size_t n) {
            Voxels part = make(level - 1, places[n]);
            if (part.uniform == 0.0) return;
            const VoxelBox fine = box_of(level - 1, places[n]);
            if (part.uniform) {
                part.values.resize(voxel_count(fine.size()) * width_);
                fill_value(source_.type(), *part.uniform, voxel_count(fine.size()), part.values.data());
            }
            // Chunks have the same size in all levels, so a chunk covers one or two finer chunks along each axis.
            Index3 first{};
            for (int a = 0; a < 3; ++a) first[a] = fine.min[a] / factor[a] - box.min[a];
            coarsen(source_.type(), source_.is_labels(), factor, part.values.data(), fine.size(), values.data(), first,
                    box.size());
        });
    }

    void write_uniform(std::size_t level, const Index3& place, double value) {
        write_bytes(chunk_path(level, place), uniform_chunk(value));
        if (level == 0) return;
        const std::vector<Index3> places = below(level, place);
        tbb::parallel_for(std::size_t(0), places.size(),
                          [&](std::size_t n) { write_uniform(level - 1, places[n], value); });
    }

    const std::string& uniform_chunk(double value) {
        const std::lock_guard guard(lock_);
        const auto [at, is_new] = uniform_.try_emplace(value);
        if (is_new) {
            std::string values(voxel_count(chunk_) * width_, '\0');
            fill_value(source_.type(), value, voxel_count(chunk_), values.data());
            at->second = packed(values);
        }
        return at->second;
    }

    [[nodiscard]] std::string packed(const std::string& values) const {
        std::string out(values.size() + BLOSC_MAX_OVERHEAD, '\0');
        const int size = blosc_compress_ctx(kCodecLevel, BLOSC_SHUFFLE, width_, values.size(), values.data(),
                                            out.data(), out.size(), kCodec, 0, 1);
        if (size <= 0) throw Error(Errc::Unsupported, "this libblosc does not support zstd");
        out.resize(std::size_t(size));
        return out;
    }

    [[nodiscard]] std::string chunk_path(std::size_t level, const Index3& place) const {
        const std::string folder =
            level_folder(level) + "/" + std::to_string(place[2]) + "/" + std::to_string(place[1]);
        std::error_code status;
        fs::create_directories(folder, status);
        if (status) fail(folder);
        return folder + "/" + std::to_string(place[0]);
    }

    void count(const VoxelBox& fine) {
        run_.check();
        const std::uint64_t done = done_ += voxel_count(fine.size());
        if (std::this_thread::get_id() == caller_)
            run_.report("write", double(done) / double(voxel_count(source_.geometry().size)));
    }

    const std::string folder_;
    const PixelSource& source_;
    const RunContext& run_;
    const std::thread::id caller_;
    const std::uint64_t width_;
    Index3 chunk_{};
    std::vector<PyramidLevel> levels_;
    std::atomic<std::uint64_t> done_ = 0;
    std::mutex lock_;
    std::map<double, std::string> uniform_;  // packed chunks in which all voxels have the same value, by value
};

}  // namespace

void write_ome_zarr(const std::string& folder, const std::string& name, const PixelSource& source,
                    const RunContext& run) {
    PyramidWriter(folder, source, run).write(name);
}

}  // namespace covol::detail
