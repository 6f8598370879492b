#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "covol/reader_parts.h"
#include "io/child.h"
#include "io/modules/modules.h"

// Reading of files with ITK, GDCM and the HDF5 library in covol-reader, a program in the folder of the modules.
namespace covol::detail {

/// Path of covol-reader. @throws Error Io if it cannot be determined.
std::string reader_program();

/// The formats that each module reads, for messages.
inline constexpr const char *kOfItk = "NRRD and MetaImage", *kOfGdcm = "compressed DICOM", *kOfHdf5 = "HDF5";

/// Checks whether covol-reader exists and may be executed; `problem` of the result is empty if so.
ReaderPart check_reader_program();

/// What covol-reader does with a file. Piece::detail is the beginning of the error message for the tasks of ITK and
/// GDCM, and the name of the dataset for Hdf5.
enum class ReaderTask : std::uint32_t {
    ItkHeader,
    ItkPixels,
    GdcmHeader,
    GdcmPixels,
    Hdf5,  ///< reads the header and one voxel
};

/// An ItkHeader of fixed size without pointers, so that it can be copied to shared memory.
class FlatHeader {
public:
    /// Copies `header`. @returns false, without copying, if it has too many dimensions
    [[nodiscard]] bool take(const ItkHeader& header);
    /// The header; nothing if its type or number of dimensions is invalid, as in memory that was not written to.
    [[nodiscard]] std::optional<ItkHeader> header() const;

private:
    static constexpr std::size_t kMax = 10;
    PixelType type_ = PixelType::UInt8;
    std::uint32_t components_ = 0, is_rgb_ = 0, dimensions_ = 0;
    std::uint64_t size_[kMax] = {};
    double spacing_[kMax] = {}, origin_[kMax] = {}, axes_[kMax][kMax] = {};
    std::int64_t bytes_ = 0;
    double slope_ = 1, intercept_ = 0;
};

/// The header of each file from ITK or GDCM, or the reason why it cannot be read. @throws Error Io, Cancelled;
/// std::bad_alloc.
std::vector<std::variant<ItkHeader, Error>> read_headers(ReaderTask task, const std::vector<Piece>& files,
                                                         const RunContext& run);

/// The decoded pixels of several files.
class DecodedPixels {
public:
    /// Decodes the files, several at once.
    /// @param files  each with the number of bytes of its pixels, in the type that its header states
    /// @throws Error InvalidInput, Unsupported, Io, Cancelled; std::bad_alloc.
    DecodedPixels(ReaderTask task, std::vector<Piece> files, const RunContext& run);

    [[nodiscard]] char* of(std::size_t n) const { return memory_.data() + begin_[n]; }

private:
    /// Position in bytes of each file's pixels in memory_, and the end of the last file's pixels.
    std::vector<std::uint64_t> begin_;
    SharedMemory memory_;
};

/// Tries to read one voxel of an HDF5 file in covol-reader. @throws Error InvalidInput (the library crashes), Io, or
/// the error that reading the file causes.
void try_hdf5(const std::string& path, const std::string& inside);

}  // namespace covol::detail
