#include <itkHDF5ImageIO.h>

#include "io/modules/hdf5_calls.h"
#include "io/modules/itk_io.h"

namespace covol::detail {

const Hdf5Module& hdf5_module() {
#define COVOL_ADDRESS(name) &::name,
    static constexpr Hdf5Calls calls{COVOL_HDF5_FUNCTIONS(COVOL_ADDRESS) COVOL_HDF5_NUMBERS(COVOL_ADDRESS)};
#undef COVOL_ADDRESS
    static constexpr Hdf5Module module{open_with<itk::HDF5ImageIO>, &calls};
    return module;
}

}  // namespace covol::detail

extern "C" COVOL_API const void* covol_hdf5() { return &covol::detail::hdf5_module(); }
