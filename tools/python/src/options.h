#pragma once
#include <pybind11/pybind11.h>

#include <string>

#include "covol/cloud_cleanup.h"
#include "covol/pipeline.h"
#include "flags/given.h"
#include "flags/input_options.h"

namespace covol::python {

namespace py = pybind11;
using tool::Length;

/// All settings of segment() and reconstruct() that have options.
struct Settings {
    SegmentOptions segment;
    ContourOptions contours;
    CloudCleanupOptions cloud;
    tool::InputOptions inputs;
};

/// Keyword arguments, which are read while the GIL is held.
class GivenOptions {
public:
    /// @throws Error InvalidOptions, py::type_error for an unknown name.
    GivenOptions(const char* function, const py::dict& keywords);
    /// The value of "voxel_size", which may be a multiple of the automatic one.
    [[nodiscard]] Length voxel_size() const { return given_.length("voxel_size"); }
    /// The settings for voxels of edge h, which may be increased later if no voxel size was given.
    [[nodiscard]] Settings resolve(double h, bool with_image) const;

private:
    tool::Given<Settings> given_;
};

/// (name, type, default) of each option: the source of __init__.pyi.
[[nodiscard]] py::list list_options();

/// The enumerator with the given name. @throws Error InvalidOptions, "name: expected one of ..."
template <HasWords Enum>
[[nodiscard]] Enum to_choice(const std::string& name, py::handle given);
[[nodiscard]] Length to_length(const std::string& name, py::handle given);
/// @throws Error InvalidOptions "name: expected ..., got ..."
[[noreturn]] void reject(const std::string& name, const std::string& expected, py::handle got);

template <HasWords Enum>
Enum to_choice(const std::string& name, py::handle given) {
    std::string list;
    for (std::size_t n = 0; n < kWords<Enum>.size(); ++n)
        if (const char* word = kWords<Enum>[n]; word != nullptr) {
            if (py::isinstance<py::str>(given) && py::cast<std::string>(given) == word) return Enum(n);
            list += (list.empty() ? "" : ", ") + std::string(word);
        }
    reject(name, "one of " + list, given);
}

}  // namespace covol::python

template <>
inline constexpr auto covol::kOptions<covol::python::Settings> =
    std::tuple{Part{&python::Settings::segment}, Part{&python::Settings::contours}, Part{&python::Settings::cloud},
               Part{&python::Settings::inputs}};
