#pragma once
#include "covol/api.h"

namespace covol {

/// The main function of covol-reader. @returns 2 if the library did not start it.
COVOL_API int serve_reader(int count, char** arguments);

}  // namespace covol
