#include "io/hdf5/hdf5_dataset.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "base/text.h"
#include "io/chunked/zarr_codecs.h"

namespace covol::detail {
namespace {

constexpr int kMaxDimensions = 16;

struct KnownType {
    hid_t id;
    PixelType pixel;
    StoredAs stored_as = StoredAs::Pixels;
};

std::vector<KnownType> known_types() {
    return {{H5T_STD_U8LE, PixelType::UInt8},
            {H5T_STD_I8LE, PixelType::Int8},
            {H5T_STD_U16LE, PixelType::UInt16},
            {H5T_STD_I16LE, PixelType::Int16},
            {H5T_STD_U32LE, PixelType::UInt32},
            {H5T_STD_I32LE, PixelType::Int32},
            {H5T_STD_U64LE, PixelType::Double, StoredAs::UInt64},
            {H5T_STD_I64LE, PixelType::Double, StoredAs::Int64},
            {H5T_IEEE_F32LE, PixelType::Float},
            {H5T_IEEE_F64LE, PixelType::Double}};
}

/// The type binary16 of IEEE 754, for which the library has no name.
Hdf5Id half_type() {
    Hdf5Id half(H5Tcopy(H5T_IEEE_F32LE), H5Tclose);
    H5Tset_fields(half.get(), 15, 10, 5, 0, 10);
    H5Tset_size(half.get(), 2);
    H5Tset_ebias(half.get(), 15);
    return half;
}

const char* class_name(H5T_class_t kind) {
    switch (kind) {
        case H5T_INTEGER: return "integers of another size or with unused bits";
        case H5T_FLOAT: return "floats of another format";
        case H5T_STRING: return "texts";
        case H5T_COMPOUND: return "records of several values (a compound type)";
        case H5T_ARRAY: return "lists in each element (an array type)";
        case H5T_VLEN: return "lists of different length";
        case H5T_REFERENCE: return "references";
        case H5T_BITFIELD: return "bit fields";
        default: return "elements of another type";
    }
}

/// The type of the numbers in a dataset. For an enumeration, as which h5py stores Python's bool, this is the type of
/// the enumeration's values.
Hdf5Id number_type(hid_t type) {
    const bool is_enum = H5Tget_class(type) == H5T_ENUM;
    return {is_enum ? H5Tget_super(type) : H5Tcopy(type), H5Tclose};
}

/// Whether H5Dget_chunk_storage_size(), which has just failed, failed because the chunk was never written. This is an
/// error only in HDF5 1.10, and no damage. In this case the error stack begins with an error of the function itself; if
/// the index is damaged, it begins with an error of a function that it calls. Reading a voxel would distinguish the
/// cases, too, but would fill a whole chunk.
bool is_of_missing_chunk() {
    const auto look_at_first = [](unsigned, const H5E_error2_t* error, void* found) -> herr_t {
        *static_cast<bool*>(found) = error->func_name == std::string_view("H5D__get_chunk_storage_size");
        return 1;  // ends H5Ewalk2() after the first error of the stack
    };
    bool found = false;
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look_at_first, &found);
    return found;
}

class Hdf5Chunks : public ArrayChunks {
public:
    Hdf5Chunks(std::shared_ptr<const Hdf5Dataset> dataset, const ArrayAxes& axes, const Index3& size,
               std::uint64_t channel, std::uint64_t frame)
        : ArrayChunks(dataset->path(), dataset->array(), axes, size, channel, frame), dataset_(std::move(dataset)) {}

protected:
    [[nodiscard]] std::optional<Bytes> elements(const std::vector<std::uint64_t>& place) const override {
        return dataset_->elements(place);
    }

private:
    std::shared_ptr<const Hdf5Dataset> dataset_;
};

}  // namespace

Hdf5Dataset::Hdf5Dataset(std::shared_ptr<const Hdf5File> file, const std::string& name)
    : file_(std::move(file)), path_(file_->path_of(name)) {
    const Hdf5Lock lock;
    dataset_ = file_->open(name);
    if (H5Iget_type(dataset_.get()) != H5I_DATASET)
        throw read_error(Errc::InvalidInput, path_, "expected a dataset, got a group");
    type_ = Hdf5Id(H5Dget_type(dataset_.get()), H5Tclose);
    const Hdf5Id space(H5Dget_space(dataset_.get()), H5Sclose);
    const Hdf5Id properties(H5Dget_create_plist(dataset_.get()), H5Pclose);
    if (!type_ || !space || !properties) throw damaged("its header cannot be read");
    read_type(type_.get());
    read_shape(space.get());
    read_filters(properties.get());
    read_layout(properties.get());
    read_fill(properties.get());
}

