#pragma once
#include "covol/api.h"

namespace covol {

/// The main function of covol-reader. @returns 2 if the program was not started by run_pieces(); otherwise it does not
/// return.
COVOL_API int serve_reader(int count, char** arguments);

}  // namespace covol
