#include "io/vdb_walk.h"

#include <blosc.h>
#include <openvdb/Metadata.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/DelayedLoadMetadata.h>

#include <array>
#include <bit>
#include <map>
#include <stdexcept>
#include <vector>

namespace covol::detail {
namespace {

namespace vdb_io = openvdb::io;

struct ValueBytes {
    std::int64_t whole, half;
};

const std::map<std::string, ValueBytes> kTypes{
    {"Tree_float_5_4_3", {4, 2}}, {"Tree_double_5_4_3", {8, 2}}, {"Tree_int32_5_4_3", {4, 4}},
    {"Tree_int64_5_4_3", {8, 8}}, {"Tree_vec3s_5_4_3", {12, 6}}, {"Tree_vec3d_5_4_3", {24, 6}},
};

/// One bit for each value of a node.
using Mask = std::vector<std::uint64_t>;

std::int64_t count_on(const Mask& mask) {
    std::int64_t count = 0;
    for (const std::uint64_t word : mask) count += std::popcount(word);
    return count;
}

template <typename T>
T read(std::istream& stream) {
    T value{};
    stream.read(reinterpret_cast<char*>(&value), sizeof(T));
    return value;
}

/// Reads the length of a text or value at the stream's position, and checks that the file is long enough for it.
std::uint32_t read_length(std::istream& stream, const std::string& what, std::int64_t file_bytes) {
    const auto length = read<std::uint32_t>(stream);
    if (length > file_bytes - std::int64_t(stream.tellg()))
        throw std::runtime_error("a " + what + " of " + std::to_string(length) + " bytes does not fit into the file");
    return length;
}

/// OpenVDB reads this byte into a bool, which must be 0 or 1: any other value is undefined behaviour.
void check_bool(std::uint8_t value) {
    if (value > 1) throw std::runtime_error("expected 0 or 1 for false or true, got " + std::to_string(value));
}

/// Checks the header of Blosc, four numbers of 32 bits: versions, flags and element size; unpacked bytes; block size;
/// packed bytes.
void check_blosc_header(const std::array<std::uint32_t, 4>& header, std::int64_t bytes, std::int64_t packed) {
    if (std::int64_t(header[1]) != bytes || std::int64_t(header[3]) != packed)
        throw std::runtime_error("a block's size differs from that in its header");
}

/// Checks OpenVDB's metadata for delayed loading, which consists of two arrays with one value for each leaf. Each array
/// is preceded by its packed size in bytes, or by 0 if it is not packed; the second array may be missing.
/// @param length  of the metadata in bytes; more than 0
void walk_delayed_load(std::istream& stream, std::int64_t length, std::int64_t file_bytes) {
    constexpr std::int64_t kMinLeaf = 64;  // minimum size of a leaf in bytes: the size of its mask
    constexpr std::uint32_t kMissing = 0xFFFFFFFF;
    using vdb_io::DelayedLoadMetadata;
    const auto begin = stream.tellg();
    const std::int64_t leaves = read<std::uint32_t>(stream);
    if (leaves > file_bytes / kMinLeaf)
        throw std::runtime_error("its metadata states " + std::to_string(leaves) +
                                 " leaves, which do not fit into the file");
    for (const std::size_t width :
         {sizeof(DelayedLoadMetadata::MaskType), sizeof(DelayedLoadMetadata::CompressedSizeType)}) {
        const auto packed = read<std::uint32_t>(stream);
        if (width > 1 && packed == kMissing) return;
        const std::int64_t bytes = leaves * std::int64_t(width), stored = packed > 0 ? packed : bytes;
        const auto at = stream.tellg();
        if (stored > length - (at - begin))
            throw std::runtime_error("expected at most " + std::to_string(length - (at - begin)) +
                                     " bytes of metadata about leaves, got " + std::to_string(stored));
        if (packed > 0) {
            if (stored < BLOSC_MIN_HEADER_LENGTH)
                throw std::runtime_error("a packed block is too short for its header");
            const auto header = read<std::array<std::uint32_t, 4>>(stream);
            // OpenVDB may pad a block that is smaller than kPadded bytes with zeros to this size before it packs the
            // block.
            constexpr std::int64_t kPadded = 128;
            check_blosc_header(header, bytes < kPadded && header[1] == kPadded ? kPadded : bytes, stored);
        }
        stream.seekg(at + std::streamoff(stored));
    }
}

class Walk {
public:
    Walk(std::istream& stream, const VdbTreeLayout& layout, ValueBytes value)
        : stream_(stream), layout_(layout), value_(value) {}

    void tree() {
        skip(sizeof(std::int32_t));  // number of buffers, which is not needed
        skip(value_.whole);          // value of the background
        const auto tiles = read<std::uint32_t>(), children = read<std::uint32_t>();
        for (std::uint32_t n = 0; n < tiles; ++n) {
            skip(3 * std::int64_t(sizeof(std::int32_t)) + value_.whole);
            check_bool(read<std::uint8_t>());
        }
        for (std::uint32_t n = 0; n < children; ++n) {
            skip(3 * sizeof(std::int32_t));
            internal_node(5);
        }
        for (const std::int64_t active : leaves_) {
            skip(kLeafValues / 8);  // the leaf's mask is stored a second time
            values(kLeafValues, active);
        }
    }

private:
    static constexpr int kLeafLog2 = 3;
    static constexpr std::int64_t kLeafValues = 512;

