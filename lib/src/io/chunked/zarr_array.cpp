#include "io/chunked/zarr_array.h"

#include <openvdb/math/Half.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/text.h"
#include "io/pixels/chunks.h"

namespace covol::detail {
namespace {

constexpr std::size_t kMaxDimensions = 16;
constexpr std::uint64_t kMaxIndexed = std::uint64_t(1)
                                      << 22;  ///< maximum number of chunks in a shard, whose index then needs 64 MiB

/// Reads the metadata of one array.
class ArrayReader {
public:
    ArrayReader(ZarrArray& array, const Json& json) : array_(array), json_(json) {}

    void read_2();
    void read_3();

private:
    [[nodiscard]] Error wrong(const std::string& what) const {
        return read_error(Errc::InvalidInput, array_.metadata, what);
    }
    [[nodiscard]] Error unsupported(const std::string& what) const {
        return read_error(Errc::Unsupported, array_.metadata, what);
    }
    [[nodiscard]] std::vector<std::uint64_t> sizes(const Json& value, const std::string& what) const;
    [[nodiscard]] char separator(const Json& value, char usual) const;
    [[nodiscard]] std::string codec_name(const Json& codec) const;
    void set_type(char kind, char width, const std::string& name);
    void set_strides(const std::vector<std::size_t>& slowest_first);
    void set_fill(const Json& value);
    [[nodiscard]] double bits_as_number(const std::string& text) const;
    void check_chunk() const;
    void read_keys();
    void read_codecs(const Json& codecs);
    [[nodiscard]] std::vector<std::size_t> transposed(const Json& codec) const;
    void set_byte_order(const Json& codec, bool& big) const;
    void read_shards(const Json& sharding);

    ZarrArray& array_;
    const Json& json_;
};

std::vector<std::uint64_t> ArrayReader::sizes(const Json& value, const std::string& what) const {
    std::vector<std::uint64_t> list;
    if (!value.is_array() || value.empty() || value.size() > kMaxDimensions)
        throw wrong("expected a list of 1 to " + std::to_string(kMaxDimensions) + " numbers as its " + what);
    for (const Json& n : value) {
        if (!n.is_number_unsigned() || n.get<std::uint64_t>() > std::uint64_t(std::numeric_limits<std::int32_t>::max()))
            throw wrong("expected whole numbers as its " + what + ", from 0 to 2147483647");
        list.push_back(n.get<std::uint64_t>());
    }
    return list;
}

char ArrayReader::separator(const Json& value, char usual) const {
    if (value.is_null()) return usual;
    const std::string text = text_of(value);
    if (text != "." && text != "/") throw wrong("expected the separator of its chunks' names to be . or /");
    return text[0];
}

void ArrayReader::set_type(char kind, char width, const std::string& name) {
    switch (kind) {
        case 'b':
        case 'u':
            if (width == '1') return void(array_.type = PixelType::UInt8);
            if (width == '2') return void(array_.type = PixelType::UInt16);
            if (width == '4') return void(array_.type = PixelType::UInt32);
            break;
        case 'i':
            if (width == '1') return void(array_.type = PixelType::Int8);
            if (width == '2') return void(array_.type = PixelType::Int16);
            if (width == '4') return void(array_.type = PixelType::Int32);
            break;
        case 'f':
            if (width == '2') array_.stored_as = StoredAs::Half;
            if (width == '2' || width == '4') return void(array_.type = PixelType::Float);
            if (width == '8') return void(array_.type = PixelType::Double);
            break;
        default: break;
    }
    throw unsupported("expected integers of 8, 16 or 32 bits or floats, got elements of type " + quote(name));
}

void ArrayReader::set_strides(const std::vector<std::size_t>& slowest_first) {
    array_.strides.assign(array_.shape.size(), 1);
    std::uint64_t stride = 1;
    for (std::size_t n = slowest_first.size(); n-- > 0; stride *= array_.chunk[slowest_first[n]])
        array_.strides[slowest_first[n]] = stride;
}

/// Converts the bits of a floating-point number, which Zarr 3 allows as a hexadecimal text ("0x..."), to its value.
double ArrayReader::bits_as_number(const std::string& text) const {
    std::uint64_t bits = 0;
    const std::string digits = text.substr(2);
    const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), bits, 16);
    if (status != std::errc() || end != digits.data() + digits.size() || digits.size() != 2 * array_.stored_bytes())
        throw wrong("expected the bits of an element as its fill_value, got " + quote(text));
    if (array_.stored_as == StoredAs::Half) {
        openvdb::math::internal::half value;
        value.setBits(static_cast<unsigned short>(bits));
        return float(value);
    }
    return array_.type == PixelType::Float ? double(std::bit_cast<float>(static_cast<std::uint32_t>(bits)))
                                           : std::bit_cast<double>(bits);
}

