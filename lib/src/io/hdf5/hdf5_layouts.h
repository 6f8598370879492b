#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covol/image.h"
#include "io/hdf5/hdf5_dataset.h"

// Where programs put their images in an HDF5 file.
namespace covol::detail {

/// An image of one of the layouts. Where channels and frames are datasets of their own, all are of one kind.
struct Hdf5Layout {
    ImageInfo info;               ///< all but size, type, order and chunks
    std::string letters = "zyx";  ///< of a dataset's dimensions: x, y, z, c, t, or ? for one of a single element
    bool in_datasets = false;     ///< each channel and frame is one: then info has their numbers
    std::function<std::string(std::uint64_t channel, std::uint64_t frame)> dataset;  ///< its name
    std::vector<std::string> coarser;  ///< names of a pyramid's coarser levels, the finest first
    std::optional<Index3> size;        ///< where datasets are padded
    bool is_unsigned = false;          ///< integers of 16 bits have no sign, whatever the file says
};

/// A level of a pyramid: "/name: 512 x 512 x 100, spacing 0.4 x 0.4 x 1".
std::string level_text(const std::string& name, const Index3& size, const Vec3& spacing);

/// A number behind a word, "TimePoint 12" or "s07": nothing where a name is not of that kind.
std::optional<int> number_behind(const std::string& name, const std::string& word);

/// "a/b/c" in its parts; empty ones are left out.
std::vector<std::string> parts_of(const std::string& name);

/// Each of them is given the path within the file, or an empty one.
/// @returns nothing where the file, or what is at that path, is not of the layout. @throws Error as read_image().

/// Imaris 5.5 and later: /DataSet/ResolutionLevel L/TimePoint T/Channel C/Data, described in /DataSetInfo.
/// https://imaris.oxinst.com/support/imaris-file-format
std::optional<Hdf5Layout> imaris_layout(const Hdf5File& file, const std::string& inside);

/// BigDataViewer: tNNNNN/sNN/L/cells, with voxel sizes in an XML file of the same name.
/// https://imagej.net/plugins/bdv/
std::optional<Hdf5Layout> big_data_viewer_layout(const Hdf5File& file, const std::string& inside);

/// A dataset by its path, or the only one of three dimensions. ilastik's axistags say which dimension is which.
/// https://www.ilastik.org/documentation/basics/dataselection
Hdf5Layout plain_layout(const Hdf5File& file, const std::string& inside);

}  // namespace covol::detail
