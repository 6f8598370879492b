// Fuzzes a reader of files with libFuzzer, clang's coverage-guided fuzzer; tests/fuzz/run.sh builds and runs this
// program.
//
// The environment variable COVOL_FUZZ_FORMAT is the ending of the file's name, which selects the reader. Findings are
// exceptions other than covol::Error, and reports of a sanitizer.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>

#include <cstdint>
#include <cstdlib>

#include "damaged_file.h"

namespace {

// Some readers run in a forked copy of the process (io/child.h). If a sanitizer ends this copy, the file only counts as
// refused. The handler that the copy inherits from the fuzzer would record a finding, so it is removed.
void end_copies_without_a_finding() { __sanitizer_set_death_callback(nullptr); }

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    return pthread_atfork(nullptr, nullptr, end_copies_without_a_finding);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const char* const end = std::getenv("COVOL_FUZZ_FORMAT");
    static const DamagedFile file(end != nullptr ? end : "");
    file.read({reinterpret_cast<const char*>(data), size});
    return 0;
}
