// The extension module covol._covol: arrays in and out, and how calls run. What people call is in covol/__init__.py.
#include <cctype>
#include <optional>
#include <regex>
#include <utility>

#include "classes.h"
#include "cli/option_names.h"
#include "covol/error.h"
#include "covol/version.h"

namespace covol::python {
namespace {

const char* word_of(Errc code) {
    switch (code) {
        case Errc::InvalidOptions: return "invalid_options";
        case Errc::InvalidInput: return "invalid_input";
        case Errc::Io: return "io";
        case Errc::Unsupported: return "unsupported";
        case Errc::Numerical: return "numerical";
        case Errc::Cancelled: break;
    }
    return "cancelled";
}

/// The keyword for a field that the library names: the flag's name where it has a flag.
std::string keyword_of(const std::string& field) {
    std::string name = tool::flag_of(field);
    if (name.starts_with("--")) {
        name.erase(0, 2);
        for (char& c : name)
            if (c == '-') c = '_';
        return name;
    }
    return name_of_field(field);
}

/// "tag_distance = 3", "points_order = 'zyx'"
std::string spell(const NamedOption& option) {
    const std::string keyword = keyword_of(option.field);
    std::string name = keyword.empty() ? option.field : keyword;
    if (option.value.empty()) return name;
    const bool is_word =
        std::isalpha(static_cast<unsigned char>(option.value[0])) != 0 && option.value.find(',') == std::string::npos;
    return name + " = " + (is_word ? "'" + tool::value_of(option) + "'" : option.value);
}

/// The keyword that a message is about; none where it names none.
py::object field_of(const std::string& message) {
    for (const NamedOption& option : find_named_options(message))
        if (const std::string keyword = keyword_of(option.field); !keyword.empty()) return py::str(keyword);
    static const std::regex complaint(R"((?:^|\n|: )([a-z_.]+): expected)");
    std::smatch found;
    if (!std::regex_search(message, found, complaint)) return py::none();
    const std::string keyword = keyword_of(found[1]);
    return py::str(keyword.empty() ? found[1].str() : keyword);
}

void raise(const char* code, const std::string& message) {
    const py::object type = py::module_::import("covol._errors").attr("Error");
    PyErr_SetObject(type.ptr(), type(replace_names(message, spell), code, field_of(message)).ptr());
}

void translate(std::exception_ptr thrown) {
    try {
        if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const Error& error) {
        raise(word_of(error.code()), error.what());
    } catch (const tool::UsageError& error) {
        raise(word_of(Errc::InvalidOptions), error.what());
    }
}

py::list list_options() {
    py::list all;
    const Settings defaults;
    for (const Option& option : option_table())
        all.append(py::make_tuple(option.name, option.type, option.get(defaults)));
    all.append(py::make_tuple("voxel_size", "_Length | None", py::none()));
    return all;
}

}  // namespace

py::object from_json(const std::string& text) { return py::module_::import("json").attr("loads")(text); }

}  // namespace covol::python

PYBIND11_MODULE(_covol, module) {
    using namespace covol::python;
    module.attr("__version__") = COVOL_VERSION_STRING;
    py::register_exception_translator(translate);
    add_image(module);
    add_points(module);
    add_surfaces(module);
    add_jobs(module);
    module.def("list_options", list_options, "Of segment() and reconstruct(): name, type and default.");
}
