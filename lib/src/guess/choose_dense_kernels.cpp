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

std::vector<const DenseKernels*> available_dense_kernels() {
    std::vector<const DenseKernels*> sets{&baseline::kDenseKernels};
#ifdef COVOL_X86
    if (detail::available_kernels().size() > 1) sets.push_back(&avx2::kDenseKernels);
#endif
    return sets;
}

const DenseKernels& dense_kernels() {
    const bool is_baseline = detail::kernels().name == std::string_view("baseline");
    return is_baseline ? baseline::kDenseKernels : *available_dense_kernels().back();
}

}  // namespace covol::guess
