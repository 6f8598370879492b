#include "covol/vdb_io.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>
#include <sstream>

#include "covol/error.h"
#include "covol/version.h"
#include "files/atomic.h"
#include "io/nanovdb.h"
#include "io/vdb_walk.h"
#include "limits/world_limits.h"

namespace covol {
namespace {

namespace fs = std::filesystem;
namespace vdb = openvdb;

std::string one_line(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

/// Calls a function that uses OpenVDB, and converts its exceptions to Error.
template <typename Call>
auto with_openvdb(Errc code, const std::string& what, Call&& call) {
    try {
        return call();
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(code, what + " (" + one_line(e.what()) + ")");
    }
}

std::map<std::string, std::string> to_text(const vdb::MetaMap& metadata) {
    std::map<std::string, std::string> result;
    for (auto entry = metadata.beginMeta(); entry != metadata.endMeta(); ++entry)
        result[entry->first] = entry->second->str();
    return result;
}

/// Reads single grids from a .vdb file. Unlike openvdb::io::File, it is safe on damaged files: the stream throws at the
/// end of the file, and lengths in the file are checked before OpenVDB allocates memory for them.
class Reader : public vdb::io::Archive {
public:
    explicit Reader(const std::string& path) : stream_(path, std::ios::binary) {
        stream_.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
        file_bytes_ = static_cast<std::int64_t>(fs::file_size(path));
        readHeader(stream_);
        tags_->setSeekable(true);
        vdb::io::setStreamMetadataPtr(stream_, tags_, /*transfer=*/false);
        setFormatVersion(stream_);
        setLibraryVersion(stream_);
        setDataCompression(stream_);
        look_ahead([&] { skip_metadata(); });
        vdb::MetaMap file_metadata;
        file_metadata.readMeta(stream_);
        if (!inputHasGridOffsets()) OPENVDB_THROW(vdb::IoError, "written to a stream, without grid offsets");
        const std::int32_t count = readGridCount(stream_);
        for (std::int32_t n = 0; n < count; ++n) {
            look_ahead([&] {
                for (const char* text : {"name", "type", "parent"}) skip_text(text);
            });
            Entry entry;
            entry.empty_grid = entry.descriptor.read(stream_);
            const std::int64_t end = entry.descriptor.getEndPos();
            if (end < stream_.tellg() || end > file_bytes_) OPENVDB_THROW(vdb::IoError, "truncated");
            stream_.seekg(end);
            entries_.push_back(std::move(entry));
        }
    }
    ~Reader() override {
        stream_.exceptions(std::ios::goodbit);
        // Removes the pointer to tags_ that the stream holds, before stream_ and tags_ are destroyed.
        vdb::io::clearStreamMetadataPtr(stream_);
    }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    [[nodiscard]] std::size_t size() const { return entries_.size(); }
    [[nodiscard]] std::string name(std::size_t n) const { return entries_[n].descriptor.gridName(); }
    /// The name of a grid, with an index if an earlier grid has the same name, as OpenVDB's programs print it:
    /// "surface[1]" is the second grid named "surface".
    [[nodiscard]] std::string unique_name(std::size_t n) const {
        std::size_t before = 0;
        for (std::size_t other = 0; other < n; ++other) before += name(other) == name(n) ? 1 : 0;
        return before == 0 ? name(n) : name(n) + "[" + std::to_string(before) + "]";
    }
    /// Whether `wanted` is the unique name of the grid, or this name followed by "[0]".
    [[nodiscard]] bool is_named(std::size_t n, const std::string& wanted) const {
        return unique_name(n) == wanted || unique_name(n) + "[0]" == wanted;
    }
    [[nodiscard]] std::string type(std::size_t n) const { return entries_[n].descriptor.gridType(); }
    [[nodiscard]] bool is_half(std::size_t n) const { return entries_[n].descriptor.saveFloatAsHalf(); }

    /// Reads the metadata and the transform of a grid, whose tree is left empty.
    vdb::GridBase::Ptr read_metadata(std::size_t n) {
        const Entry& entry = entries_[n];
        seek_to_grid(entry);
        readGridCompression(stream_);
        entry.empty_grid->readMeta(stream_);
        entry.empty_grid->readTransform(stream_);
        return entry.empty_grid;
    }

    /// @return OpenVDB's flags for the compression of the grid that was read last
    [[nodiscard]] std::uint32_t grid_compression() { return vdb::io::getDataCompression(stream_); }

    vdb::GridBase::Ptr read_whole(std::size_t n) {
        const Entry& entry = entries_[n];
        seek_to_grid(entry);
        vdb::GridBase::Ptr grid = entry.empty_grid->copyGridWithNewTree();
        if (!entry.descriptor.isInstance()) look_ahead([&] { walk_tree(entry); });
        try {
            readGrid(grid, entry.descriptor, stream_);
        } catch (...) {
            leak_grid(grid);
            throw;
        }
        if (entry.descriptor.isInstance()) {
            for (std::size_t parent = 0; parent < entries_.size(); ++parent)
                if (parent != n && !entries_[parent].descriptor.isInstance() &&
                    entries_[parent].descriptor.uniqueName() == entry.descriptor.instanceParentName()) {
                    grid->setTree(read_whole(parent)->baseTreePtr());
                    return grid;
                }
            OPENVDB_THROW(vdb::IoError, "the grid that '" + grid->getName() + "' shares its tree with is missing");
        }
        return grid;
    }

private:
    struct Entry {
        vdb::io::GridDescriptor descriptor;
        vdb::GridBase::Ptr empty_grid;
    };

    /// Keeps a partially read grid until the program ends: nodes of its tree refer to children that do not exist, so it
    /// must not be destroyed.
    static void leak_grid(const vdb::GridBase::Ptr& grid) {
        static std::mutex mutex;
        static auto& kept = *new std::vector<vdb::GridBase::Ptr>;
        const std::lock_guard lock(mutex);
        kept.push_back(grid);
    }

    void seek_to_grid(const Entry& entry) {
        const std::int64_t at = entry.descriptor.getGridPos();
        if (at < 0 || at > file_bytes_) OPENVDB_THROW(vdb::IoError, "truncated");
        stream_.seekg(at);
        look_ahead([&] {
            if (fileVersion() >= vdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
                stream_.seekg(sizeof(std::uint32_t), std::ios::cur);  // compression flags
            skip_metadata();
            skip_text("transform");
        });
    }

    /// Checks the sizes of all blocks of a tree. @pre the stream is at the beginning of the grid
    void walk_tree(const Entry& entry) {
        if (fileVersion() < vdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION) return;
        readGridCompression(stream_);
        const vdb::GridBase::Ptr head = entry.empty_grid->copyGridWithNewTree();
        head->readMeta(stream_);
        head->readTransform(stream_);
        detail::walk_vdb_tree(stream_, {entry.descriptor.gridType(), entry.descriptor.saveFloatAsHalf(),
                                        vdb::io::getDataCompression(stream_), file_bytes_});
    }

    template <typename Walk>
    void look_ahead(Walk&& walk) {
        const auto here = stream_.tellg();
        walk();
        stream_.seekg(here);
    }
    void skip_text(const char* what) { detail::skip_vdb_text(stream_, what, file_bytes_); }
    void skip_metadata() { detail::skip_vdb_metadata(stream_, file_bytes_); }

    vdb::io::StreamMetadata::Ptr tags_ = std::make_shared<vdb::io::StreamMetadata>();
    std::ifstream stream_;
    std::int64_t file_bytes_ = 0;
    std::vector<Entry> entries_;
};

void require_readable(const std::string& path) {
    std::error_code status;
    if (!fs::exists(path, status)) throw Error(Errc::Io, path + ": no such file");
    if (!fs::is_regular_file(path, status) || !std::ifstream(path).good())
        throw Error(Errc::Io, path + ": cannot be opened");
    vdb::initialize();
}

std::string unusable(const std::string& path) { return path + ": damaged, truncated, or not a .vdb file"; }

bool is_float(const std::string& type) { return type == FloatGrid::gridType(); }

/// The names and types of all grids, for messages: "u (Tree_float_5_4_3), Cd (Tree_vec3s_5_4_3)".
std::string list_grids(const Reader& reader) {
    std::string list;
    for (std::size_t n = 0; n < reader.size(); ++n)
        list += (n == 0 ? "" : ", ") + reader.unique_name(n) + " (" + reader.type(n) + ")";
    return list.empty() ? "no grid at all" : list;
}

void check_grids(const std::string& path, const std::vector<FloatGridPtr>& grids) {
    std::set<std::string> names;
    for (const FloatGridPtr& grid : grids) {
        if (!grid) throw Error(Errc::InvalidInput, path + ": expected a grid, got a null pointer");
        if (grid->getName().empty())
            throw Error(Errc::InvalidInput, path + ": expected a name for every grid, got none");
        if (!names.insert(grid->getName()).second)
            throw Error(Errc::InvalidInput, path + ": expected unique names, got '" + grid->getName() + "' twice");
    }
}

/// OpenVDB writes a random UUID into each file's header. Here it is replaced by a hash of the remaining contents, so
/// that identical runs write identical files.
void make_repeatable(const std::string& path) {
    // Position in bytes of the UUID, after the magic number, three version numbers and a flag.
    constexpr std::streamoff kUuid = 8 + 4 + 4 + 4 + 1;
    constexpr std::size_t kLength = 36;
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    std::string uuid(kLength, '\0');
    file.seekg(kUuid);
    file.read(uuid.data(), std::streamsize(kLength));
    const auto is_uuid = [&] {
        for (std::size_t n = 0; n < kLength; ++n) {
            const bool dash = n == 8 || n == 13 || n == 18 || n == 23;
            if (dash ? uuid[n] != '-' : std::isxdigit(static_cast<unsigned char>(uuid[n])) == 0) return false;
        }
        return true;
    };
    if (!file || !is_uuid()) OPENVDB_THROW(vdb::IoError, "expected a UUID in the header of the file just written");
    // Two hashes of 64 bits with a mixing step like that of MurmurHash. https://github.com/aappleby/smhasher
    std::array<std::uint64_t, 2> sums{0x9e3779b97f4a7c15, 0xc2b2ae3d27d4eb4f};
    std::vector<std::uint64_t> words(1U << 16);
    while (file) {
        std::fill(words.begin(), words.end(), 0);
        file.read(reinterpret_cast<char*>(words.data()), std::streamsize(words.size() * sizeof(words[0])));
        const auto count = (std::size_t(file.gcount()) + sizeof(words[0]) - 1) / sizeof(words[0]);
        for (std::size_t n = 0; n < count; ++n) {
            sums[0] = std::rotl((sums[0] ^ words[n]) * 0xff51afd7ed558ccd, 31);
            sums[1] = std::rotl((sums[1] + words[n]) * 0xc4ceb9fe1a85ec53, 29);
        }
    }
    sums[1] ^= sums[0] >> 32;
    std::array<char, kLength + 1> text{};
    // UUID version 8, whose bits are defined by the program. https://www.rfc-editor.org/rfc/rfc9562
    std::snprintf(text.data(), text.size(), "%08x-%04x-8%03x-%04x-%012llx", unsigned(sums[0] >> 32),
                  unsigned(sums[0] >> 16 & 0xFFFF), unsigned(sums[0] & 0xFFF),
                  unsigned(0x8000 | (sums[1] >> 48 & 0x3FFF)),
                  static_cast<unsigned long long>(sums[1] & 0xFFFFFFFFFFFF));
    file.clear();
    file.seekp(kUuid);
    file.write(text.data(), std::streamsize(kLength));
    file.close();
    if (!file) OPENVDB_THROW(vdb::IoError, "cannot be written");
}

std::uint32_t flags_of(VdbCompression compression) {
    switch (compression) {
        case VdbCompression::None: return vdb::io::COMPRESS_NONE;
        case VdbCompression::Zip: return vdb::io::COMPRESS_ZIP;
        case VdbCompression::Blosc: break;
    }
    return vdb::io::COMPRESS_BLOSC;
}

const char* name_of(std::uint32_t flags) {
    if ((flags & vdb::io::COMPRESS_BLOSC) != 0) return "blosc";
    return (flags & vdb::io::COMPRESS_ZIP) != 0 ? "zip" : "none";
}

VdbGridInfo describe(Reader& reader, std::size_t n) {
    vdb::GridBase::Ptr grid = reader.read_metadata(n);
    const char* const kCount = vdb::GridBase::META_FILE_VOXEL_COUNT;
    const char* const kMin = vdb::GridBase::META_FILE_BBOX_MIN;
    const char* const kMax = vdb::GridBase::META_FILE_BBOX_MAX;
    const auto has_statistics = [&] {
        return grid->getMetadata<vdb::Int64Metadata>(kCount) && grid->getMetadata<vdb::Vec3IMetadata>(kMin) &&
               grid->getMetadata<vdb::Vec3IMetadata>(kMax);
    };
    VdbGridInfo info;
    info.metadata = to_text(*grid);
    info.compression = name_of(reader.grid_compression());
    if (!has_statistics()) {
        grid = reader.read_whole(n);
        grid->addStatsMetadata();
    }
    info.name = reader.unique_name(n);
    info.type = reader.type(n) + (reader.is_half(n) ? "_HalfFloat" : "");
    info.grid_class = vdb::GridBase::gridClassToString(grid->getGridClass());
    info.voxel_size = grid->voxelSize()[0];
    info.uniform = grid->hasUniformVoxels();
    if (has_statistics()) {
        info.active_voxels = static_cast<std::uint64_t>(grid->metaValue<std::int64_t>(kCount));
        const auto lo = grid->metaValue<vdb::Vec3i>(kMin);
        const auto hi = grid->metaValue<vdb::Vec3i>(kMax);
        info.min = {lo[0], lo[1], lo[2]};
        info.max = {hi[0], hi[1], hi[2]};
    }
    return info;
}

/// @throws Error InvalidInput if floating-point numbers do not represent the positions of the grid's voxels accurately.
/// Grids whose transform is not linear are not checked.
void check_place(const std::string& path, const FloatGrid& grid) {
    const auto& transform = grid.transform();
    if (!transform.isLinear()) return;
    const vdb::Vec3d size = transform.voxelSize(), origin = transform.indexToWorld(vdb::Vec3d(0, 0, 0));
    const double finest = std::min({size[0], size[1], size[2]}), coarsest = std::max({size[0], size[1], size[2]});
    const double farthest = detail::farthest_origin(finest);
    if (coarsest <= detail::kLargestLength && detail::is_within({origin[0], origin[1], origin[2]}, farthest)) return;
    std::ostringstream text;
    text << path << ": grid '" << grid.getName() << "': expected voxels up to " << detail::kLargestLength
         << " in size and an origin within " << farthest << " of 0, got " << size << " and " << origin;
    throw Error(Errc::InvalidInput, text.str());
}

}  // namespace

void write_vdb(const std::string& path, const std::vector<FloatGridPtr>& grids, const WriteVdbOptions& options) {
    require_valid(options, "write_vdb");
    check_grids(path, grids);
    vdb::initialize();
    const auto add_provenance = [&](vdb::MetaMap& metadata) {
        for (const auto& [key, value] : options.metadata) metadata.insertMeta(key, vdb::StringMetadata(value));
        metadata.insertMeta(vdb::GridBase::META_GRID_CREATOR, vdb::StringMetadata("covol " COVOL_VERSION_STRING));
    };
    vdb::MetaMap file_metadata;
    add_provenance(file_metadata);
    // Copies use the trees of `grids`, but have metadata of their own, so that the grids of the caller are unchanged.
    vdb::GridPtrVec copies;
    for (const FloatGridPtr& grid : grids) {
        const FloatGridPtr copy = grid->copy();
        add_provenance(*copy);
        copy->setSaveFloatAsHalf(options.half);
        copies.push_back(copy);
    }
    detail::write_atomically(path, [&](const std::string& temporary) {
        with_openvdb(Errc::Io, path + ": cannot write", [&] {
            vdb::io::File file(temporary);
            file.setCompression(flags_of(options.compression) | vdb::io::COMPRESS_ACTIVE_MASK);
            file.setGridStatsMetadataEnabled(true);
            file.write(copies, file_metadata);
            file.close();
            make_repeatable(temporary);
        });
    });
}

void write_nvdb(const std::string& path, const std::vector<FloatGridPtr>& grids) {
    check_grids(path, grids);
    detail::write_atomically(path, [&](const std::string& temporary) {
        with_openvdb(Errc::Io, path + ": cannot write", [&] { detail::write_nanovdb(temporary, path, grids); });
    });
}

VdbGridName split_grid_name(const std::string& text) {
    const std::size_t colon = text.find(".vdb:");
    std::error_code status;
    if (colon == std::string::npos || fs::exists(text, status)) return {text, ""};
    return {text.substr(0, colon + 4), text.substr(colon + 5)};
}

FloatGridPtr read_vdb(const std::string& given, const std::string& wanted_name) {
    const VdbGridName file = split_grid_name(given);
    const std::string& path = file.path;
    const std::string& name = wanted_name.empty() ? file.grid : wanted_name;
    require_readable(path);
    return with_openvdb(Errc::InvalidInput, unusable(path), [&] {
        Reader reader(path);
        for (std::size_t n = 0; n < reader.size(); ++n) {
            const bool usable = is_float(reader.type(n));
            if (name.empty() ? !usable : !reader.is_named(n, name)) continue;
            if (!usable)
                throw Error(Errc::InvalidInput, path + ": expected float values in grid '" + name + "', got " +
                                                    reader.type(n) + "; the file has " + list_grids(reader));
            FloatGridPtr grid = vdb::gridPtrCast<FloatGrid>(reader.read_whole(n));
            if (!grid) throw Error(Errc::InvalidInput, unusable(path));
            check_place(path, *grid);
            return grid;
        }
        const std::string wanted = name.empty() ? "a float grid" : "a grid named '" + name + "'";
        throw Error(Errc::InvalidInput, path + ": expected " + wanted + ", got " + list_grids(reader));
    });
}

std::vector<VdbGridInfo> list_vdb(const std::string& given) {
    const VdbGridName file = split_grid_name(given);
    const std::string &path = file.path, &name = file.grid;
    require_readable(path);
    return with_openvdb(Errc::InvalidInput, unusable(path), [&] {
        Reader reader(path);
        std::vector<VdbGridInfo> list;
        for (std::size_t n = 0; n < reader.size(); ++n)
            if (name.empty() || reader.is_named(n, name)) list.push_back(describe(reader, n));
        if (list.empty() && !name.empty())
            throw Error(Errc::InvalidInput, path + ": expected a grid named '" + name + "', got " + list_grids(reader));
        return list;
    });
}

}  // namespace covol