Error Hdf5Dataset::damaged(const std::string& what) const {
    return read_error(Errc::InvalidInput, path_, "damaged or truncated: " + what);
}

void Hdf5Dataset::read_type(hid_t type) {
    const Hdf5Id numbers = number_type(type);
    const H5T_class_t kind = numbers ? H5Tget_class(numbers.get()) : H5T_NO_CLASS;
    if (kind == H5T_INTEGER || kind == H5T_FLOAT) {
        const bool big = H5Tget_order(numbers.get()) == H5T_ORDER_BE;
        const Hdf5Id little(H5Tcopy(numbers.get()), H5Tclose);
        if (big) H5Tset_order(little.get(), H5T_ORDER_LE);
        const bool is_half = H5Tequal(little.get(), half_type().get()) > 0;
        std::optional<KnownType> known;
        if (is_half) known = KnownType{0, PixelType::Float, StoredAs::Half};
        for (const KnownType& one : known_types())
            if (H5Tequal(little.get(), one.id) > 0) known = one;
        if (known) {
            array_.type = known->pixel;
            array_.stored_as = known->stored_as;
            array_.swap = big == (std::endian::native == std::endian::little) && array_.stored_bytes() > 1;
            return;
        }
    }
    throw read_error(
        Errc::Unsupported, path_,
        std::string("expected integers of 8, 16, 32 or 64 bits or floats of 16, 32 or 64, got ") + class_name(kind));
}

void Hdf5Dataset::read_shape(hid_t space) {
    const int count = H5Sget_simple_extent_type(space) == H5S_SIMPLE ? H5Sget_simple_extent_ndims(space) : 0;
    if (count < 3 || count > kMaxDimensions)
        throw read_error(Errc::InvalidInput, path_,
                         "expected a dataset of 3 to " + std::to_string(kMaxDimensions) + " dimensions, got " +
                             std::to_string(count));
    std::vector<hsize_t> shape(static_cast<std::size_t>(count));
    H5Sget_simple_extent_dims(space, shape.data(), nullptr);
    for (const hsize_t n : shape) {
        if (n > std::uint64_t(std::numeric_limits<std::int32_t>::max()))
            throw damaged("its header claims an axis of " + std::to_string(n) + " elements");
        array_.shape.push_back(n);
    }
}

void Hdf5Dataset::read_filters(hid_t properties) {
    constexpr int kMaxFilters = 32;  // the HDF5 library's own limit
    const int count = H5Pget_nfilters(properties);
    if (count < 0 || count > kMaxFilters) throw damaged("its filters cannot be read");
    for (int n = 0; n < count; ++n) {
        std::array<unsigned, 32> values{};
        std::array<char, 64> name{};
        unsigned flags = 0, config = 0;
        std::size_t used = values.size();
        const H5Z_filter_t id = H5Pget_filter2(properties, unsigned(n), &flags, &used, values.data(), name.size() - 1,
                                               name.data(), &config);
        if (id < 0) throw damaged("its filters cannot be read");
        used = std::min(used, values.size());
        filters_.push_back({unsigned(id), {values.begin(), values.begin() + std::ptrdiff_t(used)}, name.data()});
    }
    as_packed_ = can_undo(filters_);
    for (const Hdf5Filter& filter : filters_) {
        unsigned config = 0;
        const bool known = as_packed_ || (H5Zfilter_avail(H5Z_filter_t(filter.id)) > 0 &&
                                          H5Zget_filter_info(H5Z_filter_t(filter.id), &config) >= 0 &&
                                          (config & H5Z_FILTER_CONFIG_DECODE_ENABLED) != 0);
        if (!known)
            throw read_error(
                Errc::Unsupported, path_,
                "its chunks are compressed by the filter " + std::to_string(filter.id) +
                    (filter.name.empty() ? "" : " (" + quote(filter.name) + ")") +
                    ", which this HDF5 library does not have; compress them with gzip, LZF, Blosc, Zstandard "
                    "or LZ4 (h5repack -f GZIP=5)");
    }
}