void ArrayReader::set_fill(const Json& value) {
    const std::string text = text_of(value);
    const bool is_float = array_.type == PixelType::Float || array_.type == PixelType::Double;
    if (value.is_null())
        array_.fill = 0;
    else if (value.is_boolean())
        array_.fill = value.get<bool>() ? 1 : 0;
    else if (value.is_number())
        array_.fill = value.get<double>();
    else if (is_float && text == "NaN")
        array_.fill = std::numeric_limits<double>::quiet_NaN();
    else if (is_float && (text == "Infinity" || text == "-Infinity"))
        array_.fill = std::numeric_limits<double>::infinity();
    else if (is_float && text.starts_with("0x"))
        array_.fill = bits_as_number(text);
    else
        throw wrong("expected a number as its fill_value, got " + quote(value.is_string() ? text : value.type_name()));
    const bool fits = with_pixel_type(array_.type, [&](auto pixel) {
        using Limits = std::numeric_limits<decltype(pixel)>;
        return array_.fill >= double(Limits::lowest()) && array_.fill <= double(Limits::max());
    });
    if (std::isfinite(array_.fill) && !fits)
        throw wrong("its fill_value " + std::to_string(array_.fill) + " is not a valid " + to_string(array_.type));
}

/// Rejects chunks without elements, and chunks of more than kMaxChunkBytes, because a chunk is unpacked into memory as
/// a whole, including all of its channels and frames.
void ArrayReader::check_chunk() const {
    std::uint64_t bytes = array_.stored_bytes();
    for (const std::uint64_t n : array_.chunk) {
        if (n == 0)
            throw wrong("expected chunks with at least one element along each axis, got a chunk with a side of 0");
        if (bytes > kMaxChunkBytes / n)
            throw unsupported("expected chunks of 1 GiB at most, got larger ones; write it with smaller chunks");
        bytes *= n;
    }
}

// ---- Zarr 2 -------------------------------------------------------------------------------------------------------

void ArrayReader::read_2() {
    if (const Json& format = member(json_, "zarr_format"); format != 2)
        throw wrong("expected zarr_format 2, got " + quote(format.dump()));
    array_.shape = sizes(member(json_, "shape"), "shape");
    array_.chunk = sizes(member(json_, "chunks"), "chunks");
    if (array_.chunk.size() != array_.shape.size())
        throw wrong("its chunks and its shape differ in their number of dimensions");
    const Json& dtype = member(json_, "dtype");
    const std::string type = text_of(dtype);
    if (dtype.is_array()) throw unsupported("expected one number in each element, got records");
    constexpr bool kLittle = std::endian::native == std::endian::little;
    if (type.size() != 3 || std::string("<>|").find(type[0]) == std::string::npos || (type[0] == '|' && type[2] != '1'))
        throw unsupported("expected integers of 8, 16 or 32 bits or floats, got elements of type " + quote(type));
    set_type(type[1], type[2], type);
    array_.swap = type[2] != '1' && (type[0] == '<') != kLittle;
    const Json& filters = member(json_, "filters");
    if (!filters.is_null() && !(filters.is_array() && filters.empty())) {
        std::string names;
        for (const Json& filter : filters) names += (names.empty() ? "" : ", ") + quote(text_of(member(filter, "id")));
        throw unsupported("expected no filters, got " + names);
    }
    const Json& compressor = member(json_, "compressor");
    if (!compressor.is_null()) array_.codecs.push_back(zarr_codec(array_.metadata, text_of(member(compressor, "id"))));
    const std::string order = text_of(member(json_, "order"));
    if (order != "C" && order != "F") throw wrong("expected order C or F, got " + quote(order));
    std::vector<std::size_t> slowest_first(array_.shape.size());
    std::iota(slowest_first.begin(), slowest_first.end(), 0);
    if (order == "F") std::reverse(slowest_first.begin(), slowest_first.end());
    check_chunk();
    set_strides(slowest_first);
    set_fill(member(json_, "fill_value"));
    array_.separator = separator(member(json_, "dimension_separator"), '.');
}

// ---- Zarr 3 -------------------------------------------------------------------------------------------------------

