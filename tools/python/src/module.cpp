// The extension module covol._covol: conversion of arrays, and how calls are run. The public functions are in
// covol/__init__.py.
#include <cctype>
#include <optional>
#include <utility>

#include "classes.h"
#include "covol/error.h"
#include "covol/option_names.h"
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

/// An option as in Python: "tag_distance = 3", "points_order = 'zyx'".
std::string spell(const std::string& name, const std::string& value) {
    if (value.empty()) return name;
    const bool is_word =
        std::isalpha(static_cast<unsigned char>(value[0])) != 0 && value.find(',') == std::string::npos;
    return name + " = " + (is_word ? "'" + value + "'" : value);
}

void raise(const char* code, const std::string& message, const std::string& option) {
    const py::object type = py::module_::import("covol._errors").attr("Error");
    const py::object field = option.empty() ? py::none() : py::object(py::str(option));
    PyErr_SetObject(type.ptr(), type(replace_names(message, spell), code, field).ptr());
}

void translate(std::exception_ptr thrown) {
    try {
        if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const Error& error) {
        raise(word_of(error.code()), error.what(), error.option());
    } catch (const tool::UsageError& error) {
        raise(word_of(Errc::InvalidOptions), error.what(), error.option);
    }
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
    module.def("list_options", list_options, "Options of segment() and reconstruct(): name, type and default.");
}
