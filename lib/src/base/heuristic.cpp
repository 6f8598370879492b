// Only compiled in the build that measures the effect of heuristic constants (-DCOVOL_SENSITIVITY=ON, see
// heuristics.h).
#include "base/heuristics.h"

#include <cstdlib>
#include <cstring>

namespace covol {

double heuristic_scale(const char* name) {
    const std::size_t length = std::strlen(name);
    for (const char* at = std::getenv("COVOL_SCALE"); at != nullptr && *at != 0;) {
        if (std::strncmp(at, name, length) == 0 && at[length] == '=') return std::atof(at + length + 1);
        at = std::strchr(at, ',');
        if (at != nullptr) ++at;
    }
    return 1;
}

}  // namespace covol
