#include "io/vdb_walk.h"

#include <openvdb/io/Compression.h>

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

class Walk {
public:
    Walk(std::istream& stream, const VdbTreeLayout& layout, ValueBytes value)
        : stream_(stream), layout_(layout), value_(value) {}

    void tree() {
        skip(sizeof(std::int32_t));  // number of buffers
        skip(value_.whole);          // background
        const auto tiles = read<std::uint32_t>(), children = read<std::uint32_t>();
        skip(std::int64_t(tiles) * (3 * std::int64_t(sizeof(std::int32_t)) + value_.whole + 1));
        for (std::uint32_t n = 0; n < children; ++n) {
            skip(3 * sizeof(std::int32_t));
            internal_node(5);
        }
        for (const std::int64_t active : leaves_) {
            skip(kLeafValues / 8);  // the mask once more
            values(kLeafValues, active);
        }
    }

private:
    static constexpr int kLeafLog2 = 3;
    static constexpr std::int64_t kLeafValues = 512;

    template <typename T>
    T read() {
        T value{};
        stream_.read(reinterpret_cast<char*>(&value), sizeof(T));
        return value;
    }
    void skip(std::int64_t bytes) {
        if (bytes < 0 || bytes > layout_.file_bytes - std::int64_t(stream_.tellg()))
            throw std::runtime_error("a block of " + std::to_string(bytes) + " bytes does not fit into the file");
        // To seek drops what the stream has read ahead.
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
    /// @param count  of the node @param active  of them
    void values(std::int64_t count, std::int64_t active) {
        const auto kind = read<std::int8_t>();
        // io/Compression.h: what of inactive values follows, by kind
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
        if (packed <= 0) {  // as it is
            if (packed != -bytes)
                throw std::runtime_error("expected a block of " + std::to_string(bytes) + " bytes, got " +
                                         std::to_string(-packed));
            return skip(bytes);
        }
        if (!blosc) return skip(packed);
        // Blosc's own header: versions, flags and size of an element; bytes; bytes of a block; packed bytes
        const auto header = read<std::array<std::uint32_t, 4>>();
        if (std::int64_t(header[1]) != bytes || std::int64_t(header[3]) != packed)
            throw std::runtime_error("a block's header has other sizes than it");
        skip(packed - std::int64_t(sizeof(header)));
    }

    std::istream& stream_;
    const VdbTreeLayout& layout_;
    ValueBytes value_;
    std::vector<std::int64_t> leaves_;  ///< active values of each, in the file's order
};

}  // namespace

void walk_vdb_tree(std::istream& stream, const VdbTreeLayout& layout) {
    if (const auto type = kTypes.find(layout.type); type != kTypes.end()) Walk(stream, layout, type->second).tree();
}

}  // namespace covol::detail
