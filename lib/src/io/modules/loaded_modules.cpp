// Loads the modules of the shared library covol from a folder next to it.
#include <dlfcn.h>

#include <filesystem>

#include "covol/error.h"
#include "covol/reader_parts.h"
#include "covol/version.h"
#include "io/modules/reader.h"

namespace covol::detail {
namespace {

namespace fs = std::filesystem;

/// The folder of the modules. Its name contains the version, because libcovol and its modules must come from one build.
fs::path folder_of_modules() {
    Dl_info here{};
    std::error_code status;
    if (dladdr(reinterpret_cast<const void*>(&itk_module), &here) == 0) return {};
    const fs::path library = fs::canonical(here.dli_fname, status);
    return library.parent_path() / "covol-" COVOL_VERSION_STRING;
}

fs::path path_of_module(const std::string& name) { return folder_of_modules() / (name + ".so"); }

/// Loads a module. It is never unloaded, because the libraries that it uses start threads and register handlers.
template <typename Module>
const Module& load(const std::string& name, const char* formats) {
    const fs::path path = path_of_module(name);
    void* const library = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    void* const entry = library == nullptr ? nullptr : dlsym(library, ("covol_" + name).c_str());
    if (entry == nullptr) {
        const char* const why = dlerror();
        throw Error(Errc::Io, path.string() + ": covol's module for " + formats +
                                  " could not be loaded: " + (why == nullptr ? "unknown error" : why) +
                                  "; install covol again, with all the libraries that it depends on");
    }
    return *static_cast<const Module*>(reinterpret_cast<const void* (*)()>(entry)());
}

}  // namespace

std::string reader_program() { return folder_of_modules() / "covol-reader"; }

const ItkModule& itk_module() {
    static const auto& module = load<ItkModule>("itk", kOfItk);
    return module;
}

const GdcmModule& gdcm_module() {
    static const auto& module = load<GdcmModule>("gdcm", kOfGdcm);
    return module;
}

const Hdf5Module& hdf5_module() {
    static const auto& module = load<Hdf5Module>("hdf5", kOfHdf5);
    return module;
}

}  // namespace covol::detail

namespace covol {

std::vector<ReaderPart> check_reader_parts() {
    using namespace detail;
    const auto check = [](const std::string& name, const char* formats, const auto& load) {
        ReaderPart part{name, formats, path_of_module(name), {}};
        try {
            (void)load();
        } catch (const Error& error) {
            part.problem = error.what();
        }
        return part;
    };
    return {check("itk", kOfItk, itk_module), check("gdcm", kOfGdcm, gdcm_module), check("hdf5", kOfHdf5, hdf5_module),
            check_reader_program()};
}

}  // namespace covol
