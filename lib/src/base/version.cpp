#include "covol/version.h"

namespace covol {

const char* version() noexcept { return COVOL_VERSION_STRING; }

}  // namespace covol
