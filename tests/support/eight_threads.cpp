// Every test program may use eight threads, also where there are fewer cores: tests compare bits of 1, 2 and 8.
#include <tbb/global_control.h>

namespace {
const tbb::global_control eight_threads(tbb::global_control::max_allowed_parallelism, 8);
}