/// The name of a codec, a chunk grid or a chunk key encoding: each is an object with a name, or a string.
std::string ArrayReader::codec_name(const Json& codec) const {
    return codec.is_string() ? text_of(codec) : text_of(member(codec, "name"));
}

void ArrayReader::read_3() {
    if (const Json& format = member(json_, "zarr_format"); format != 3)
        throw wrong("expected zarr_format 3, got " + quote(format.dump()));
    array_.shape = sizes(member(json_, "shape"), "shape");
    const Json& grid = member(json_, "chunk_grid");
    if (codec_name(grid) != "regular")
        throw unsupported("expected a regular grid of chunks, got " + quote(codec_name(grid)));
    array_.chunk = sizes(member(member(grid, "configuration"), "chunk_shape"), "chunk_shape");
    if (array_.chunk.size() != array_.shape.size())
        throw wrong("its chunk_shape and its shape differ in their number of dimensions");
    const std::string type = codec_name(member(json_, "data_type"));
    const std::size_t digits = type.find_first_of("0123456789");
    const std::string kind = type.substr(0, digits), width = digits == std::string::npos ? "" : type.substr(digits);
    const char bytes = width == "8" ? '1' : width == "16" ? '2' : width == "32" ? '4' : width == "64" ? '8' : '0';
    set_type(kind == "uint"    ? 'u'
             : kind == "int"   ? 'i'
             : kind == "float" ? 'f'
             : type == "bool"  ? 'b'
                               : '?',
             type == "bool" ? '1' : bytes, type);
    if (const Json& others = member(json_, "storage_transformers"); others.is_array() && !others.empty())
        throw unsupported("expected no storage transformers, got " + quote(codec_name(others.front())));
    set_fill(member(json_, "fill_value"));
    read_keys();
    read_codecs(member(json_, "codecs"));
    const Json& names = member(json_, "dimension_names");
    if (names.is_array() && names.size() == array_.shape.size())
        for (const Json& name : names) array_.dimension_names.push_back(text_of(name));
}

void ArrayReader::read_keys() {
    const Json& encoding = member(json_, "chunk_key_encoding");
    const std::string name = codec_name(encoding);
    if (name != "default" && name != "v2")
        throw unsupported("expected the chunk_key_encoding default or v2, got " + quote(name));
    array_.separator = separator(member(member(encoding, "configuration"), "separator"), name == "v2" ? '.' : '/');
    if (name == "default") array_.key_begin = std::string("c") + array_.separator;
}

/// The dimensions of a chunk in the order in which the codec "transpose" stores them, slowest first. @throws Error
/// InvalidInput if its `order` is not a permutation of the dimensions.
std::vector<std::size_t> ArrayReader::transposed(const Json& codec) const {
    const Json& order = member(member(codec, "configuration"), "order");
    const std::size_t count = array_.shape.size();
    std::vector<std::size_t> dimensions;
    std::vector<bool> seen(count, false);
    if (order.is_array())
        for (const Json& d : order) {
            const std::uint64_t number = d.is_number_unsigned() ? d.get<std::uint64_t>() : count;
            if (number >= count || seen[number]) throw wrong("expected a permutation as its transpose's order");
            seen[number] = true;
            dimensions.push_back(number);
        }
    if (dimensions.size() != count) throw wrong("expected a permutation as its transpose's order");
    return dimensions;
}

void ArrayReader::set_byte_order(const Json& codec, bool& big) const {
    const Json& endian = member(member(codec, "configuration"), "endian");
    const std::string text = text_of(endian);
    if (!endian.is_null() && text != "little" && text != "big")
        throw wrong("expected the byte order little or big, got " + quote(text));
    big = text == "big";
}

