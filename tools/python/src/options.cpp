#include "options.h"

#include <cmath>
#include <limits>

#include "arrays.h"
#include "covol/error.h"

namespace covol::python {
namespace {

using tool::PlainOf;

double to_number(const std::string& name, py::handle value) {
    const double number = PyBool_Check(value.ptr()) ? -1.0 : PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() != nullptr || PyBool_Check(value.ptr())) {
        PyErr_Clear();
        reject(name, "a number", value);
    }
    return number;
}

// ---- conversion of values to and from Python, by type --------------------------------------------------------------

/// Whether options of type T are keyword arguments in Python.
template <typename T>
constexpr bool kHasKeyword = HasWords<T> || kIsNumber<T> || std::is_same_v<T, Vec3> || std::is_same_v<T, WorldBox> ||
                             std::is_same_v<T, std::vector<Vec3>>;

template <typename T>
std::string type_of(bool is_length) {
    if constexpr (HasWords<T>) {
        std::string words;
        for (const char* word : kWords<T>)
            if (word != nullptr) words += (words.empty() ? "\"" : ", \"") + std::string(word) + "\"";
        return "Literal[" + words + "]";
    }
    if (std::is_integral_v<T>) return "int";
    if (std::is_same_v<T, double>) return is_length ? "_Length" : "float";
    return std::is_same_v<T, Vec3> ? "_Vector" : std::is_same_v<T, WorldBox> ? "_Box" : "ArrayLike";
}

template <typename T>
T from_python(const OptionInfo& option, py::handle value) {
    const std::string name = option.name;
    if constexpr (HasWords<T>) {
        return to_choice<T>(name, value);
    } else if constexpr (kIsNumber<T>) {
        const double number = to_number(name, value);
        const bool whole = number == std::floor(number) && std::abs(number) < 1e9;
        if (std::is_integral_v<T> && !whole)
            reject(name, number == std::floor(number) ? "a whole number of at most 9 digits" : "a whole number", value);
        option.range.require(name, number);
        return static_cast<T>(number);
    } else if constexpr (std::is_same_v<T, Vec3>) {
        return to_vec3(name.c_str(), value);
    } else if constexpr (std::is_same_v<T, WorldBox>) {
        const std::vector<Vec3> corners = to_positions(name.c_str(), value);
        if (corners.size() != 2) reject(name, "two corners, ((x0, y0, z0), (x1, y1, z1))", value);
        return {corners[0], corners[1]};
    } else {
        return to_positions(name.c_str(), value);
    }
}

py::object to_python(double v) { return py::float_(v); }
py::object to_python(int v) { return py::int_(v); }
py::object to_python(std::size_t v) { return py::int_(v); }
py::object to_python(const Vec3& v) { return from_vec3(v); }
py::object to_python(const WorldBox& b) { return py::make_tuple(from_vec3(b.min), from_vec3(b.max)); }
py::object to_python(const std::vector<Vec3>& v) {
    py::tuple all(v.size());
    for (std::size_t n = 0; n < v.size(); ++n) all[n] = from_vec3(v[n]);
    return all;
}
template <HasWords Enum>
py::object to_python(Enum v) {
    return py::str(to_string(v));
}
template <typename T>
py::object to_python(const std::optional<T>& v) {
    return v ? to_python(*v) : py::none();
}

/// Calls visit(option, field, type) for each option that is a keyword argument; `type` is the field's type without
/// std::optional.
template <typename Of, typename Visit>
void for_each_keyword(Of& settings, const Visit& visit) {
    for_each_option(settings, [&](const OptionInfo& option, auto& field) {
        using T = PlainOf<std::remove_cvref_t<decltype(field)>>;
        if constexpr (kHasKeyword<T>)
            if (option.place.group != Group::None && option.place.offered != Offered::SingleStep)
                visit(option, field, std::type_identity<T>());
    });
}

}  // namespace

void reject(const std::string& name, const std::string& expected, py::handle got) {
    throw Error(Errc::InvalidOptions, name + ": expected " + expected + ", got " + py::cast<std::string>(py::repr(got)),
                name);
}

Length to_length(const std::string& name, py::handle given) {
    if (py::isinstance<py::str>(given)) return tool::parse_length(name, py::cast<std::string>(given));
    return {to_number(name, given), false, true};
}

GivenOptions::GivenOptions(const char* function, const py::dict& keywords) {
    for (const auto& [key, value] : keywords) {
        const auto name = py::cast<std::string>(key);
        bool is_known = false;
        for_each_keyword(given_.options,
                         [&, given = value]<typename T>(const OptionInfo& option, auto& field, std::type_identity<T>) {
                             if (name != option.name) return;
                             is_known = true;
                             given_.names.insert(name);
                             if constexpr (!std::is_same_v<T, std::remove_reference_t<decltype(field)>>)
                                 if (given.is_none()) return field.reset();
                             if (option.range.unit == Unit::Length || option.range.unit == Unit::Volume) {
                                 const Length length = to_length(name, given);
                                 option.range.require(name, length.value);
                                 given_.lengths[name] = length;
                             } else {
                                 field = from_python<T>(option, given);
                             }
                         });
        if (is_known) continue;
        py::list known;
        for_each_keyword(given_.options, [&](const OptionInfo& option, auto&, auto) { known.append(option.name); });
        const py::list near = py::module_::import("difflib").attr("get_close_matches")(name, known, 1);
        throw py::type_error(std::string(function) + "() got an unexpected option '" + name + "'" +
                             (near.empty() ? "" : "; did you mean '" + py::cast<std::string>(near[0]) + "'?"));
    }
}

Settings GivenOptions::resolve(double h, bool with_image) const {
    Settings settings = given_.resolve(h);
    if (!with_image && !given_.has("rho")) settings.segment.evolve.rho = 0;
    settings.segment.voxel_size = h;
    settings.segment.voxel_size_may_grow = !voxel_size().given;
    settings.contours.step = h;
    return settings;
}

py::list list_options() {
    py::list all;
    const Settings defaults;
    for_each_keyword(defaults, [&]<typename T>(const OptionInfo& option, const auto& field, std::type_identity<T>) {
        const bool is_length = option.range.unit == Unit::Length || option.range.unit == Unit::Volume;
        const bool is_plain = std::is_same_v<T, std::remove_cvref_t<decltype(field)>>;
        all.append(py::make_tuple(option.name, type_of<T>(is_length) + (is_plain ? "" : " | None"), to_python(field)));
    });
    return all;
}

}  // namespace covol::python
