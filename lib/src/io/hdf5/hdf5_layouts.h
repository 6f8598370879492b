#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/image.h"
#include "io/hdf5/hdf5_dataset.h"

// The layouts in which programs store images in HDF5 files.
namespace covol::detail {

/// An image in one of the layouts. If channels and frames are separate datasets, all have the same type and size.
struct Hdf5Layout {
    ImageInfo info;  ///< properties of the image; size, type, order and chunk size are not set
    /// Axes of a dataset's dimensions, slowest first: x, y, z, c, t, or ? for a dimension with a single element.
    std::string letters = "zyx";
    /// Each channel and frame is a dataset of its own; `info` then states how many there are.
    bool in_datasets = false;
    std::function<std::string(std::uint64_t channel, std::uint64_t frame)> dataset;  ///< name of the dataset
    std::vector<std::string> coarser;  ///< names of a pyramid's coarser levels, finest first
    std::optional<Index3> size;        ///< size of the image without padding, if the datasets may be padded
    bool is_unsigned = false;          ///< 16-bit integers are unsigned, even if the file declares them as signed
};

/// Describes a level of a pyramid for users: "/name: 512 x 512 x 100, spacing 0.4 x 0.4 x 1".
std::string level_text(const std::string& name, const Index3& size, const Vec3& spacing);

/// The number that follows `word` in a name such as "TimePoint 12" or "s07"; nothing if the name has another form.
std::optional<int> number_after(const std::string& name, const std::string& word);

/// Splits "a/b/c" at the slashes; empty parts are omitted.
std::vector<std::string> parts_of(const std::string& name);

/// For each of the functions below, `inside` is a path within the file, or empty. @returns nothing if the file, or the
/// object at `inside`, does not have the layout. @throws Error as read_image().

/// Imaris 5.5 and later: /DataSet/ResolutionLevel L/TimePoint T/Channel C/Data, described in /DataSetInfo.
/// https://imaris.oxinst.com/support/imaris-file-format
std::optional<Hdf5Layout> imaris_layout(const Hdf5File& file, const std::string& inside);

/// BigDataViewer: tNNNNN/sNN/L/cells, with voxel sizes in an XML file of the same name. https://imagej.net/plugins/bdv/
std::optional<Hdf5Layout> big_data_viewer_layout(const Hdf5File& file, const std::string& inside);

/// The dataset at `inside`. If `inside` is empty or a group: the only dataset of numbers there with at least three
/// dimensions. The meaning of each dimension is taken from ilastik's attribute axistags, otherwise from HDF5's
/// dimension labels; otherwise the order is z, y, x. https://www.ilastik.org/documentation/basics/dataselection
/// Unlike the functions above, this one throws an error if the file does not have the layout.
Hdf5Layout plain_layout(const Hdf5File& file, const std::string& inside);

}  // namespace covol::detail
