// Allows every test program eight threads, even on fewer cores: tests compare results of 1, 2 and 8 bit by bit.
#include <tbb/global_control.h>

namespace {
const tbb::global_control eight_threads(tbb::global_control::max_allowed_parallelism, 8);
}
