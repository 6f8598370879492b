#include <gdcmTrace.h>
#include <itkGDCMImageIO.h>

#include "io/modules/itk_io.h"

namespace covol::detail {
namespace {

/// Prevents GDCM from printing messages while this object exists.
class QuietGdcm {
public:
    QuietGdcm() : warning_(gdcm::Trace::GetWarningFlag()), error_(gdcm::Trace::GetErrorFlag()) { set(false, false); }
    ~QuietGdcm() { set(warning_, error_); }
    QuietGdcm(const QuietGdcm&) = delete;
    QuietGdcm& operator=(const QuietGdcm&) = delete;

private:
    static void set(bool warning, bool error) {
        gdcm::Trace::SetWarning(warning);
        gdcm::Trace::SetError(error);
    }
    bool warning_, error_;
};

class GdcmIo : public ItkIo<itk::GDCMImageIO> {
public:
    using ItkIo::ItkIo;
    void read(const std::vector<std::uint64_t>& begin, const std::vector<std::uint64_t>& size, void* out) override {
        const WhileAny<QuietGdcm> quiet;
        ItkIo::read(begin, size, out);
    }
};

std::unique_ptr<ItkReader> open_quietly(const std::string& path, const std::string& unusable) {
    const WhileAny<QuietGdcm> quiet;
    return std::make_unique<GdcmIo>(path, unusable);
}

}  // namespace

const GdcmModule& gdcm_module() {
    static constexpr GdcmModule module{open_quietly};
    return module;
}

}  // namespace covol::detail

extern "C" COVOL_API const void* covol_gdcm() { return &covol::detail::gdcm_module(); }
