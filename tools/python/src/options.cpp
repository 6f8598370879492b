#include "options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <type_traits>

#include "arrays.h"
#include "covol/error.h"

namespace covol::python {
namespace {

template <typename T>
using Words = std::vector<std::pair<const char*, T>>;

[[noreturn]] void bad(const std::string& name, const std::string& expected, py::handle got) {
    throw Error(Errc::InvalidOptions,
                name + ": expected " + expected + ", got " + py::cast<std::string>(py::repr(got)));
}

double to_number(const std::string& name, py::handle value) {
    const double number = PyBool_Check(value.ptr()) ? -1.0 : PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() != nullptr || PyBool_Check(value.ptr())) {
        PyErr_Clear();
        bad(name, "a number", value);
    }
    return number;
}

// ---- what a value of each type is in Python ------------------------------------------------------------------------

std::string type_of(double) { return "float"; }
std::string type_of(int) { return "int"; }
std::string type_of(std::size_t) { return "int"; }
std::string type_of(const Vec3&) { return "_Vector"; }
std::string type_of(const WorldBox&) { return "_Box"; }
std::string type_of(const std::vector<Vec3>&) { return "ArrayLike"; }
template <typename T>
std::string type_of(const std::optional<T>&) {
    return type_of(T{}) + " | None";
}

template <typename T>
T from_python(const std::string& name, py::handle value) {
    if constexpr (std::is_same_v<T, double>) {
        return to_number(name, value);
    } else if constexpr (std::is_integral_v<T>) {
        const double number = to_number(name, value);
        const bool whole = number == std::floor(number) && std::abs(number) < 1e9;
        if (!whole || (std::is_unsigned_v<T> && number < 0)) bad(name, "a whole number", value);
        return static_cast<T>(number);
    } else if constexpr (std::is_same_v<T, Vec3>) {
        return to_vec3(name.c_str(), value);
    } else if constexpr (std::is_same_v<T, WorldBox>) {
        const std::vector<Vec3> corners = to_positions(name.c_str(), value);
        if (corners.size() != 2) bad(name, "two corners, ((x0, y0, z0), (x1, y1, z1))", value);
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
template <typename T>
py::object to_python(const std::optional<T>& v) {
    return v ? to_python(*v) : py::none();
}

template <typename T>
struct ValueOf {
    using type = T;
};
template <typename T>
struct ValueOf<std::optional<T>> {
    using type = T;
};

// ---- the table -----------------------------------------------------------------------------------------------------

/// `at(settings)` is the field.
template <typename At>
Option value(const char* name, const char* field, At at) {
    using Field = std::remove_cvref_t<decltype(at(std::declval<Settings&>()))>;
    using T = typename ValueOf<Field>::type;
    Option option{name, field, type_of(Field{}), false, {}, {}, {}};
    option.get = [at](const Settings& s) { return to_python(at(const_cast<Settings&>(s))); };
    option.parse = [at, name = std::string(name)](py::handle given) -> std::function<void(Settings&)> {
        if constexpr (!std::is_same_v<T, Field>)
            if (given.is_none()) return [at](Settings& s) { at(s).reset(); };
        return [at, v = from_python<T>(name, given)](Settings& s) { at(s) = v; };
    };
    return option;
}

template <typename At>
Option length(const char* name, const char* field, At at) {
    Option option = value(name, field, at);
    option.is_length = true;
    option.type = std::is_same_v<std::remove_cvref_t<decltype(at(std::declval<Settings&>()))>, double>
                      ? "_Length"
                      : "_Length | None";
    option.set_number = [at](Settings& s, double v) { at(s) = v; };
    return option;
}

template <typename T, typename At>
Option word(const char* name, const char* field, At at, const Words<T>& words) {
    Option option{name, field, "", false, {}, {}, {}};
    std::string list;
    for (const auto& [text, known] : words) {
        option.type += (option.type.empty() ? "Literal[\"" : ", \"") + std::string(text) + "\"";
        list += (list.empty() ? "" : ", ") + std::string(text);
    }
    option.type += "]";
    option.get = [at, words](const Settings& s) -> py::object {
        for (const auto& [text, known] : words)
            if (known == at(const_cast<Settings&>(s))) return py::str(text);
        return py::none();
    };
    option.parse = [at, words, list, name = std::string(name)](py::handle given) -> std::function<void(Settings&)> {
        for (const auto& [text, known] : words)
            if (py::isinstance<py::str>(given) && py::cast<std::string>(given) == text)
                return [at, v = known](Settings& s) { at(s) = v; };
        bad(name, "one of " + list, given);
    };
    return option;
}

#define COVOL_AT(expression) \
    [](Settings & s) -> auto& { return (s.expression); }

std::vector<Option> make_table() {
    return {
        word<Model>("model", "model", COVOL_AT(options.model), {{"guided", Model::Guided}, {"paper", Model::Paper}}),
        length("mark_precision", "mark_precision", COVOL_AT(options.mark_precision)),
        value("lattice_origin", "lattice_origin", COVOL_AT(options.lattice_origin)),
        value("roi", "roi", COVOL_AT(options.roi)),
        length("margin", "margin", COVOL_AT(options.margin)),
        length("tag_distance", "tag_distance", COVOL_AT(options.tag_distance)),
        value("exterior_seed", "exterior_seeds", COVOL_AT(options.exterior_seeds)),
        length("sigma", "sigma", COVOL_AT(options.edge.sigma)),
        word<EdgeFeature>("edge_feature", "feature", COVOL_AT(options.edge.feature),
                          {{"auto", EdgeFeature::Automatic},
                           {"slope", EdgeFeature::Slope},
                           {"bright-line", EdgeFeature::BrightLine},
                           {"dark-line", EdgeFeature::DarkLine}}),
        value("edge_k", "edge_k", COVOL_AT(options.edge.edge_k)),
        value("edge_contrast", "edge_contrast", COVOL_AT(options.edge.edge_contrast)),
        value("theta", "theta", COVOL_AT(options.evolve.theta)),
        value("rho", "rho", COVOL_AT(options.evolve.rho)),
        length("delta", "delta", COVOL_AT(options.evolve.delta)),
        length("tau", "tau", COVOL_AT(options.evolve.tau)),
        value("epsilon", "epsilon", COVOL_AT(options.evolve.epsilon)),
        length("attraction_range", "attraction_range", COVOL_AT(options.evolve.attraction_range)),
        value("edge_epsilon", "edge_epsilon", COVOL_AT(options.evolve.edge_epsilon)),
        value("image_yields", "image_yields", COVOL_AT(options.evolve.image_yields)),
        value("guess_weight", "guess_weight", COVOL_AT(options.evolve.guess_weight)),
        value("max_steps", "max_steps", COVOL_AT(options.evolve.max_steps)),
        value("tolerance", "tolerance", COVOL_AT(options.evolve.tolerance)),
        value("solver_tolerance", "solver_tolerance", COVOL_AT(options.evolve.solver_tolerance)),
        value("coarse_levels", "coarse_levels", COVOL_AT(options.coarse_levels)),
        length("min_component", "min_component_volume", COVOL_AT(min_component)),
        word<ContourCurve>("contour_curve", "curve", COVOL_AT(contours.curve),
                           {{"spline", ContourCurve::Spline}, {"lines", ContourCurve::Lines}}),
        length("contour_thickness", "thickness", COVOL_AT(contours.thickness)),
        value("guess_label", "guess_label", COVOL_AT(guess_label)),
        length("guess_radius", "least_radius", COVOL_AT(options.correction.least_radius)),
        word<Holes>("holes", "holes.policy", COVOL_AT(options.holes.policy),
                    {{"close", Holes::Close}, {"open", Holes::Open}, {"flat", Holes::Flat}}),
        length("hole_distance", "holes.distance", COVOL_AT(options.holes.distance)),
        value("most_points", "most_points", COVOL_AT(most_points)),
        value("remove_outliers", "outlier_factor", COVOL_AT(cloud.outlier_factor)),
        length("simplify", "simplify", COVOL_AT(cloud.simplify)),
        word<CloudSmoothing>(
            "smooth", "smooth", COVOL_AT(cloud.smooth),
            {{"none", CloudSmoothing::None}, {"jets", CloudSmoothing::Jets}, {"wlop", CloudSmoothing::Wlop}}),
    };
}

#undef COVOL_AT

const Option* find(const std::string& name) {
    const std::vector<Option>& all = option_table();
    const auto at = std::find_if(all.begin(), all.end(), [&](const Option& o) { return o.name == name; });
    return at != all.end() ? &*at : nullptr;
}

}  // namespace

const std::vector<Option>& option_table() {
    static const auto* const table = new std::vector<Option>(make_table());  // its functions outlive the interpreter
    return *table;
}

std::string name_of_field(const std::string& field) {
    for (const Option& option : option_table())
        if (option.field == field) return option.name;
    if (field == "start" || field.starts_with("start.")) return "init";
    return {};
}

Length to_length(const std::string& name, py::handle given) {
    if (py::isinstance<py::str>(given)) return tool::parse_length(name, py::cast<std::string>(given));
    return {to_number(name, given), false, true};
}

GivenOptions::GivenOptions(const char* function, const py::dict& keywords) {
    for (const auto& [key, given] : keywords) {
        const auto name = py::cast<std::string>(key);
        if (name == "voxel_size") {
            if (given.is_none()) continue;
            voxel_size_ = to_length(name, given);
            if (!(voxel_size_.value > 0) || !std::isfinite(voxel_size_.value)) bad(name, "> 0", given);
            continue;
        }
        const Option* const option = find(name);
        if (option == nullptr) {
            py::list known;
            for (const Option& o : option_table()) known.append(o.name);
            known.append("voxel_size");
            const py::list near = py::module_::import("difflib").attr("get_close_matches")(name, known, 1);
            throw py::type_error(std::string(function) + "() got an unexpected option '" + name + "'" +
                                 (near.empty() ? "" : "; did you mean '" + py::cast<std::string>(near[0]) + "'?"));
        }
        if (!option->is_length || given.is_none())
            others_.push_back(option->parse(given));
        else
            lengths_.emplace_back(option, to_length(name, given));
    }
}

Settings GivenOptions::resolve(double h, bool with_image) const {
    Settings settings;
    if (!with_image) settings.options.evolve.rho = 0;
    settings.options.voxel_size = h;
    settings.options.voxel_size_may_grow = !voxel_size_.given;
    for (const auto& set : others_) set(settings);
    for (const auto& [option, length] : lengths_) option->set_number(settings, length.resolve(h, 0));
    settings.contours.step = h;
    settings.options.extract.min_component_volume = std::pow(settings.min_component, 3);
    return settings;
}

}  // namespace covol::python
