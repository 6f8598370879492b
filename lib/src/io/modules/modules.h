#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "covol/image.h"

// Libraries that are loaded when a file first needs them: ITK, GDCM and HDF5 depend on sixty others, and loading those
// takes as long as a small job. Each is wrapped by a module, a shared library that does not depend on the rest of
// covol. If covol is static, and in the tests, the modules are linked instead.
namespace covol::detail {

/// Description of an image by ITK; lists have one entry for each dimension.
struct ItkHeader {
    PixelType type = PixelType::UInt8;  ///< type of one component
    unsigned components = 1;
    bool is_rgb = false;
    std::vector<std::uint64_t> size;
    std::vector<double> spacing, origin;
    std::vector<std::vector<double>> axes;  ///< directions, one for each dimension
    std::int64_t bytes = 0;                 ///< of all pixels
    double slope = 1, intercept = 0;        ///< rescaling that is applied to a DICOM file's pixels when they are read
};

/// An image file whose header ITK has read.
class ItkReader {
public:
    ItkReader() = default;
    ItkReader(const ItkReader&) = delete;
    ItkReader& operator=(const ItkReader&) = delete;
    virtual ~ItkReader() = default;

    [[nodiscard]] const ItkHeader& header() const noexcept { return header_; }
    /// Reads the pixels of a box, given along all dimensions. @throws Error InvalidInput with the message `unusable`.
    virtual void read(const std::vector<std::uint64_t>& begin, const std::vector<std::uint64_t>& size, void* out) = 0;
    void read_all(void* out) { read(std::vector<std::uint64_t>(header_.size.size(), 0), header_.size, out); }

protected:
    ItkHeader header_;
};

/// @throws Error InvalidInput with the message `unusable`; Unsupported (types).
using OpenWithItk = std::unique_ptr<ItkReader>(const std::string& path, const std::string& unusable);

/// ITK without its heavier readers.
struct ItkModule {
    OpenWithItk *open_nrrd, *open_meta;
};
/// DICOM by ITK's GDCM.
struct GdcmModule {
    OpenWithItk* open;
};
/// The HDF5 library, and ITK's reader for files in its own layout.
struct Hdf5Module {
    OpenWithItk* open_itk;
    const struct Hdf5Calls* calls;
};

/// Loaded by the first call; safe to call from several threads. @throws Error Io (it cannot be loaded).
const ItkModule& itk_module();
const GdcmModule& gdcm_module();
const Hdf5Module& hdf5_module();

}  // namespace covol::detail
