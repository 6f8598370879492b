#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/chunked/array_chunks.h"
#include "io/hdf5/hdf5_file.h"
#include "io/hdf5/hdf5_filters.h"

namespace covol::detail {

/// A dataset of grey values.
class Hdf5Dataset {
public:
    /// @throws Error InvalidInput (damaged), Unsupported (types, filters, datasets whose values are in other files).
    Hdf5Dataset(std::shared_ptr<const Hdf5File> file, const std::string& name);

    [[nodiscard]] const std::string& path() const noexcept { return path_; }  ///< "FILE.h5:/name", for messages
    /// The array, with the chunks of the file; if the dataset has no chunks, it is divided into bricks, each of which
    /// is read separately.
    [[nodiscard]] const ChunkedArray& array() const noexcept { return array_; }
    /// Position in the file, in bytes, from which all values are stored contiguously; empty if they are not contiguous.
    [[nodiscard]] std::optional<std::uint64_t> offset() const noexcept { return offset_; }
    /// Treats 16-bit integers as unsigned, even if the file declares them as signed.
    void treat_as_unsigned() noexcept;
    /// The names of the filters of the chunks, such as "gzip, shuffle"; empty if there are no filters.
    [[nodiscard]] std::string filter_names() const;
    /// Implements ArrayChunks::elements(). Safe to call from several threads.
    [[nodiscard]] std::optional<Bytes> elements(const std::vector<std::uint64_t>& place) const;

private:
    void read_type(hid_t type);
    void read_shape(hid_t space);
    void read_layout(hid_t properties);
    void read_filters(hid_t properties);
    void read_fill(hid_t properties);
    void set_bricks();
    void check_chunk() const;
    [[nodiscard]] std::optional<Bytes> packed_chunk(const std::vector<std::uint64_t>& begin, unsigned& skipped) const;
    void read_box(const std::vector<std::uint64_t>& begin, const std::vector<std::uint64_t>& shape, void* out) const;
    [[nodiscard]] Error damaged(const std::string& what) const;

    std::shared_ptr<const Hdf5File> file_;
    std::string path_;
    Hdf5Id dataset_, type_;
    ChunkedArray array_;
    std::vector<Hdf5Filter> filters_;
    bool as_packed_ = false;  ///< whether undo_filters() unpacks the chunks; otherwise the HDF5 library does
    std::optional<std::uint64_t> offset_;
};

/// The shape of a dataset, and whether its elements are numbers.
struct Hdf5Shape {
    std::vector<std::uint64_t> shape;
    bool has_numbers = false;
};
Hdf5Shape shape_of(const Hdf5File& file, const std::string& name);

/// The chunks of one channel and frame.
std::shared_ptr<const ChunkSource> hdf5_chunks(std::shared_ptr<const Hdf5Dataset> dataset, const ArrayAxes& axes,
                                               const Index3& size, std::uint64_t channel, std::uint64_t frame);

}  // namespace covol::detail
