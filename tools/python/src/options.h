#pragma once
#include <pybind11/pybind11.h>

#include <functional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "covol/cloud_cleanup.h"
#include "covol/pipeline.h"

namespace covol::python {

namespace py = pybind11;
using tool::Length;

/// All that options of segment() and reconstruct() set.
struct Settings {
    SegmentOptions options;
    ContourOptions contours;
    CloudCleanupOptions cloud;
    std::size_t most_points = 2500000;  ///< of a cloud without an image; 0: all
    double min_component = 0;           ///< edge of a cube of the smallest piece that is kept, world units
    int guess_label = 0;                ///< 0: the only one
};

/// An option as a keyword of Python.
struct Option {
    std::string name;   ///< the program's flag, with _ for -
    std::string field;  ///< as the library's messages name it
    std::string type;   ///< for stubs and messages
    bool is_length = false;
    std::function<void(Settings&, double)> set_number;                ///< of a length, in world units
    std::function<std::function<void(Settings&)>(py::handle)> parse;  ///< of all others; needs the GIL, its result not
    std::function<py::object(const Settings&)> get;
};

/// The one list of them.
[[nodiscard]] const std::vector<Option>& option_table();
/// The keyword that sets a field of the library; empty where none does.
[[nodiscard]] std::string name_of_field(const std::string& field);

/// Keywords, read while the GIL is held.
class GivenOptions {
public:
    /// @throws Error InvalidOptions, py::type_error for a name that is none.
    GivenOptions(const char* function, const py::dict& keywords);
    /// "voxel_size", which may be relative to the automatic one.
    [[nodiscard]] const Length& voxel_size() const { return voxel_size_; }
    /// The settings for voxels of edge h, which stays one that may grow where it was not given.
    [[nodiscard]] Settings resolve(double h, bool with_image) const;

private:
    Length voxel_size_;
    std::vector<std::pair<const Option*, Length>> lengths_;
    std::vector<std::function<void(Settings&)>> others_;
};

[[nodiscard]] Length to_length(const std::string& name, py::handle value);

}  // namespace covol::python
