#pragma once
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "io/child.h"
#include "io/modules/modules.h"

// DICOM files that go through GDCM: compressed ones, and those of several frames. The library stops at assertions and
// reads outside its buffers where a file is damaged, so it sees none in this process, but in copies of it alone.
namespace covol::detail {

struct GdcmFile {
    std::string path;
    std::string unusable;     ///< begins the message where it cannot be read
    std::uint64_t bytes = 0;  ///< of its pixels, in the type that its header has
};

/// What GDCM says of each image, or why it cannot read it. @throws Error Io (the module cannot be loaded), Cancelled.
std::vector<std::variant<ItkHeader, Error>> gdcm_headers(const std::vector<GdcmFile>& files, const RunContext& run);

/// The pixels of some files.
class GdcmPixels {
public:
    /// Decodes them, several at once. @throws Error InvalidInput, Unsupported, Io, Cancelled; std::bad_alloc.
    GdcmPixels(const std::vector<GdcmFile>& files, const RunContext& run);

    /// `bytes` of the n-th file.
    [[nodiscard]] const char* of(std::size_t n) const { return memory_.data() + begin_[n]; }

private:
    std::vector<std::uint64_t> begin_;  ///< and the end
    SharedMemory memory_;
};

}  // namespace covol::detail