void Hdf5Dataset::treat_as_unsigned() noexcept {
    if (array_.type == PixelType::Int16) array_.type = PixelType::UInt16;
}

std::string Hdf5Dataset::filter_names() const {
    std::string names;
    for (const Hdf5Filter& filter : filters_) {
        std::string name = filter.name.empty() ? std::to_string(filter.id) : filter.name;
        std::replace_if(
            name.begin(), name.end(), [](unsigned char c) { return c < ' ' || c > '~'; }, '?');
        names += (names.empty() ? "" : ", ") + name;
    }
    return names;
}

/// Rejects chunks without elements, and chunks of more than kMaxChunkBytes, because a chunk is unpacked into memory as
/// a whole, including all of its channels and frames.
void Hdf5Dataset::check_chunk() const {
    std::uint64_t bytes = array_.stored_bytes();
    for (const std::uint64_t n : array_.chunk) {
        if (n == 0) throw damaged("its header claims chunks with a side of 0");
        if (bytes > kMaxChunkBytes / n)
            throw read_error(Errc::Unsupported, path_,
                             "expected chunks of 1 GiB at most, got larger ones; write it with smaller chunks");
        bytes *= n;
    }
}

void Hdf5Dataset::set_bricks() {
    constexpr std::uint64_t kSide = 64, kMaxElements = kSide * kSide * kSide;
    std::uint64_t elements = 1;
    array_.chunk.assign(array_.shape.size(), 1);
    for (std::size_t d = array_.shape.size(); d-- > 0; elements *= array_.chunk[d])
        array_.chunk[d] = std::clamp<std::uint64_t>(std::min(array_.shape[d], kMaxElements / elements), 1, kSide);
}

void Hdf5Dataset::read_layout(hid_t properties) {
    const H5D_layout_t layout = H5Pget_layout(properties);
    if (layout == H5D_VIRTUAL || (layout == H5D_CONTIGUOUS && H5Pget_external_count(properties) > 0))
        throw read_error(Errc::Unsupported, path_,
                         "its values lie in other files, which are not read; copy it into one file (h5repack)");
    if (layout == H5D_CHUNKED) {
        std::array<hsize_t, kMaxDimensions> chunk{};
        const int count = H5Pget_chunk(properties, kMaxDimensions, chunk.data());
        if (count != int(array_.shape.size()))
            throw damaged("its chunks and its shape differ in their number of dimensions");
        array_.chunk.assign(chunk.begin(), chunk.begin() + count);
    } else if (layout == H5D_CONTIGUOUS || layout == H5D_COMPACT) {
        as_packed_ = false;
        set_bricks();
        const haddr_t begin = layout == H5D_CONTIGUOUS ? H5Dget_offset(dataset_.get()) : HADDR_UNDEF;
        if (begin != HADDR_UNDEF) offset_ = begin;
    } else {
        throw damaged("its layout is unknown");
    }
    check_chunk();
    array_.strides.assign(array_.shape.size(), 1);
    for (std::size_t d = array_.shape.size() - 1; d-- > 0;)
        array_.strides[d] = array_.strides[d + 1] * array_.chunk[d + 1];
}

void Hdf5Dataset::read_fill(hid_t properties) {
    H5D_fill_value_t state = H5D_FILL_VALUE_UNDEFINED;
    double fill = 0;
    if (H5Pfill_value_defined(properties, &state) >= 0 && state == H5D_FILL_VALUE_USER_DEFINED &&
        H5Pget_fill_value(properties, H5T_NATIVE_DOUBLE, &fill) >= 0)
        array_.fill = fill;
}

