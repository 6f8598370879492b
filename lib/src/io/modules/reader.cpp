#include "io/modules/reader.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

namespace covol::detail {
namespace {

const char* library_of(ReaderTask task) {
    if (task == ReaderTask::Hdf5) return "HDF5";
    return task == ReaderTask::ItkHeader || task == ReaderTask::ItkPixels ? "ITK" : "GDCM";
}

std::vector<PieceOutcome> try_task(ReaderTask task, const std::vector<Piece>& files, const SharedMemory& results,
                                   double seconds, const RunContext& run) {
    return run_pieces(reader_program(), static_cast<std::uint32_t>(task), files, results, seconds, run);
}

std::vector<std::uint64_t> begins_of(const std::vector<Piece>& files) {
    constexpr std::uint64_t kAlignment = 16;
    std::vector<std::uint64_t> begins{0};
    for (const Piece& file : files)
        begins.push_back((begins.back() + file.bytes + kAlignment - 1) / kAlignment * kAlignment);
    return begins;
}

}  // namespace

ReaderPart check_reader_program() {
    ReaderPart part{"covol-reader", "DICOM, HDF5, NRRD, MetaImage, in a separate process", reader_program(), {}};
    if (::access(part.path.c_str(), X_OK) != 0)
        part.problem =
            part.path + ": expected covol's reader program, got: " + std::strerror(errno) + "; install covol again";
    return part;
}

bool FlatHeader::take(const ItkHeader& header) {
    if (header.size.size() > kMax) return false;
    type_ = header.type;
    components_ = header.components;
    is_rgb_ = header.is_rgb ? 1 : 0;
    bytes_ = header.bytes;
    slope_ = header.slope;
    intercept_ = header.intercept;
    dimensions_ = static_cast<std::uint32_t>(header.size.size());
    std::copy(header.size.begin(), header.size.end(), size_);
    std::copy(header.spacing.begin(), header.spacing.end(), spacing_);
    std::copy(header.origin.begin(), header.origin.end(), origin_);
    for (std::size_t a = 0; a < dimensions_; ++a) std::copy(header.axes[a].begin(), header.axes[a].end(), axes_[a]);
    return true;
}

std::optional<ItkHeader> FlatHeader::header() const {
    if (dimensions_ < 1 || dimensions_ > kMax || static_cast<unsigned>(type_) > unsigned(PixelType::Double))
        return std::nullopt;
    ItkHeader header;
    header.type = type_;
    header.components = components_;
    header.is_rgb = is_rgb_ != 0;
    header.bytes = bytes_;
    header.slope = slope_;
    header.intercept = intercept_;
    header.size.assign(size_, size_ + dimensions_);
    header.spacing.assign(spacing_, spacing_ + dimensions_);
    header.origin.assign(origin_, origin_ + dimensions_);
    for (const auto& axis : std::span(axes_).first(dimensions_)) header.axes.emplace_back(axis, axis + dimensions_);
    return header;
}

std::vector<std::variant<ItkHeader, Error>> read_headers(ReaderTask task, const std::vector<Piece>& files,
                                                         const RunContext& run) {
    const std::vector<PieceOutcome> trials = try_task(task, files, SharedMemory(0), kMaxSecondsForHeader, run);
    std::vector<std::variant<ItkHeader, Error>> headers;
    for (std::size_t n = 0; n < files.size(); ++n) {
        FlatHeader flat;
        if (!trials[n].answer.empty()) std::memcpy(&flat, trials[n].answer.data(), sizeof flat);
        if (const auto error = reading_error(trials[n], files[n].path, library_of(task))) {
            if (error->code() == Errc::Io)
                // A module cannot be loaded. This is no property of the file, so the whole call fails.
                throw Error(*error);
            headers.emplace_back(*error);
        } else if (const auto header = flat.header())
            headers.emplace_back(*header);
        else
            headers.emplace_back(Error(Errc::InvalidInput, files[n].detail));
    }
    return headers;
}

DecodedPixels::DecodedPixels(ReaderTask task, std::vector<Piece> files, const RunContext& run)
    : begin_(begins_of(files)), memory_(begin_.back()) {
    if (files.empty()) return;
    std::uint64_t maximum = 0;
    for (std::size_t n = 0; n < files.size(); ++n) {
        files[n].begin = begin_[n];
        maximum = std::max(maximum, files[n].bytes);
    }
    const std::vector<PieceOutcome> trials = try_task(task, files, memory_, max_seconds_for_pixels(maximum), run);
    for (std::size_t n = 0; n < files.size(); ++n)
        if (const auto error = reading_error(trials[n], files[n].path, library_of(task))) throw Error(*error);
}

void try_hdf5(const std::string& path, const std::string& inside) {
    Piece file;
    file.path = path;
    file.detail = inside;
    const std::vector<PieceOutcome> trials =
        try_task(ReaderTask::Hdf5, {file}, SharedMemory(0), kMaxSecondsForHeader, RunContext());
    if (const auto error = reading_error(trials.front(), path, "HDF5")) throw Error(*error);
}

}  // namespace covol::detail
