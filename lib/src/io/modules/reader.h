#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "covol/reader_parts.h"
#include "io/child.h"
#include "io/modules/modules.h"

// Files that ITK, GDCM and the HDF5 library read in covol-reader, a program that lies beside the modules.
namespace covol::detail {

/// Where it lies. @throws Error Io where that cannot be said.
std::string reader_program();

/// What parts are for, in a few words.
inline constexpr const char *kOfItk = "NRRD and MetaImage", *kOfGdcm = "compressed DICOM", *kOfHdf5 = "HDF5";

/// Whether it is there and may be started.
ReaderPart check_reader_program();

/// What it is asked to do with a file. A Piece's detail begins the message where ITK or GDCM cannot read it, and names
/// the dataset in an HDF5 file.
enum class ReaderTask : std::uint32_t {
    ItkHeader,
    ItkPixels,
    GdcmHeader,
    GdcmPixels,
    Hdf5,  ///< header and one voxel
};

/// An ItkHeader that memory can hold which is shared.
class FlatHeader {
public:
    /// @returns whether it has room for so many dimensions
    [[nodiscard]] bool take(const ItkHeader& header);
    /// Nothing where the program did not write one.
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

/// What ITK or GDCM says of each file, or why it cannot read it. @throws Error Io, Cancelled; std::bad_alloc.
std::vector<std::variant<ItkHeader, Error>> read_headers(ReaderTask task, const std::vector<Piece>& files,
                                                         const RunContext& run);

/// The pixels of some files.
class DecodedPixels {
public:
    /// Decodes them, several at once. @param files  each with the bytes of its pixels, in the type that its header has
    /// @throws Error InvalidInput, Unsupported, Io, Cancelled; std::bad_alloc.
    DecodedPixels(ReaderTask task, std::vector<Piece> files, const RunContext& run);

    [[nodiscard]] char* of(std::size_t n) const { return memory_.data() + begin_[n]; }

private:
    std::vector<std::uint64_t> begin_;  ///< and the end
    SharedMemory memory_;
};

/// Tries an HDF5 file. @throws Error InvalidInput (the library crashes), and what reading it threw; Io.
void try_hdf5(const std::string& path, const std::string& inside);

}  // namespace covol::detail
