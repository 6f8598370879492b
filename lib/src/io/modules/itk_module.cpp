#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include "io/modules/itk_io.h"

namespace covol::detail {

const ItkModule& itk_module() {
    static constexpr ItkModule module{open_with<itk::NrrdImageIO>, open_with<itk::MetaImageIO>};
    return module;
}

}  // namespace covol::detail

extern "C" COVOL_API const void* covol_itk() { return &covol::detail::itk_module(); }
