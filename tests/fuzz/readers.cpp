// Each reader under a fuzzer that is guided by coverage (clang's libFuzzer): tests/fuzz/run.sh builds and runs it.
//
// COVOL_FUZZ_FORMAT says how the file's name ends, and thereby which reader gets it. Everything that is thrown and no
// covol::Error, and whatever a sanitizer finds, is a finding.
#include <cstdint>
#include <cstdlib>

#include "damaged_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const char* const end = std::getenv("COVOL_FUZZ_FORMAT");
    static const DamagedFile file(end != nullptr ? end : "");
    file.read({reinterpret_cast<const char*>(data), size});
    return 0;
}
