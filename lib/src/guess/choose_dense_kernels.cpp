#include <string_view>

#include "guess/dense_kernels.h"
#include "scheme/scheme.h"

namespace covol::guess {

namespace baseline {
extern const DenseKernels kDenseKernels;
}
#ifdef COVOL_X86
namespace avx2 {
extern const DenseKernels kDenseKernels;
}
#endif

const DenseKernels& dense_kernels() {
#ifdef COVOL_X86
    // With AVX-512, a system of 300 marks takes as long.
    if (detail::kernels().name != std::string_view("baseline")) return avx2::kDenseKernels;
#endif
    return baseline::kDenseKernels;
}

}  // namespace covol::guess
