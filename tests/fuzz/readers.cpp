// Each reader under a coverage-guided fuzzer (clang's libFuzzer): tests/fuzz/run.sh builds and runs it.
//
// COVOL_FUZZ_FORMAT is the end of the file's name, which selects the reader. Exceptions other than covol::Error, and
// reports of a sanitizer, are findings.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>

#include <cstdint>
#include <cstdlib>

#include "damaged_file.h"

namespace {

// If a sanitizer ends the forked copy of this process (io/child.h), the file counts as refused; but the copy inherits
// the fuzzer's handler, which would record a finding.
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