    template <typename T>
    T read() {
        return detail::read<T>(stream_);
    }
    void skip(std::int64_t bytes) {
        if (bytes < 0 || bytes > layout_.file_bytes - std::int64_t(stream_.tellg()))
            throw std::runtime_error("a block of " + std::to_string(bytes) + " bytes does not fit into the file");
        // For short distances, reading and ignoring bytes is faster than seeking, which discards the stream's buffer.
        constexpr std::int64_t kFar = 1 << 16;
        if (bytes < kFar)
            stream_.ignore(bytes);
        else
            stream_.seekg(bytes, std::ios::cur);
    }
    Mask mask(std::int64_t values) {
        Mask words(std::size_t(values / 64));
        stream_.read(reinterpret_cast<char*>(words.data()), values / 8);
        return words;
    }
    void internal_node(int log2) {
        const std::int64_t count = std::int64_t(1) << (3 * log2);
        const Mask children = mask(count);
        values(count, count_on(mask(count)));
        for (std::int64_t n = count_on(children); n > 0; --n)
            if (log2 - 1 == kLeafLog2)
                leaves_.push_back(count_on(mask(kLeafValues)));
            else
                internal_node(log2 - 1);
    }
    /// Skips the values of a node.
    /// @param count  number of all values
    /// @param active  number of active values
    void values(std::int64_t count, std::int64_t active) {
        const auto kind = read<std::int8_t>();
        // `kind` states which inactive values, and which mask, precede the other values: io/Compression.h of OpenVDB.
        if (kind == vdb_io::NO_MASK_AND_ONE_INACTIVE_VAL || kind == vdb_io::MASK_AND_ONE_INACTIVE_VAL)
            skip(value_.whole);
        if (kind == vdb_io::MASK_AND_TWO_INACTIVE_VALS) skip(2 * value_.whole);
        if (kind >= vdb_io::MASK_AND_NO_INACTIVE_VALS && kind <= vdb_io::MASK_AND_TWO_INACTIVE_VALS) skip(count / 8);
        const bool all =
            (layout_.compression & vdb_io::COMPRESS_ACTIVE_MASK) == 0 || kind == vdb_io::NO_MASK_AND_ALL_VALS;
        const std::int64_t stored = all ? count : active;
        if (layout_.is_half && stored < 1) return;
        data(stored * (layout_.is_half ? value_.half : value_.whole));
    }
    void data(std::int64_t bytes) {
        const bool blosc = (layout_.compression & vdb_io::COMPRESS_BLOSC) != 0;
        if (!blosc && (layout_.compression & vdb_io::COMPRESS_ZIP) == 0) return skip(bytes);
        const auto packed = read<std::int64_t>();
        if (packed <= 0) {  // the block is not packed; its size is then stored as a negative number
            if (packed != -bytes)
                throw std::runtime_error("expected a block of " + std::to_string(bytes) +
                                         " uncompressed bytes, got a stated length of " + std::to_string(packed));
            return skip(bytes);
        }
        if (!blosc) return skip(packed);
        const auto header = read<std::array<std::uint32_t, 4>>();
        check_blosc_header(header, bytes, packed);
        skip(packed - std::int64_t(sizeof(header)));
    }

    std::istream& stream_;
    const VdbTreeLayout& layout_;
    ValueBytes value_;
    std::vector<std::int64_t> leaves_;  ///< number of active values of each leaf, in the file's order
};

}  // namespace

void skip_vdb_text(std::istream& stream, const char* what, std::int64_t file_bytes) {
    stream.seekg(read_length(stream, what, file_bytes), std::ios::cur);
}

void skip_vdb_metadata(std::istream& stream, std::int64_t file_bytes) {
    const auto count = read<std::uint32_t>(stream);
    for (std::uint32_t n = 0; n < count; ++n) {
        skip_vdb_text(stream, "metadata name", file_bytes);
        std::string type(read_length(stream, "metadata type", file_bytes), '\0');
        stream.read(type.data(), std::streamsize(type.size()));
        const std::uint32_t length = read_length(stream, "metadata value", file_bytes);
        const auto begin = stream.tellg();
        if (type == vdb_io::DelayedLoadMetadata::staticTypeName()) {
            if (length > 0) walk_delayed_load(stream, length, file_bytes);
        } else if (type != "string" && openvdb::Metadata::isRegisteredType(type)) {
            const openvdb::Metadata::Ptr value = openvdb::Metadata::createMetadata(type);
            if (value->size() != length)
                throw std::runtime_error("expected " + std::to_string(value->size()) + " bytes for metadata of type " +
                                         type + ", got " + std::to_string(length));
            if (type == openvdb::BoolMetadata::staticTypeName()) check_bool(read<std::uint8_t>(stream));
        }
        stream.seekg(begin + std::streamoff(length));
    }
}

void walk_vdb_tree(std::istream& stream, const VdbTreeLayout& layout) {
    if (const auto type = kTypes.find(layout.type); type != kTypes.end()) Walk(stream, layout, type->second).tree();
}

}  // namespace covol::detail
