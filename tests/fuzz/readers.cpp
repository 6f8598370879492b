// Each reader under a fuzzer that is guided by coverage (clang's libFuzzer): tests/fuzz/run.sh builds and runs it.
//
// COVOL_FUZZ_FORMAT says how the file's name ends, and thereby which reader gets it. Everything that is thrown and no
// covol::Error, and whatever a sanitizer finds, is a finding.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>

#include <cstdint>
#include <cstdlib>

#include "damaged_file.h"

namespace {

// A copy of the process that a sanitizer ends is a file that is refused (io/child.h): it has the fuzzer's handler from
// this process, which would keep the file as a finding.
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
