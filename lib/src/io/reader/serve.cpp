// The tasks of the program covol-reader: enum ReaderTask in modules/reader.h.
#include "io/reader/serve.h"

#include <cstring>
#include <memory>

#include "covol/run.h"
#include "io/child.h"
#include "io/image/image_formats.h"
#include "io/modules/reader.h"

namespace covol {
namespace {

using namespace detail;

std::unique_ptr<ItkReader> open(const PieceAtWork& piece) {
    const bool is_dicom =
        piece.task == std::uint32_t(ReaderTask::GdcmHeader) || piece.task == std::uint32_t(ReaderTask::GdcmPixels);
    OpenWithItk* const open = is_dicom ? gdcm_module().open : itk_reader_of(piece.path);
    return open(piece.path, piece.detail);
}

void write_header(const PieceAtWork& piece) {
    FlatHeader flat;
    static_assert(sizeof flat <= kAnswerBytes);
    if (!flat.take(open(piece)->header())) throw Error(Errc::InvalidInput, piece.detail);
    std::memcpy(piece.answer.data(), &flat, sizeof flat);
}

void write_pixels(const PieceAtWork& piece) {
    const std::unique_ptr<ItkReader> reader = open(piece);
    if (reader->header().bytes < 0 || std::uint64_t(reader->header().bytes) != piece.result.size())
        throw Error(Errc::InvalidInput, piece.detail);
    reader->read_all(piece.result.data());
}

void try_voxel(const PieceAtWork& piece) {
    RunContext alone;
    alone.threads = 1;
    with_threads(alone, [&] {
        const std::unique_ptr<ImageFile> file = open_either_hdf5({piece.path, piece.detail});
        try {
            (void)file->read({{{0, 0, 0}, {0, 0, 0}}}, alone);
        } catch (const Error&) {
            // The error of this voxel is ignored, because other channels or frames may be readable.
        }
    });
}

void do_task(const PieceAtWork& piece) {
    switch (static_cast<ReaderTask>(piece.task)) {
        case ReaderTask::ItkHeader:
        case ReaderTask::GdcmHeader: return write_header(piece);
        case ReaderTask::ItkPixels:
        case ReaderTask::GdcmPixels: return write_pixels(piece);
        case ReaderTask::Hdf5: return try_voxel(piece);
    }
}

}  // namespace

int serve_reader(int count, char** arguments) { return serve_pieces(count, arguments, do_task); }

}  // namespace covol
