#include "limits/memory_budget.h"

#include "base/number.h"
#include "covol/error.h"

namespace covol::detail {

void require_memory(double bytes, const std::string& what, const char* advice, const RunContext& run) {
    if (run.memory_budget == 0 || bytes <= double(run.memory_budget)) return;
    const auto mebibytes = [](double count) { return number(count / (1 << 20)) + " MiB"; };
    throw Error(Errc::InvalidOptions, what + " needs " + mebibytes(bytes) + " of memory, but only " +
                                          mebibytes(double(run.memory_budget)) + " may be used; " + advice);
}

}  // namespace covol::detail
