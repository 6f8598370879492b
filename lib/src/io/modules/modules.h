#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "covol/image.h"

// ITK, GDCM and HDF5 are loaded when a file first needs them, because they depend on about sixty other libraries, whose
// loading takes as long as a small computation. Each of the three is wrapped by a module, a shared library that does
// not depend on the other parts of covol. If covol is a static library, and in the tests, the modules are linked
// instead.
namespace covol::detail {

/// The header of an image as ITK reports it; lists have one entry for each dimension.
struct ItkHeader {
    PixelType type = PixelType::UInt8;  ///< type of one component
    unsigned components = 1;
    bool is_rgb = false;
    std::vector<std::uint64_t> size;
    std::vector<double> spacing, origin;
    std::vector<std::vector<double>> axes;  ///< direction of each dimension, as a vector
    std::int64_t bytes = 0;                 ///< size of all pixels in bytes
    double slope = 1, intercept = 0;        ///< rescaling that GDCM applies to a DICOM file's pixels when they are read
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

/// Opens an image file with one of ITK's readers and reads its header. @throws Error InvalidInput if ITK cannot read
/// the file, with a message that begins with `unusable`; Unsupported if its values have none of the types in PixelType.
using OpenWithItk = std::unique_ptr<ItkReader>(const std::string& path, const std::string& unusable);

/// ITK's readers of NRRD and MetaImage, which depend on few libraries.
struct ItkModule {
    OpenWithItk *open_nrrd, *open_meta;
};
/// ITK's reader of DICOM, which uses GDCM.
struct GdcmModule {
    OpenWithItk* open;
};
/// The HDF5 library, and ITK's reader of HDF5 files in the layout that ITK writes.
struct Hdf5Module {
    OpenWithItk* open_itk;
    const struct Hdf5Calls* calls;
};

/// The modules, each loaded by the first call of its function; safe to call from several threads. @throws Error Io (the
/// module cannot be loaded).
const ItkModule& itk_module();
const GdcmModule& gdcm_module();
const Hdf5Module& hdf5_module();

}  // namespace covol::detail
