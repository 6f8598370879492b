// Locates covol-reader if covol is a static library: in ../lib/covol-VERSION relative to the program's folder if it
// exists there, otherwise in the folder that the build has set.
#include <filesystem>

#include "covol/version.h"
#include "io/modules/reader.h"

namespace covol::detail {

std::string reader_program() {
    namespace fs = std::filesystem;
    std::error_code status;
    const fs::path installed = fs::path(COVOL_READER_FOLDER) / "covol-reader";
    const fs::path program = fs::read_symlink("/proc/self/exe", status);
    const fs::path beside =
        program.parent_path().parent_path() / "lib" / "covol-" COVOL_VERSION_STRING / installed.filename();
    return fs::exists(beside, status) ? beside : installed;
}

}  // namespace covol::detail

namespace covol {

std::vector<ReaderPart> check_reader_parts() {
    using namespace detail;
    return {{"itk", kOfItk, {}, {}}, {"gdcm", kOfGdcm, {}, {}}, {"hdf5", kOfHdf5, {}, {}}, check_reader_program()};
}

}  // namespace covol