/// The bytes of a chunk as the file stores them; nothing if the file has no such chunk. `skipped` receives the bit mask
/// of the filters that were not applied to this chunk.
std::optional<Bytes> Hdf5Dataset::packed_chunk(const std::vector<std::uint64_t>& begin, unsigned& skipped) const {
    const std::vector<hsize_t> offset(begin.begin(), begin.end());
    hsize_t stored = 0;
    const Hdf5Lock lock;
    if (H5Dget_chunk_storage_size(dataset_.get(), offset.data(), &stored) < 0) {
        if (!is_of_missing_chunk()) throw damaged("the index of its chunks cannot be read");
        return std::nullopt;
    }
    if (stored == 0) return std::nullopt;
    const std::uint64_t expected = array_.chunk_bytes();
    if (stored > file_->bytes() || stored > (filters_.empty() ? expected : max_packed_bytes(expected)))
        throw damaged("expected a chunk of " + std::to_string(expected) + " bytes when unpacked, got " +
                      std::to_string(stored) + " packed bytes");
    Bytes packed(stored);
    std::uint32_t mask = 0;
    if (H5Dread_chunk(dataset_.get(), H5P_DEFAULT, offset.data(), &mask, packed.data()) < 0)
        throw damaged("a chunk cannot be read");
    skipped = mask;
    return packed;
}

/// Reads a box with the HDF5 library into memory of this `shape`; elements beyond the dataset are left unchanged.
void Hdf5Dataset::read_box(const std::vector<std::uint64_t>& begin, const std::vector<std::uint64_t>& shape,
                           void* out) const {
    const std::vector<hsize_t> offset(begin.begin(), begin.end()), memory(shape.begin(), shape.end()),
        zero(begin.size(), 0);
    std::vector<hsize_t> count(begin.size());
    for (std::size_t d = 0; d < begin.size(); ++d) count[d] = std::min(shape[d], array_.shape[d] - begin[d]);
    const Hdf5Lock lock;
    const Hdf5Id from(H5Dget_space(dataset_.get()), H5Sclose);
    const Hdf5Id to(H5Screate_simple(int(memory.size()), memory.data(), nullptr), H5Sclose);
    const bool done =
        H5Sselect_hyperslab(from.get(), H5S_SELECT_SET, offset.data(), nullptr, count.data(), nullptr) >= 0 &&
        H5Sselect_hyperslab(to.get(), H5S_SELECT_SET, zero.data(), nullptr, count.data(), nullptr) >= 0 &&
        H5Dread(dataset_.get(), type_.get(), to.get(), from.get(), H5P_DEFAULT, out) >= 0;
    if (!done) throw damaged("a part cannot be read");
}

std::optional<Bytes> Hdf5Dataset::elements(const std::vector<std::uint64_t>& place) const {
    std::vector<std::uint64_t> begin = place;
    for (std::size_t d = 0; d < place.size(); ++d) begin[d] *= array_.chunk[d];
    if (!as_packed_) {
        Bytes out(array_.chunk_bytes());
        read_box(begin, array_.chunk, out.data());
        return out;
    }
    unsigned skipped = 0;
    std::optional<Bytes> packed = packed_chunk(begin, skipped);
    if (packed) return undo_filters(path_, filters_, skipped, std::move(*packed), array_.chunk_bytes());
    if (!std::isfinite(array_.fill))
        throw read_error(Errc::InvalidInput, path_,
                         "expected finite values, got a chunk that is missing and a fill value that is not finite");
    return std::nullopt;
}

Hdf5Shape shape_of(const Hdf5File& file, const std::string& name) {
    const Hdf5Lock lock;
    const Hdf5Id dataset = file.open(name);
    const Hdf5Id type(H5Dget_type(dataset.get()), H5Tclose), space(H5Dget_space(dataset.get()), H5Sclose);
    Hdf5Shape found;
    if (!type || !space || H5Sget_simple_extent_type(space.get()) != H5S_SIMPLE) return found;
    const H5T_class_t kind = H5Tget_class(type.get());
    found.has_numbers = kind == H5T_INTEGER || kind == H5T_FLOAT || kind == H5T_ENUM;
    const int count = H5Sget_simple_extent_ndims(space.get());
    if (count < 1 || count > kMaxDimensions) return found;
    std::vector<hsize_t> shape(static_cast<std::size_t>(count));
    H5Sget_simple_extent_dims(space.get(), shape.data(), nullptr);
    found.shape.assign(shape.begin(), shape.end());
    return found;
}

std::shared_ptr<const ChunkSource> hdf5_chunks(std::shared_ptr<const Hdf5Dataset> dataset, const ArrayAxes& axes,
                                               const Index3& size, std::uint64_t channel, std::uint64_t frame) {
    return std::make_shared<Hdf5Chunks>(std::move(dataset), axes, size, channel, frame);
}

}  // namespace covol::detail