void ArrayReader::read_codecs(const Json& codecs) {
    if (!codecs.is_array() || codecs.empty() || codecs.size() > kMaxDimensions)
        throw wrong("expected a list of 1 to " + std::to_string(kMaxDimensions) + " codecs");
    std::vector<std::size_t> slowest_first(array_.shape.size());
    std::iota(slowest_first.begin(), slowest_first.end(), 0);
    bool has_bytes = false, is_transposed = false;
    for (const Json& codec : codecs) {
        const std::string name = codec_name(codec);
        if (has_bytes) {
            array_.codecs.push_back(zarr_codec(array_.metadata, name));
        } else if (name == "bytes") {
            has_bytes = true;
            bool big = false;
            set_byte_order(codec, big);
            array_.swap = array_.stored_bytes() > 1 && big == (std::endian::native == std::endian::little);
        } else if (name == "transpose" && !is_transposed) {
            is_transposed = true;
            slowest_first = transposed(codec);
        } else if (name == "sharding_indexed" && array_.shards.counts.empty() && !is_transposed) {
            // The chunks within a shard have a list of codecs of their own, which contains the codec bytes;
            // read_shards() calls read_codecs() for this list.
            read_shards(member(codec, "configuration"));
            has_bytes = true;
        } else {
            throw unsupported(
                "expected codecs that begin with bytes, with sharding_indexed, or with one transpose and then bytes, "
                "got " +
                quote(name));
        }
        if (name == "sharding_indexed" && &codec != &codecs.back())
            throw unsupported("expected shards that are not compressed themselves, got " +
                              quote(codec_name(codecs.back())));
    }
    if (!has_bytes) throw wrong("expected the codec bytes or sharding_indexed among its codecs");
    // read_shards() has already called this function for the codecs within shards, which set the strides.
    if (!array_.strides.empty()) return;
    check_chunk();
    set_strides(slowest_first);
}

void ArrayReader::read_shards(const Json& sharding) {
    const std::vector<std::uint64_t> outer = array_.chunk;
    array_.chunk = sizes(member(sharding, "chunk_shape"), "sharding's chunk_shape");
    if (array_.chunk.size() != outer.size())
        throw wrong("its chunks and its shards differ in their number of dimensions");
    std::vector<std::uint64_t> counts;
    std::uint64_t total = 1;
    for (std::size_t d = 0; d < outer.size(); ++d) {
        if (array_.chunk[d] == 0 || outer[d] == 0 || outer[d] % array_.chunk[d] != 0)
            throw wrong("expected shards that are made of whole chunks");
        counts.push_back(outer[d] / array_.chunk[d]);
        if (counts.back() > kMaxIndexed / total)
            throw unsupported("expected at most " + std::to_string(kMaxIndexed) + " chunks in a shard, got more");
        total *= counts.back();
    }
    const std::string place = text_of(member(sharding, "index_location"));
    if (!place.empty() && place != "start" && place != "end")
        throw wrong("expected the shards' index at their start or end, got " + quote(place));
    array_.shards.index_at_end = place != "start";
    const Json& index = member(sharding, "index_codecs");
    if (!index.is_array() || index.empty() || index.size() > 2 || codec_name(index.front()) != "bytes" ||
        (index.size() == 2 && codec_name(index.back()) != "crc32c"))
        throw unsupported("expected the shards' index to have the codecs bytes, or bytes and crc32c");
    set_byte_order(index.front(), array_.shards.index_is_big_endian);
    array_.shards.index_has_checksum = index.size() == 2;
    const Json& codecs = member(sharding, "codecs");
    for (const Json& codec : codecs)
        if (codec_name(codec) == "sharding_indexed")
            throw unsupported("expected shards that contain no shards themselves");
    read_codecs(codecs);
    array_.shards.counts = std::move(counts);
}

std::string metadata_of(const std::string& folder, const char* name) { return folder + "/" + name; }

}  // namespace

std::string ZarrArray::file_of(const std::vector<std::uint64_t>& place) const {
    std::string file = folder + "/" + key_begin;
    for (std::size_t d = 0; d < place.size(); ++d) {
        if (d > 0) file += separator;
        file += std::to_string(place[d]);
    }
    return file;
}

bool is_zarr_array(const std::string& folder) {
    if (StoreFile::open(metadata_of(folder, ".zarray"))) return true;
    const std::optional<Json> json = read_json(metadata_of(folder, "zarr.json"));
    return json && text_of(member(*json, "node_type")) == "array";
}

ZarrArray read_zarr_array(const std::string& folder) {
    ZarrArray array;
    array.folder = folder;
    array.metadata = metadata_of(folder, "zarr.json");
    array.version = 3;
    std::optional<Json> json = read_json(array.metadata);
    if (json && text_of(member(*json, "node_type")) != "array") json.reset();
    if (!json) {
        array.metadata = metadata_of(folder, ".zarray");
        array.version = 2;
        json = read_json(array.metadata);
    }
    if (!json) throw read_error(Errc::Io, folder, "expected an array described by .zarray or zarr.json");
    ArrayReader reader(array, *json);
    array.version == 3 ? reader.read_3() : reader.read_2();
    return array;
}

}  // namespace covol::detail
